"""Pictures of any format become small upright JPEG images; what is no picture is named."""

import numpy as np
import pytest
import simplejpeg
from PIL import Image

from app.cli.tools.picture import MAX_SIDE_PX, read_jpeg
from app.errors import UsageError


def test_a_large_picture_is_reduced_and_turned_upright(tmp_path):
    photo = Image.new("RGB", (2000, 1000), (200, 30, 30))
    exif = photo.getexif()
    exif[0x0112] = 6
    photo.save(tmp_path / "photo.jpg", exif=exif)
    shown = simplejpeg.decode_jpeg(read_jpeg(tmp_path / "photo.jpg"))
    assert shown.shape == (MAX_SIDE_PX, MAX_SIDE_PX // 2, 3)
    np.testing.assert_allclose(shown[300, 100], (200, 30, 30), atol=8)


@pytest.mark.parametrize(("name", "mode"), [("a.png", "RGBA"), ("a.webp", "RGB"), ("a.gif", "P")])
def test_other_formats(tmp_path, name, mode):
    Image.new(mode, (40, 30)).save(tmp_path / name)
    assert simplejpeg.decode_jpeg(read_jpeg(tmp_path / name)).shape == (30, 40, 3)


def test_a_picture_of_noise_fits_a_request(tmp_path):
    noise = np.random.default_rng(0).integers(0, 255, (900, 900, 3), np.uint8)
    Image.fromarray(noise).save(tmp_path / "noise.png")
    assert len(read_jpeg(tmp_path / "noise.png")) < 600_000


def test_what_is_no_picture_is_named(tmp_path):
    with pytest.raises(UsageError, match=r"cannot read the picture .*none\.jpg"):
        read_jpeg(tmp_path / "none.jpg")
    with pytest.raises(UsageError, match="cannot read the picture"):
        read_jpeg(tmp_path)
    (tmp_path / "text.jpg").write_text("no picture")
    with pytest.raises(UsageError, match="no picture in a known format: give a JPEG"):
        read_jpeg(tmp_path / "text.jpg")
    Image.new("RGB", (400, 300), (9, 9, 9)).save(tmp_path / "cut.png")
    whole = (tmp_path / "cut.png").read_bytes()
    (tmp_path / "cut.png").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(UsageError, match="cannot read the picture"):
        read_jpeg(tmp_path / "cut.png")


def test_a_bomb_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(Image, "MAX_IMAGE_PIXELS", 1000)
    Image.new("L", (60, 60)).save(tmp_path / "bomb.png")
    with pytest.raises(UsageError, match="too many pixels"):
        read_jpeg(tmp_path / "bomb.png")

import numpy as np
import simplejpeg

from app.messages.images import decompress_color
from app.nodes.console.picture import outlined
from app.view.colors import FOUND


def _jpeg():
    return simplejpeg.encode_jpeg(np.full((100, 160, 3), 200, np.uint8), quality=95)


def test_the_object_is_framed_in_green_and_the_rest_dimmed():
    image = decompress_color(outlined(_jpeg(), (40, 30, 80, 60))).astype(int)
    assert image.shape == (100, 160, 3)
    assert abs(image[45, 60] - 200).max() < 12
    assert abs(image[5, 5] - 100).max() < 12
    assert np.abs(image[28, 60] - FOUND).max() < 60


def test_a_box_beyond_the_picture_is_cut():
    image = decompress_color(outlined(_jpeg(), (-50, -50, 900, 900)))
    assert image.shape == (100, 160, 3)
    assert abs(image[50, 80].astype(int) - 200).max() < 12


def test_without_a_box_or_a_readable_picture_nothing_is_changed():
    jpeg = _jpeg()
    assert outlined(jpeg, None) is jpeg
    assert outlined(b"broken", (1, 1, 5, 5)) == b"broken"

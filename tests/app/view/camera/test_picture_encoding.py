import io

import numpy as np
import pytest
import simplejpeg
from PIL import Image

from app.messages.cdr import MessageError
from app.view.camera.picture_encoding import (
    encoded_picture,
    quarter_turns,
    scaled_picture,
    turned,
)
from app.view.camera.stream_budget import Rung
from app.view.colors import FOUND
from ippon.geometry import base_pose
from ippon.robot import ZED

SMALL = Rung(longest_px=320, quality=80)


def _jpeg(image, colorspace="RGB"):
    return simplejpeg.encode_jpeg(np.ascontiguousarray(image), quality=90, colorspace=colorspace)


def _png(image):
    out = io.BytesIO()
    Image.fromarray(image).save(out, "PNG")
    return out.getvalue()


def _gradient(height, width):
    return np.dstack(
        [
            np.broadcast_to(np.linspace(0, 255, width), (height, width)),
            np.broadcast_to(np.linspace(0, 255, height)[:, None], (height, width)),
            np.full((height, width), 90.0),
        ]
    ).astype(np.uint8)


@pytest.mark.slow
def test_an_image_of_4k_becomes_small_and_keeps_its_content():
    whole = _gradient(2160, 3840)
    small = scaled_picture(_jpeg(whole), 640)
    assert small.shape == (360, 640, 3)
    rows, columns = np.arange(360) * 6 + 3, np.arange(640) * 6 + 3
    assert np.abs(small.astype(int) - whole[rows][:, columns].astype(int)).mean() < 3.0


@pytest.mark.parametrize(("height", "width"), [(480, 640), (1200, 675), (17, 900)])
def test_the_longer_side_is_bounded_and_the_shape_kept(height, width):
    small = scaled_picture(_jpeg(_gradient(height, width)), 320)
    assert max(small.shape[:2]) == 320
    assert small.shape[0] / small.shape[1] == pytest.approx(height / width, abs=0.07)


def test_a_small_image_is_not_enlarged():
    assert scaled_picture(_jpeg(_gradient(50, 60)), 640).shape == (50, 60, 3)


@pytest.mark.parametrize("encoded", ["jpeg", "png"])
def test_grey_images_are_grey(encoded):
    grey = np.broadcast_to(np.linspace(0, 255, 64).astype(np.uint8), (48, 64))
    data = _png(grey) if encoded == "png" else _jpeg(grey[:, :, None], "GRAY")
    image = scaled_picture(data, 64)
    assert image.shape == (48, 64, 3)
    assert np.ptp(image.astype(int), axis=2).max() <= 2


@pytest.mark.parametrize("turns", [0, 1, 2, 3])
def test_a_camera_mounted_at_a_quarter_turn_is_shown_upright(turns):
    roll = 0.5 * np.pi * turns
    c, s = np.cos(roll), np.sin(roll)
    T_camera_mounted = np.eye(4)
    T_camera_mounted[:2, :2] = [[c, -s], [s, c]]
    upright = base_pose(1.0, 2.0, 0.0, 0.7) @ ZED.T_base_camera(-0.3)
    counted = quarter_turns(upright @ T_camera_mounted)
    # A camera that is rolled clockwise sees the world rolled counterclockwise.
    assert counted == -turns % 4
    image = _gradient(40, 60)
    seen = np.rot90(image, turns)
    shown = scaled_picture(encoded_picture(_jpeg(seen), SMALL, counted), 320)
    assert shown.shape == image.shape
    assert np.abs(shown.astype(int) - image.astype(int)).mean() < 5.0


def test_points_turn_with_the_image():
    image = np.zeros((40, 60, 3), np.uint8)
    image[5:9, 50:54] = 255
    x, y = turned(52 / 60, 7 / 40, 1)
    shown = np.rot90(image, 1)
    assert shown[int(y * shown.shape[0]), int(x * shown.shape[1])].min() == 255


def test_a_camera_that_looks_straight_down_is_not_turned():
    down = np.eye(4)
    down[:3, :3] = [[1, 0, 0], [0, -1, 0], [0, 0, -1]]
    assert quarter_turns(down) == 0


def test_heat_tints_where_it_is_and_nowhere_else():
    image = np.full((48, 64, 3), 120, np.uint8)
    heat = np.zeros((6, 8), np.uint8)
    heat[:, :4] = 255
    shown = scaled_picture(encoded_picture(_jpeg(image), SMALL, 0, heat), 320).astype(int)
    assert np.abs(shown[:, 40:] - 120).max() < 8
    expected = np.array([120, 120, 120]) * 0.6 + np.array(FOUND) * 0.4
    assert np.abs(shown[10:38, 6:24].mean(axis=(0, 1)) - expected).max() < 8
    assert np.abs(shown[10:38, 30:32].mean(axis=(0, 1)) - np.array(FOUND)).max() < 40, "a rim"


@pytest.mark.parametrize(
    "data", [b"\xff\xd8\xff", b"\x89PNG\r\n\x1a\nno", b"\xff\xd8\xff" + bytes(99)]
)
def test_a_damaged_image_is_refused(data):
    with pytest.raises(MessageError, match="damaged"):
        encoded_picture(data, SMALL, 0)

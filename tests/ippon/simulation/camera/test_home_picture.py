import dataclasses

import numpy as np
import pytest

from tests import later

_bounds, picture_from_above = later.names(
    "ippon.simulation.camera.home_picture", "_bounds", "picture_from_above"
)


def _pixel(scene, scale, x, y):
    low, high = _bounds(scene)
    return int((high[1] - y) * scale), int((x - low[0]) * scale)


def test_walls_are_dark_and_things_have_their_colours(make_scene, room_boxes):
    boxes = [*room_boxes(), ("chair", "chair", (2.0, 2.0, 0.0), (3.0, 3.0, 0.5))]
    scene = make_scene(boxes)
    colors = scene.face_colors.copy()
    colors[scene.face_instance == 6] = (220, 20, 20)
    scene = dataclasses.replace(scene, face_colors=colors)
    image = picture_from_above(scene, pixels_per_metre=50.0)
    assert image.dtype == np.uint8
    low, high = _bounds(scene)
    assert image.shape[1] == int((high[0] - low[0]) * 50.0)
    r, g, b = image[_pixel(scene, 50.0, 2.9, 2.9)].astype(int)
    assert r > 120 > g + 60
    assert image[_pixel(scene, 50.0, -0.05, 2.0)].max() < 90
    assert image[_pixel(scene, 50.0, -0.4, 2.0)].min() > 240
    assert b < 100


def test_the_ceiling_is_cut_away_and_hanging_lamps_with_it(make_scene, room_boxes):
    lamp = ("lighting", "pendant lamp", (2.0, 2.0, 1.9), (3.0, 3.0, 2.3))
    bare = picture_from_above(make_scene(room_boxes()), pixels_per_metre=30.0)
    lit = picture_from_above(make_scene([*room_boxes(), lamp]), pixels_per_metre=30.0)
    height = bare.shape[0] - 40
    assert np.abs(bare[:height].astype(int) - lit[:height].astype(int)).max() < 30


def test_trail_and_marks_change_the_picture_where_they_are(furnished):
    plain = picture_from_above(furnished, pixels_per_metre=40.0)
    trail = np.array([[1.0, 3.5, 0.0], [2.2, 3.5, 0.0]])
    drawn = picture_from_above(
        furnished, pixels_per_metre=40.0, trail=trail, marks={"found": (0.4, 0.5)}
    )
    at = _pixel(furnished, 40.0, 1.6, 3.5)
    assert tuple(drawn[at]) != tuple(plain[at])
    changed = np.argwhere((drawn != plain).any(axis=2))
    near = np.hypot(*(changed - _pixel(furnished, 40.0, 0.4, 0.5)).T) < 40
    assert near.any()
    single = picture_from_above(furnished, pixels_per_metre=40.0, trail=trail[:1])
    assert (single != plain).any()


def test_textures_show(furnished):
    red = np.full((4, 4, 3), (250, 0, 0), np.uint8)
    count = len(furnished.faces)
    textured = dataclasses.replace(
        furnished,
        textures=(red,),
        face_texture=np.where(furnished.face_instance == 0, 0, -1).astype(np.int32),
        face_uvs=np.zeros((count, 3, 2), np.float32),
    )
    image = picture_from_above(textured, pixels_per_metre=40.0)
    r, g, b = image[_pixel(furnished, 40.0, 1.7, 3.0)].astype(int)
    assert r > 120
    assert g < 40 > b


@pytest.mark.parametrize("scale", [0.0, -3.0, float("nan"), 5000.0])
def test_a_useless_scale_is_refused(furnished, scale):
    with pytest.raises(ValueError, match="pixels per metre gives no usable picture"):
        picture_from_above(furnished, pixels_per_metre=scale)

"""Small pictures of places."""

import numpy as np

from ippon.geometry import base_pose
from ippon.tracking.keyframes import SIZE, Keyframes, small_picture


def picture(seed):
    blocks = np.random.default_rng(seed).integers(0, 255, (12, 16, 3)).astype(np.uint8)
    return np.repeat(np.repeat(blocks, 10, axis=0), 10, axis=1)


def test_small_pictures_ignore_brightness_and_contrast():
    image = picture(1)
    dim = (0.5 * image + 20.0).astype(np.uint8)
    assert small_picture(image).shape == SIZE
    assert float(np.sum(small_picture(image) * small_picture(dim))) > 0.99
    assert not small_picture(np.full((120, 160, 3), 9, np.uint8)).any()


def test_only_other_places_and_directions_are_kept():
    frames = Keyframes()
    for pose in (
        base_pose(0, 0, 0, 0.0),
        base_pose(0.1, 0, 0, 0.1),
        base_pose(0.5, 0, 0, 0.0),
        base_pose(0, 0, 0, 1.0),
    ):
        frames.offer(picture(1), pose)
    assert len(frames) == 3


def test_the_most_similar_come_first():
    frames = Keyframes()
    assert frames.similar(picture(1), 3) == []
    for k in range(5):
        frames.offer(picture(k), base_pose(float(k), 0, 0, 0.0))
    found = frames.similar(picture(3), 2)
    assert len(found) == 2
    assert found[0][0, 3] == 3.0

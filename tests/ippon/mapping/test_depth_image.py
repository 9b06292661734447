"""Depth images as the kernels read them."""

import numpy as np

from ippon.camera import PinholeCamera
from ippon.mapping.depth_image import prepare_depth


def test_nothing_is_left_of_the_image_before() -> None:
    camera = PinholeCamera.from_horizontal_fov(40, 30, 1.2)
    depth = np.random.default_rng(1).uniform(0.5, 6.0, (30, 40)).astype(np.float32)
    depth[5:9] = np.nan
    depth[:, 30:] = 0.0
    depth[20, 20] = 30.0
    before = np.pad(np.full((30, 40), 3.0, np.float32), 1)

    kept = prepare_depth(depth, camera, 20.0, before)

    fresh = prepare_depth(depth, camera, 20.0, np.zeros((32, 42), np.float32))
    assert kept.depth is before
    for one, other in zip(kept, fresh, strict=True):
        np.testing.assert_array_equal(one, other)
    valid = (depth > 0.0) & (depth <= 20.0)
    np.testing.assert_array_equal(kept.depth, np.pad(np.where(valid, depth, np.float32(0.0)), 1))

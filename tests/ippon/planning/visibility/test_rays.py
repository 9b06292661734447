"""Rays cast together against one followed slowly by itself."""

import math

import numpy as np
import pytest

from ippon.mapping.arrays import OCCUPIED
from ippon.planning.visibility.rays import cast_ray, cast_rays
from tests.ippon.planning.visibility.test_panorama import make_table
from tests.reference import planning_view as reference


@pytest.mark.parametrize("seed", range(3))
def test_rays_end_where_each_would_by_itself(speckled, seed):
    volume = speckled(seed)
    camera = (int(volume.origin[0] * 8 + 20), int(volume.origin[1] * 8 + 20), 8)
    table = make_table(range_voxels=14.0, yaw_bins=40)
    arrays = volume.arrays()
    cells = np.arange(len(table.rays), dtype=np.int64)[::-1].copy()
    assert len(cells) > 512, "several batches, and a part of one"
    depth = cast_rays(arrays, table, 6.0, np.array(camera), cells)
    expected = [reference.ray_end(arrays, table, 6.0, camera, table.rays[c]) for c in cells]
    np.testing.assert_array_equal(depth, [-end if hit else end for end, hit in expected])
    hits = sum(hit for _, hit in expected)
    assert 0 < hits < len(cells), "the scene must stop some rays and let others pass"
    for n in range(0, len(cells), 97):
        assert cast_ray(arrays, table, 6.0, camera, table.rays[cells[n]]) == depth[n]


def test_a_ray_meets_the_wall_ahead_and_none_where_there_is_none(dense_map):
    volume = dense_map().room((0.8, 0.8), (5.6, 5.6))
    volume.fill((4.0, 2.0, 0.0), (4.1, 4.4, 2.0), OCCUPIED)
    table = make_table(range_voxels=15.0)
    camera = (32, 32, 10)
    ahead = cast_ray(volume.arrays(), table, 6.0, camera, np.array([1.0, 0.0, 0.0]))
    assert -9.0 <= ahead <= -7.0
    assert cast_ray(volume.arrays(), table, 6.0, camera, np.array([-1.0, 0.0, 0.0])) == 15.0
    up = np.array([math.cos(0.7), 0.0, math.sin(0.7)])
    assert cast_ray(volume.arrays(), table, 6.0, camera, -up) > 0.0, "it leaves the layers"


def test_a_range_within_the_cameras_own_voxels_is_the_rays_length(dense_map):
    table = make_table(range_voxels=1.0)
    cells = np.arange(10, dtype=np.int64)
    depth = cast_rays(dense_map().arrays(), table, 6.0, np.array([32, 32, 10]), cells)
    assert (depth == 1.0).all()

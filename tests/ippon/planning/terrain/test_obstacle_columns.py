"""Reading the floor and the body's height from columns of voxels."""

import numpy as np
import pytest

from ippon.mapping.arrays import FREE, OCCUPIED, UNKNOWN
from ippon.planning.terrain.obstacle_columns import (
    COLUMN_BLOCKED,
    COLUMN_CLEAR,
    COLUMN_UNSEEN,
    FLOOR_ABSENT,
    FLOOR_SEEN,
    HeightBands,
    changed_block_columns,
    classify_columns,
)
from ippon.robot import HABITAT, ZED
from tests.reference import planning_floor as reference


def _read(volume, robot=ZED):
    arrays = volume.arrays()
    bands = HeightBands.of(robot, 0.0, volume.voxel_size)
    blocks = changed_block_columns(arrays, bands, -1)
    out = np.zeros(volume.state.shape[:2], dtype=np.uint8)
    classify_columns(arrays, bands, blocks, 0.5, volume.origin[:2] * 8, out)
    return out, arrays, bands


@pytest.mark.parametrize("robot", [ZED, HABITAT])
@pytest.mark.parametrize("voxel_size", [0.05, 0.1])
@pytest.mark.parametrize("floor_z", [0.0, 0.03, -0.04, 1.27])
def test_a_floor_is_no_obstacle_and_a_high_step_is_one(robot, voxel_size, floor_z):
    bands = HeightBands.of(robot, floor_z, voxel_size)
    # A surface shows in the voxels whose centre lies within half a voxel of it.
    for error in (-0.4, 0.0, 0.4):
        floor = np.floor(floor_z / voxel_size + error)
        assert bands.floor_low <= floor <= bands.floor_high
    step = floor_z + robot.max_step_m + voxel_size
    assert np.floor(step / voxel_size) >= bands.body_low
    top = max(s.z_m + s.radius_m for s in robot.spheres)
    assert bands.body_high * voxel_size < floor_z + top <= (bands.body_high + 1.001) * voxel_size


def test_kinds_of_columns(dense_map):
    volume = dense_map((3.2, 0.8, 2.4))
    volume.fill((0.0, 0.0, -0.1), (3.2, 0.8, 0.0), OCCUPIED)
    volume.fill((0.8, 0.0, 0.0), (3.2, 0.8, 2.0), FREE)
    volume.fill((1.6, 0.0, 0.7), (2.4, 0.8, 0.8), OCCUPIED)
    volume.fill((2.4, 0.0, -0.8), (3.2, 0.8, 0.0), FREE)
    out, _, _ = _read(volume)
    assert out[0, 0] == COLUMN_UNSEEN | FLOOR_SEEN
    assert out[8, 0] == COLUMN_CLEAR | FLOOR_SEEN
    assert out[16, 0] == COLUMN_BLOCKED | FLOOR_SEEN, "a table top is in the way of the body"
    assert out[24, 0] == COLUMN_CLEAR | FLOOR_ABSENT, "a drop"


@pytest.mark.parametrize("robot", [ZED, HABITAT])
def test_a_stair_down_is_a_drop_and_an_unseen_depth_is_not(dense_map, robot):
    volume = dense_map((1.6, 0.8, 2.4))
    volume.fill((0.0, 0.0, -0.1), (1.6, 0.8, 2.0), FREE)
    volume.fill((0.0, 0.0, -0.2), (0.8, 0.8, -0.1), OCCUPIED)
    out, _, _ = _read(volume, robot)
    assert out[0, 0] == COLUMN_CLEAR | FLOOR_ABSENT
    assert out[8, 0] == COLUMN_CLEAR


def test_what_hangs_above_the_robot_does_not_block(dense_map):
    volume = dense_map((0.8, 0.8, 2.4))
    volume.fill((0.0, 0.0, -0.1), (0.8, 0.8, 0.0), OCCUPIED)
    volume.fill((0.0, 0.0, 0.0), (0.8, 0.8, 2.0), FREE)
    volume.fill((0.0, 0.0, 1.3), (0.8, 0.8, 1.4), OCCUPIED)
    assert (_read(volume)[0] == COLUMN_CLEAR | FLOOR_SEEN).all()
    assert ((_read(volume, HABITAT)[0] & 3) == COLUMN_BLOCKED).all(), "a taller robot hits it"


@pytest.mark.parametrize("seed", range(4))
def test_agrees_with_the_slow_way(speckled, seed):
    volume = speckled(seed)
    out, arrays, bands = _read(volume)
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            x, y = np.array([i, j]) + volume.origin[:2] * 8
            expected = reference.column(arrays, bands, x, y, 0.5)
            block = arrays.directory[i // 8, j // 8]
            if (block >= 0).any():
                assert out[i, j] == expected


def test_only_blocks_of_the_robots_height_that_changed_are_read_again(dense_map):
    volume = dense_map((3.2, 3.2, 4.8))
    arrays = volume.arrays()
    bands = HeightBands.of(ZED, 0.0, 0.1)
    assert len(changed_block_columns(arrays, bands, -1)) == 16
    assert len(changed_block_columns(arrays, bands, volume.revision)) == 0
    seen = volume.revision
    volume.fill((1.0, 2.0, 0.3), (1.1, 2.1, 0.4), OCCUPIED)
    assert changed_block_columns(volume.arrays(), bands, seen).tolist() == [[1, 2]]
    seen = volume.revision
    volume.fill((1.0, 2.0, 4.3), (1.1, 2.1, 4.4), UNKNOWN).fill(
        (1.0, 2.0, 4.3), (1.1, 2.1, 4.4), OCCUPIED
    )
    assert len(changed_block_columns(volume.arrays(), bands, seen)) == 0, "far above the robot"

"""A map of yesterday, and images of today in the same frame or in another one."""

import dataclasses

import numpy as np
import pytest

from ippon.geometry import R_BASE_CAMERA_LEVEL, make_transform, rotation_z
from ippon.mapping.config import MapConfig
from ippon.mapping.voxel_map import VoxelMap
from ippon.memory.frame_check import FrameCheck
from ippon.vocabulary import MATTERPORT_40
from tests.wall_image import wall_image

CAMERA = np.array([0.0, 0.0, 1.0])
BEYOND = np.array([[4.0, y, 1.0] for y in np.linspace(-0.5, 0.5, 200)])
AHEAD = make_transform(R_BASE_CAMERA_LEVEL, (0.0, 0.0, 1.0))


def image(stamp_s=1, T=AHEAD, depth_m=2.0):
    """An image of a wall."""
    return wall_image(depth_m, T_world_camera=T, stamp_ns=stamp_s * 10**9)


@pytest.fixture
def wall_map():
    """A map of the wall 2 m before a camera that looks along x."""
    voxel_map = VoxelMap(MapConfig(memory_limit_mb=64.0), MATTERPORT_40)
    for k in range(4):
        voxel_map.integrate(image(k + 1))
    return voxel_map


@pytest.mark.parametrize(
    ("points", "is_enough", "share"),
    [
        (BEYOND, True, 1.0),
        (BEYOND * (0.5, 1.0, 1.0), True, 0.0),
        (BEYOND * (0.25, 1.0, 1.0), True, 1.0),
        (BEYOND * (-1.0, 1.0, 1.0), False, 0.0),
        (BEYOND[:50], False, 0.0),
    ],
    ids=["through the wall", "on the wall", "in free space", "not mapped", "too few"],
)
def test_what_contradicts_the_map(wall_map, points, is_enough, share):
    check = FrameCheck(wall_map)
    check.compare(CAMERA, points)
    assert (check.is_enough, check.contradiction) == (is_enough, share)


def test_images_are_compared_from_different_views_until_enough_of_the_map_was_seen(wall_map):
    check = FrameCheck(wall_map)
    back = make_transform(rotation_z(np.pi) @ R_BASE_CAMERA_LEVEL, (0.0, 0.0, 1.0))
    for _ in range(3):
        check.add(image(T=back))
    assert (check.views, check.is_enough) == (1, False)
    check.add(image())
    assert (check.views, check.is_enough, check.contradiction) == (2, True, 0.0)


def test_the_map_is_compared_as_it_was(wall_map):
    check = FrameCheck(wall_map)
    moved = image(100, make_transform(R_BASE_CAMERA_LEVEL, (-0.6, 0.0, 1.0)))
    for k in range(8):
        wall_map.integrate(dataclasses.replace(moved, stamp_ns=(k + 100) * 10**9))
    check.add(moved)
    assert check.contradiction > 0.9, "today's wall is 0.6 m before that of yesterday"


def test_a_wrong_voxel_right_before_the_camera_contradicts_nothing(wall_map):
    check = FrameCheck(wall_map)
    wrong = dataclasses.replace(image(depth_m=0.5), T_world_camera=AHEAD)
    for k in range(8):
        wall_map.integrate(dataclasses.replace(wrong, stamp_ns=(10 + k) * 10**9))
    near = FrameCheck(wall_map)
    for one in (check, near):
        one.compare(CAMERA, BEYOND * (0.5, 1.0, 1.0))
    assert (check.contradiction, near.contradiction) == (0.0, 0.0)

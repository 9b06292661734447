"""Directions, offsets and what a camera shows of them."""

import math

import numpy as np
import pytest

from ippon.planning.visibility.view_table import build_orientations, build_view_table, in_frustum
from ippon.robot import HABITAT, ZED
from tests.reference import planning_view as reference


@pytest.fixture(scope="module")
def table():
    return build_view_table(
        yaw_bins=80,
        pitch_low=-1.5,
        pitch_high=0.87,
        range_voxels=12.0,
        layer_low=-9,
        layer_high=7,
    )


def test_every_voxel_in_range_lies_in_exactly_one_direction(table):
    offsets = {tuple(o) for o in table.offset.tolist()}
    assert len(offsets) == len(table.offset)
    reach = 12
    for x in range(-reach, reach + 1, 3):
        for y in range(-reach, reach + 1):
            for z in range(-9, 8):
                far = math.sqrt(x * x + y * y + z * z)
                inside = 0.0 < far <= 12.0 and reference.direction_of(table, (x, y, z)) is not None
                assert ((x, y, z) in offsets) == inside


def test_offsets_lie_where_their_direction_points_and_grow_outwards(table):
    for cell in range(0, len(table.start) - 1, 37):
        rows = slice(table.start[cell], table.start[cell + 1])
        assert (np.diff(table.range[rows]) >= 0.0).all()
        for offset in table.offset[rows].tolist():
            row, column = reference.direction_of(table, tuple(offset))
            assert row * table.yaw_bins + column == cell


def test_rays_are_unit_vectors_through_the_middle_of_their_cells(table):
    np.testing.assert_allclose(np.linalg.norm(table.rays, axis=1), 1.0)
    for cell in range(0, len(table.rays), 53):
        x, y, z = table.rays[cell]
        row, column = divmod(cell, table.yaw_bins)
        assert math.asin(z) == pytest.approx(table.pitch_low + (row + 0.5) * table.bin_rad)
        assert math.atan2(y, x) % (2 * math.pi) == pytest.approx((column + 0.5) * table.bin_rad)


def test_columns_share_rays_only_where_they_crowd(table):
    pitch = table.pitch_low + (np.arange(table.pitch_bins) + 0.5) * table.bin_rad
    assert (table.group[np.abs(pitch) < 0.6] == 1).all()
    assert (table.yaw_bins % table.group == 0).all()
    spacing = table.group * np.cos(pitch) * table.bin_rad
    assert (spacing <= 1.25 * table.bin_rad).all(), "never much coarser than at the horizon"


@pytest.mark.parametrize("robot", [ZED, HABITAT])
@pytest.mark.parametrize("tilt", [-1.0, -0.3, 0.0, 0.3])
def test_the_frustum_is_that_of_the_camera(table, robot, tilt):
    yaw = 0.7
    shown = in_frustum(table.rays, robot, yaw, tilt)
    rotation = robot.T_base_camera(tilt)[:3, :3]
    c, s = math.cos(-yaw), math.sin(-yaw)
    base = table.rays @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    camera = base @ rotation
    wide, high = math.tan(robot.horizontal_fov_rad / 2), math.tan(robot.vertical_fov_rad / 2)
    expected = (
        (camera[:, 2] > 0)
        & (np.abs(camera[:, 0]) <= wide * camera[:, 2])
        & (np.abs(camera[:, 1]) <= high * camera[:, 2])
    )
    assert (shown == expected).mean() > 0.999, "rounding at the rim apart"
    assert shown.any()


@pytest.mark.parametrize("robot", [ZED, HABITAT])
def test_candidate_orientations_show_the_cells_of_their_frustum(table, robot):
    orientations = build_orientations(table, robot, 4, 5)
    for b, tilt in enumerate(orientations.tilts):
        for a in (0, 7):
            shown = in_frustum(table.rays, robot, orientations.yaws[a], tilt)
            raster = shown.reshape(table.pitch_bins, table.yaw_bins)
            mask = np.zeros_like(raster)
            for row in range(table.pitch_bins):
                half = orientations.half_width[b, row]
                for d in range(-half, half + 1):
                    mask[row, (a * 4 + d) % table.yaw_bins] = True
            assert not (mask & ~raster).any()
            # An image that holds the nadir shows cells behind the robot too; those are left out.
            if tilt - robot.vertical_fov_rad / 2 > table.pitch_low:
                np.testing.assert_array_equal(mask, raster)

"""Layers, camera and lines of sight of views."""

import math

import numpy as np
import pytest

from ippon.mapping.arrays import OCCUPIED, UNKNOWN
from ippon.planning.visibility.view_config import ViewConfig
from ippon.planning.visibility.view_geometry import (
    ViewGeometry,
    ViewLayers,
    layers_at,
    ranges_for,
)
from ippon.robot import ZED

XY = np.array([1.25, 2.85])


@pytest.fixture(scope="module")
def geometry():
    layers = layers_at(ViewConfig(), ZED, 0.1, 0.0)
    ranges = ranges_for(ViewConfig(), 0.1, 1.0, math.inf)
    return ViewGeometry.build(ViewConfig(), ZED, 0.1, layers, ranges, 0.8)


@pytest.mark.parametrize("voxel_size", [0.05, 0.1])
def test_ranges_are_shorter_for_large_objects_and_for_small_ones_in_the_image(voxel_size):
    config, scale = ViewConfig(), (0.1 / voxel_size) ** 2
    small = ranges_for(config, voxel_size, 1.0 * scale, math.inf)
    large = ranges_for(config, voxel_size, 18.0 * scale, math.inf)
    assert small == (config.termination_range_m, config.surface_range_m)
    assert large == (config.large_termination_range_m, config.surface_range_m)
    assert ranges_for(config, voxel_size, scale, 2.0).surface_m == pytest.approx(1.75)
    assert ranges_for(config, voxel_size, scale, 9.0) == small


@pytest.mark.parametrize("floor_z_m", [0.0, 2.5, -0.33])
def test_layers_move_with_the_floor(floor_z_m):
    config, v = ViewConfig(), 0.1
    layers = layers_at(config, ZED, v, floor_z_m)
    assert layers.camera * v <= floor_z_m + ZED.camera_height_m < (layers.camera + 1) * v
    centres = (np.arange(layers.low, layers.high + 1) + 0.5) * v - floor_z_m
    assert (centres >= config.object_low_m - 1e-9).all()
    assert (centres <= config.band_high_m + 1e-9).all()
    assert (centres[layers.floor :] >= config.band_low_m - 1e-9).all()
    assert (centres[: layers.floor] < config.band_low_m).all()


def test_the_raster_depends_on_camera_and_band_only():
    layers = ViewLayers(camera=10, low=-1, high=19, floor=2)
    assert layers.same_raster(layers._replace(floor=0))
    assert not layers.same_raster(layers._replace(camera=11))


def test_the_camera_is_in_the_voxel_above_the_robot(geometry):
    i, j, k = geometry.camera_voxel(XY)
    assert (i, j) == (12, 28)
    assert geometry.camera_z_m == pytest.approx((k + 0.5) * 0.1)
    assert abs(geometry.camera_z_m - ZED.camera_height_m) <= 0.1


def test_a_wall_hides_what_is_behind_it_and_unknown_space_does_not(dense_map, geometry):
    volume = dense_map((8.0, 5.6, 2.4)).room((0.8, 0.8), (6.9, 4.8))
    volume.fill((5.0, 2.7, 0.6), (5.2, 2.9, 0.8), OCCUPIED, ooi=0.9)
    point = np.array([5.05, 2.85, 0.65])
    assert geometry.is_visible(XY, point, volume.arrays())
    volume.fill((3.0, 0.8, 0.0), (4.0, 4.8, 2.0), UNKNOWN)
    assert geometry.is_visible(XY, point, volume.arrays())
    volume.fill((3.0, 0.8, 0.0), (3.1, 4.8, 2.0), OCCUPIED, ooi=0.0)
    assert not geometry.is_visible(XY, point, volume.arrays())


def test_a_point_in_the_cameras_own_voxel_is_visible(dense_map, geometry):
    arrays = dense_map().room((0.8, 0.8), (5.0, 5.0)).arrays()
    assert geometry.is_visible(XY, np.array([*XY, geometry.camera_z_m]), arrays)

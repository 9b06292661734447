"""Geometry of views over one floor: layers, directions and ranges in voxels."""

import math
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from ippon.geometry import Float64Array
from ippon.mapping.arrays import MapArrays
from ippon.planning.surface_scale import surface_scale
from ippon.planning.visibility.panorama import ViewRules
from ippon.planning.visibility.rays import cast_ray
from ippon.planning.visibility.view_config import ViewConfig
from ippon.planning.visibility.view_table import (
    Orientations,
    ViewTable,
    build_orientations,
    build_view_table,
)
from ippon.robot import RobotProfile

_CLEAR_SHARE: Final = 0.875
"""Share of the depth up to which a miss is evidence, within which a surface counts as viewed."""
_RAY_TOLERANCE_VOXELS: Final = 1.8
"""A ray that ends this close to a voxel reaches it: it may hit the neighbour's face first."""


class ViewRanges(NamedTuple):
    """Ranges of a view that depend on the object of interest, metres."""

    termination_m: float
    """Horizontal range of N_T."""
    surface_m: float
    """Range within which a surface counts as viewed."""


def ranges_for(
    config: ViewConfig, voxel_size: float, termination_min: float, ooi_clear_m: float
) -> ViewRanges:
    """Return the ranges for an object of interest.

    Args:
        config: Ranges.
        voxel_size: Edge of a voxel, metres.
        termination_min: T_min, which tells large objects from small ones.
        ooi_clear_m: See `MapArrays.ooi_clear_m`.
    """
    is_large = termination_min > config.termination_fringe_voxels * surface_scale(voxel_size)
    return ViewRanges(
        config.large_termination_range_m if is_large else config.termination_range_m,
        min(config.surface_range_m, _CLEAR_SHARE * ooi_clear_m),
    )


class ViewLayers(NamedTuple):
    """Voxel layers of a view."""

    camera: int
    """Layer that holds the camera."""
    low: int
    """Lowest layer that counts."""
    high: int
    """Highest layer that counts."""
    floor: int
    """Number of layers, from `low`, in which only object voxels count."""

    def same_raster(self, other: "ViewLayers") -> bool:
        """Return whether views over both have the same directions and offsets."""
        return self[:3] == other[:3]


def layers_at(
    config: ViewConfig, robot: RobotProfile, voxel_size: float, floor_z_m: float
) -> ViewLayers:
    """Return the layers of a view from a robot on a floor of this height."""
    band_low = math.ceil((floor_z_m + config.band_low_m) / voxel_size - 0.5)
    low = min(band_low, math.ceil((floor_z_m + config.object_low_m) / voxel_size - 0.5))
    return ViewLayers(
        camera=math.floor((floor_z_m + robot.camera_height_m) / voxel_size),
        low=low,
        high=math.floor((floor_z_m + config.band_high_m) / voxel_size - 0.5),
        floor=band_low - low,
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ViewGeometry:
    """Directions, candidate orientations and rules of all views over the same layers."""

    voxel_size: float
    """Edge of a voxel, metres."""
    layers: ViewLayers
    ranges: ViewRanges
    table: ViewTable
    orientations: Orientations
    rules: ViewRules
    half_fov_columns: int
    """Half the camera's horizontal field of view, in columns of the raster."""

    @classmethod
    def build(
        cls,
        config: ViewConfig,
        robot: RobotProfile,
        voxel_size: float,
        layers: ViewLayers,
        ranges: ViewRanges,
        termination_threshold: float,
    ) -> "ViewGeometry":
        """Build the raster of directions, which takes tens of milliseconds the first time.

        Args:
            config: Ranges and resolution.
            robot: Camera and its mount.
            voxel_size: Edge of a voxel, metres.
            layers: See `layers_at`.
            ranges: See `ranges_for`.
            termination_threshold: Posterior above which a voxel counts for T(n).
        """
        half = 0.5 * robot.vertical_fov_rad
        table = build_view_table(
            yaw_bins=config.yaw_bins,
            pitch_low=max(-0.5 * math.pi, robot.min_tilt_rad - half),
            pitch_high=min(0.5 * math.pi, robot.max_tilt_rad + half),
            range_voxels=robot.max_depth_m / voxel_size,
            layer_low=layers.low - layers.camera,
            layer_high=layers.high - layers.camera,
        )
        rules = ViewRules(
            unknown_occupied=config.unknown_occupied,
            unknown_depth=config.unknown_depth_m / voxel_size,
            unknown_views=float(config.unknown_views),
            surface_views=float(config.surface_views),
            surface_range=ranges.surface_m / voxel_size,
            ooi_floor=config.ooi_floor,
            termination_threshold=termination_threshold,
            termination_range=ranges.termination_m / voxel_size,
            termination_depth=config.termination_depth_m / voxel_size,
            termination_depth_factor=config.termination_depth_factor,
            termination_depth_columns=int(config.termination_depth_angle_rad / table.bin_rad),
            termination_fringe=config.termination_fringe_voxels * surface_scale(voxel_size),
            level_range=config.level_range_m / voxel_size,
            floor_layers=layers.floor,
        )
        return cls(
            voxel_size=voxel_size,
            layers=layers,
            ranges=ranges,
            table=table,
            orientations=build_orientations(table, robot, config.heading_stride, config.tilts),
            rules=rules,
            half_fov_columns=round(0.5 * robot.horizontal_fov_rad / table.bin_rad),
        )

    @property
    def camera_z_m(self) -> float:
        """Height of the camera in the world, metres."""
        return (self.layers.camera + 0.5) * self.voxel_size

    def camera_voxel(self, xy: Float64Array) -> tuple[int, int, int]:
        """Return the voxel that holds the camera of a robot at (2,) metres."""
        x, y = float(xy[0]), float(xy[1])
        v = self.voxel_size
        return math.floor(x / v), math.floor(y / v), self.layers.camera

    def is_visible(self, xy: Float64Array, point_world: Float64Array, arrays: MapArrays) -> bool:
        """Return whether the line of sight to a point is free of known surfaces.

        Args:
            xy: (2,) position of the robot, metres.
            point_world: (3,) point in an occupied voxel, metres.
            arrays: The map.
        """
        camera = self.camera_voxel(xy)
        offset = np.floor(point_world / self.voxel_size) - np.array(camera)
        distance = float(np.linalg.norm(offset))
        if distance < 1.0:
            return True
        # The point may lie below all layers that count, for example beyond the edge of a drop.
        layers = self.table.layer_low, self.table.layer_high, int(offset[2])
        table = self.table._replace(layer_low=min(layers), layer_high=max(layers))
        depth = cast_ray(arrays, table, self.rules.unknown_depth, camera, offset / distance)
        return abs(depth) >= distance - _RAY_TOLERANCE_VOXELS

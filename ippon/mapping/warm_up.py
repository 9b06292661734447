"""Compiles the map's kernels before they are needed, step by step."""

from collections.abc import Iterator

import numpy as np

from ippon.camera import PinholeCamera
from ippon.frame import Frame, Heatmap
from ippon.geometry import R_BASE_CAMERA_LEVEL, make_transform
from ippon.mapping.map_config import MapConfig
from ippon.mapping.surface import SurfaceTracker
from ippon.mapping.voxel_map import VoxelMap


def warm_up() -> Iterator[str]:
    """Use every kernel once on a tiny map; yields what comes next, before each step."""
    voxel_map = VoxelMap(MapConfig(memory_limit_mb=64.0), ("wall", "floor"))
    yield "geometry"
    voxel_map.integrate(_frame(None))
    yield "object probabilities"
    voxel_map.set_ooi("hat")
    voxel_map.integrate(_frame("hat"))
    yield "object layers"
    voxel_map.set_ooi("floor")
    voxel_map.set_levels(np.array([0, 3], np.uint8), np.array([0.0, 0.1, 0.2, 0.5], np.float32))
    voxel_map.suppress_ooi(np.array([1.0, 0.0, 1.0]), 0.5)
    voxel_map.add_label("chair")
    yield "queries"
    points = np.array([[1.0, 0.0, 1.0]])
    voxel_map.state_at(points)
    voxel_map.gradient_at(points)
    voxel_map.spheres_are_free(points, np.array([0.2]), unknown="obstacle")
    yield "surface"
    SurfaceTracker(voxel_map).update()


def _frame(ooi: str | None) -> Frame:
    camera = PinholeCamera.from_horizontal_fov(32, 24, 1.2)
    pose = make_transform(R_BASE_CAMERA_LEVEL, (0.0, 0.0, 1.0))
    heatmap = None
    if ooi is not None:
        probabilities = np.full((24, 32, 3), 85, np.uint8)
        heatmap = Heatmap(labels=("wall", "floor"), ooi=ooi, probabilities=probabilities)
    return Frame(
        stamp_ns=0,
        color=np.zeros((24, 32, 3), np.uint8),
        depth=np.full((24, 32), 2.0, np.float32),
        camera=camera,
        T_world_camera=pose,
        T_world_base=make_transform(np.eye(3), (0.0, 0.0, 0.0)),
        tilt_rad=0.0,
        heatmap=heatmap,
    )

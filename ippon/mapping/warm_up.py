"""Compilation of the map's kernels in advance, step by step."""

import contextlib
from collections.abc import Iterator
from typing import Final

import numpy as np

from ippon.camera import PinholeCamera
from ippon.compiling import compile_in_second_process
from ippon.frame import Frame
from ippon.geometry import R_BASE_CAMERA_LEVEL, make_transform
from ippon.mapping.blocks import BlockDirectory, make_pools
from ippon.mapping.config import MapConfig
from ippon.mapping.far_evidence.far_evidence import FarEvidence, FarEvidenceConfig
from ippon.mapping.integration import FrameIntegrator
from ippon.mapping.objects.object_layers import ObjectLayers
from ippon.mapping.objects.surface_changes import SurfaceTracker
from ippon.mapping.voxel_map import VoxelMap
from ippon.observation import Heatmap

_CONFIG: Final = MapConfig(memory_limit_mb=64.0)
_LABELS: Final = ("wall", "floor")


def warm_up(*, beside: bool = False) -> Iterator[str]:
    """Call every kernel once on a tiny map; yields the name of each step before it.

    Args:
        beside: Compile part of the kernels in a second process: two thirds of the time if a core is
            free and the kernels are cached (NUMBA_CACHE_DIR).
    """
    nothing = contextlib.nullcontext()
    with compile_in_second_process(__name__, "warm_up_objects") if beside else nothing:
        voxel_map = VoxelMap(_CONFIG, _LABELS)
        yield "geometry"
        voxel_map.integrate(_frame(None))
    yield "object probabilities"
    voxel_map.set_ooi("hat")
    voxel_map.integrate(_frame("hat"))
    yield "object layers"
    voxel_map.set_ooi("floor")
    _change(voxel_map)
    yield "surface"
    SurfaceTracker(voxel_map).update()


def warm_up_objects() -> None:
    """Compile the kernels of the second process: object probabilities and surface changes."""
    frame, voxel_map = _frame("hat"), VoxelMap(_CONFIG, _LABELS)
    pools = make_pools(_CONFIG.max_blocks)
    layers = ObjectLayers(_CONFIG, _LABELS, pools)
    integrator = FrameIntegrator(_CONFIG, pools, BlockDirectory(_CONFIG.directory_max_cells))
    padded = np.pad(frame.depth, 1)
    integrator.fuse(frame, padded, (1, 1), np.empty((0, 3), np.int32), 0, layers, 1)
    voxel_map.set_ooi("floor")
    SurfaceTracker(voxel_map).update()
    _change(voxel_map)


def warm_up_far_evidence() -> None:
    """Compile the kernels of far evidence, which a search may first need after minutes."""
    far_evidence = FarEvidence(FarEvidenceConfig(), "hat", near_m=1.0)
    far_evidence.integrate(_frame("hat"))
    far_evidence.ahead(np.zeros((1, 2)), np.zeros(1), np.ones((1, 1), np.float32))


def _change(voxel_map: VoxelMap) -> None:
    """Change levels, a suppressed ball and the labels of a map."""
    voxel_map.set_levels(np.array([0, 3], np.uint8), np.array([0.0, 0.1, 0.2, 0.5], np.float32))
    voxel_map.suppress_ooi(np.array([1.0, 0.0, 1.0]), 0.5)
    voxel_map.add_label("chair")


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

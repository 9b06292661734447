"""How much of the map a painted region covers."""

import numpy as np
from scipy.spatial import KDTree

from app.messages.driving import PaintedStroke
from app.view.model.voxel_store import VoxelStore


def mapped_m2(stroke: PaintedStroke, voxels: VoxelStore, voxel_size_m: float) -> float:
    """Return the area of the map that a stroke covers, square metres; 0 where nothing is mapped.

    Args:
        stroke: The painted region.
        voxels: The map.
        voxel_size_m: Edge of a voxel.
    """
    indices, _ = voxels.all_voxels()
    if not len(indices) or not stroke.strokes:
        return 0.0
    columns = np.unique(indices[:, :2], axis=0)
    centers = (columns + 0.5) * voxel_size_m
    away, _ = KDTree(np.array(stroke.strokes)).query(centers, distance_upper_bound=stroke.radius_m)
    return float(np.isfinite(away).sum() * voxel_size_m**2)

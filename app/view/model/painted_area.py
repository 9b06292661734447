"""How much of the map painted regions cover."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from app.messages.driving import PaintedStroke
from app.view.model.voxel_store import VoxelStore


def mapped_m2(
    strokes: Sequence[PaintedStroke], voxels: VoxelStore, voxel_size_m: float
) -> list[float]:
    """Return the area of the map that each stroke covers, square metres; 0 where nothing is mapped.

    Args:
        strokes: The painted regions.
        voxels: The map, which is read once for all strokes.
        voxel_size_m: Edge of a voxel.
    """
    if not strokes:
        return []
    indices, _ = voxels.all_voxels()
    centers = (np.unique(indices[:, :2], axis=0) + 0.5) * voxel_size_m
    return [float(_count(one, centers) * voxel_size_m**2) for one in strokes]


def _count(stroke: PaintedStroke, centers: NDArray[np.floating]) -> int:
    """Return how many of (N, 2) points a stroke covers."""
    if not stroke.strokes:
        return 0
    dabs = np.array(stroke.strokes)
    low, high = dabs.min(axis=0) - stroke.radius_m, dabs.max(axis=0) + stroke.radius_m
    around = centers[((centers >= low) & (centers <= high)).all(axis=1)]
    away, _ = KDTree(dabs).query(around, distance_upper_bound=stroke.radius_m)
    return int(np.isfinite(away).sum())

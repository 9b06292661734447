"""Distance to occupied voxels by comparing every voxel with every occupied one."""

import numpy as np
from numpy.typing import NDArray


def nearest_occupied(
    occupied: NDArray[np.bool_], voxel_size: float, distance_max: float
) -> NDArray[np.float64]:
    """Return metres between voxel centres, at most `distance_max`, for a dense volume."""
    out = np.full(occupied.shape, distance_max)
    sites = np.argwhere(occupied)
    for voxel in np.ndindex(occupied.shape):
        if len(sites):
            squares = ((sites - np.array(voxel)) ** 2).sum(axis=1)
            out[voxel] = min(distance_max, voxel_size * float(np.sqrt(squares.min())))
    return out

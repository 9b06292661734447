"""Queries at points: state and distance."""

import numpy as np
from numpy.typing import NDArray

from ippon.mapping.arrays import UNKNOWN, MapArrays


def _voxels_at(
    arrays: MapArrays, points_world: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the pool rows, -1 for no block, and columns of the voxels that hold (N, 3) points."""
    points = np.asarray(points_world, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 3:
        raise ValueError(f"points are (N, 3) metres; got {points.shape}")
    if not np.isfinite(points).all():
        at = int(np.flatnonzero(~np.isfinite(points).all(axis=1))[0])
        raise ValueError(f"points are finite; point {at} of {len(points)} is {points[at]}")
    # Farther than any map, whole numbers would overflow.
    far = 1e12
    return places_of(
        arrays, np.floor(np.clip(points / arrays.voxel_size, -far, far)).astype(np.int64)
    )


def places_of(
    arrays: MapArrays, voxels: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return (M,) pool rows of (M, 3) voxels, -1 outside all blocks, and columns within them."""
    block = (voxels >> 3) - arrays.origin_block
    inside = ((block >= 0) & (block < arrays.directory.shape)).all(axis=1)
    row = np.full(len(voxels), -1, np.int64)
    row[inside] = arrays.directory[tuple(block[inside].T)]
    x, y, z = (voxels & 7).T
    return row, (x << 6) | (y << 3) | z


def state_at(arrays: MapArrays, points_world: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Return (N,) `UNKNOWN`, `FREE` or `OCCUPIED` of the voxels that hold (N, 3) finite points."""
    row, column = _voxels_at(arrays, points_world)
    known = row >= 0
    out = np.full(len(row), UNKNOWN, np.uint8)
    out[known] = arrays.state[row[known], column[known]]
    return out


def to_metres(
    squared_distance: NDArray[np.uint16], voxel_size: float, distance_max: float
) -> NDArray[np.float32]:
    """Return metres of `MapArrays.squared_distance`, at most `distance_max`."""
    voxels = np.sqrt(squared_distance.astype(np.float64))
    return np.minimum(voxels * voxel_size, distance_max).astype(np.float32)


def distance_at(
    arrays: MapArrays, points_world: NDArray[np.float64], distance_max: float
) -> NDArray[np.float32]:
    """Return the distance to obstacles of the voxels that hold some points.

    Unknown voxels are no obstacles.

    Args:
        arrays: The map.
        points_world: (N, 3) metres.
        distance_max: The field's cut-off, metres: the answer where no block is.

    Returns:
        (N,) float32 metres between voxel centres, at most `distance_max`.

    Raises:
        ValueError: The points are not (N, 3) or not finite.
    """
    row, column = _voxels_at(arrays, points_world)
    known = row >= 0
    out = np.full(len(row), distance_max, np.float32)
    squared = arrays.squared_distance[row[known], column[known]]
    out[known] = to_metres(squared, arrays.voxel_size, distance_max)
    return out

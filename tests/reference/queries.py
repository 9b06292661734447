"""Questions about points, answered one point at a time."""

import math

import numpy as np
from numpy.typing import NDArray

from ippon.mapping.arrays import UNKNOWN, MapArrays


def voxel_of(arrays: MapArrays, point: NDArray[np.float64]) -> tuple[int, int] | None:
    """Return pool row and column of the voxel that holds a point, None where no block is."""
    index = [math.floor(p / arrays.voxel_size) for p in point]
    block = [i // 8 - int(o) for i, o in zip(index, arrays.origin_block, strict=True)]
    if not all(0 <= b < n for b, n in zip(block, arrays.directory.shape, strict=True)):
        return None
    row = int(arrays.directory[tuple(block)])
    column = (index[0] % 8 * 8 + index[1] % 8) * 8 + index[2] % 8
    return None if row < 0 else (row, column)


def state(arrays: MapArrays, point: NDArray[np.float64]) -> int:
    """Return the state of the voxel that holds a point."""
    at = voxel_of(arrays, point)
    return UNKNOWN if at is None else int(arrays.state[at])


def distance(arrays: MapArrays, point: NDArray[np.float64], distance_max: float) -> float:
    """Return metres to the nearest obstacle."""
    at = voxel_of(arrays, point)
    if at is None:
        return distance_max
    return min(math.sqrt(int(arrays.squared_distance[at])) * arrays.voxel_size, distance_max)

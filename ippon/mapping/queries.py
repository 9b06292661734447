"""Queries at points: state, distance, gradient, collision of spheres."""

from typing import Literal

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ippon.mapping.arrays import UNKNOWN, MapArrays

UnknownPolicy = Literal["free", "obstacle"]


def _points(points_world: NDArray[np.float64]) -> NDArray[np.float64]:
    points = np.ascontiguousarray(points_world, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 3:
        raise ValueError(f"points are (N, 3) metres; got {points.shape}")
    if not np.isfinite(points).all():
        at = int(np.flatnonzero(~np.isfinite(points).all(axis=1))[0])
        raise ValueError(f"points are finite; point {at} of {len(points)} is {points[at]}")
    return points


def state_at(arrays: MapArrays, points_world: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Return (N,) `UNKNOWN`, `FREE` or `OCCUPIED` of the voxels that hold (N, 3) finite points."""
    # Farther than any map, whole numbers would overflow.
    far = 1e12
    voxel = np.floor(np.clip(_points(points_world) / arrays.voxel_size, -far, far)).astype(np.int64)
    block = (voxel >> 3) - arrays.origin_block
    inside = ((block >= 0) & (block < arrays.directory.shape)).all(axis=1)
    row = np.full(len(voxel), -1)
    row[inside] = arrays.directory[tuple(block[inside].T)]
    x, y, z = (voxel & 7).T
    known = row >= 0
    column = (x << 6) | (y << 3) | z
    out = np.full(len(voxel), UNKNOWN, np.uint8)
    out[known] = arrays.state[row[known], column[known]]
    return out


def to_metres(
    squared_distance: NDArray[np.uint16], voxel_size: float, distance_max: float
) -> NDArray[np.float32]:
    """Return metres of `MapArrays.squared_distance`, at most `distance_max`."""
    voxels = np.sqrt(squared_distance.astype(np.float64))
    return np.minimum(voxels * voxel_size, distance_max).astype(np.float32)


def distance_at(
    arrays: MapArrays,
    points_world: NDArray[np.float64],
    distance_max: float,
    unknown: UnknownPolicy,
) -> NDArray[np.float32]:
    """Return the distance to obstacles of the voxels that hold some points.

    Args:
        arrays: The map.
        points_world: (N, 3) metres.
        distance_max: The field's cut-off, metres: the answer where no block is.
        unknown: "free": unknown voxels are no obstacles; "obstacle": the distance of a point in an
            unknown voxel is 0.

    Returns:
        (N,) float32 metres between voxel centres, at most `distance_max`.

    Raises:
        ValueError: The points are not (N, 3) or not finite, or the policy is unknown.
    """
    if unknown not in ("free", "obstacle"):
        raise ValueError(f'unknown space is "free" or "obstacle"; got {unknown!r}')
    points = _points(points_world)
    out = np.empty(len(points), np.float32)
    _distance_kernel(arrays, points, distance_max, unknown == "obstacle", out)
    return out


def gradient_at(
    arrays: MapArrays, points_world: NDArray[np.float64], distance_max: float
) -> NDArray[np.float32]:
    """Return (N, 3) central differences of the distance field; unknown voxels are no obstacles."""
    points = _points(points_world)
    out = np.empty((len(points), 3), np.float32)
    for axis in range(3):
        step = np.zeros(3)
        step[axis] = arrays.voxel_size
        ahead = distance_at(arrays, points + step, distance_max, "free")
        back = distance_at(arrays, points - step, distance_max, "free")
        out[:, axis] = (ahead - back) / (2.0 * arrays.voxel_size)
    return out


def spheres_are_free(
    arrays: MapArrays,
    centers_world: NDArray[np.float64],
    radii_m: NDArray[np.float64],
    distance_max: float,
    unknown: UnknownPolicy,
) -> NDArray[np.bool_]:
    """Tell which spheres meet no occupied voxel.

    A voxel centre may lie half a voxel's diagonal from a point of the voxel, and so may the
    obstacle's; half a voxel edge is allowed for each, which is exact along the axes.

    Args:
        arrays: The map.
        centers_world: (N, 3) metres.
        radii_m: (N,) metres, below `distance_max` less a voxel.
        distance_max: The field's cut-off, metres.
        unknown: As in `distance_at`, for the voxel of the centre.

    Returns:
        (N,) bool.

    Raises:
        ValueError: A point is not finite, or a radius reaches beyond the cut-off of the field,
            which then cannot tell.
    """
    radii = np.asarray(radii_m, dtype=np.float64)
    if radii.size and not float(radii.max()) + arrays.voxel_size <= distance_max:
        raise ValueError(
            f"the distance field is cut off at {distance_max} m and cannot check a sphere of "
            f"{float(radii.max())} m; make MapConfig.distance_max_m larger"
        )
    distance = distance_at(arrays, centers_world, distance_max, unknown)
    return distance > radii + 0.5 * arrays.voxel_size


@njit(cache=True, nogil=True)
def _locate(arrays, x, y, z):
    """Return pool row and column of the voxel that holds a point; row -1 for none."""
    i = int(np.floor(x / arrays.voxel_size))
    j = int(np.floor(y / arrays.voxel_size))
    k = int(np.floor(z / arrays.voxel_size))
    bx = (i >> 3) - arrays.origin_block[0]
    by = (j >> 3) - arrays.origin_block[1]
    bz = (k >> 3) - arrays.origin_block[2]
    size = arrays.directory.shape
    if not (0 <= bx < size[0] and 0 <= by < size[1] and 0 <= bz < size[2]):
        return -1, 0
    return arrays.directory[bx, by, bz], ((i & 7) << 6) | ((j & 7) << 3) | (k & 7)


@njit(cache=True, nogil=True)
def _distance_kernel(arrays, points, distance_max, unknown_is_obstacle, out):
    for n in range(points.shape[0]):
        row, column = _locate(arrays, points[n, 0], points[n, 1], points[n, 2])
        known = row >= 0 and arrays.state[row, column] != UNKNOWN
        if unknown_is_obstacle and not known:
            out[n] = 0.0
        else:
            out[n] = distance_max
            if row >= 0:
                voxels = np.sqrt(np.float64(arrays.squared_distance[row, column]))
                out[n] = min(voxels * arrays.voxel_size, distance_max)

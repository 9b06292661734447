"""Picking: the first viewpoint, voxel or floor point on the ray of a click."""

from collections.abc import Callable
from typing import Final

import numpy as np
from numpy.typing import NDArray

from app.view.model.voxel_store import COLUMN, VoxelStore
from ippon.geometry import Float64Array

REACH_M: Final = 60.0
CELL: Final = 0.02
"""Cell of the depth buffer as a tangent: a voxel of 8 cm at 4 m."""
MOST_CELLS: Final = 6
_AIMS: Final = 0.5 * np.array(
    [(0, 0, 0), (1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)], np.float64
)
"""Centre of a box and of its faces, in units of its size."""
BEAD_M: Final = 0.14
"""Maximum distance of a click's ray from a viewpoint that it selects."""


def floor_point(origin: Float64Array, direction: Float64Array, floor_z_m: float) -> Float64Array:
    """Return the (3,) point where a ray meets the floor.

    Raises:
        ValueError: The ray goes up, or meets the floor too far away.
    """
    fall = float(direction[2])
    away = (floor_z_m - float(origin[2])) / fall if fall < -1e-6 else np.inf
    if not 0.0 < away * float(np.linalg.norm(direction)) < REACH_M:
        raise ValueError("the click is not on the floor; tilt the view down")
    return origin + away * direction


def nearest_viewpoint(
    origin: Float64Array, direction: Float64Array, beads: NDArray[np.floating]
) -> tuple[int, float] | None:
    """Return the index of the first of (N, 3) viewpoints on a ray, and its distance in metres."""
    if not len(beads):
        return None
    unit = direction / np.linalg.norm(direction)
    offset = beads.astype(np.float64) - origin
    along = offset @ unit
    beside = np.linalg.norm(offset - along[:, None] * unit, axis=1)
    beside[along <= 0.0] = np.inf
    hit = int(np.argmin(beside))
    return (hit, float(along[hit])) if beside[hit] <= BEAD_M else None


def first_voxel(
    origin: Float64Array,
    direction: Float64Array,
    voxel_size_m: float,
    is_shown: Callable[[tuple[int, int, int]], bool],
) -> tuple[tuple[int, int, int], float] | None:
    """Follow a ray to the first voxel that is shown.

    Args:
        origin: (3,) metres.
        direction: (3,), any length.
        voxel_size_m: Edge of a voxel.
        is_shown: Returns whether a voxel is visible.

    Returns:
        The voxel and its distance in metres; None if the ray meets nothing.
    """
    unit = direction / np.linalg.norm(direction)
    step = 0.35 * voxel_size_m
    points = origin + np.arange(0.0, REACH_M, step)[:, None] * unit
    voxels = np.floor(points / voxel_size_m).astype(np.int64)
    fresh = np.ones(len(voxels), dtype=np.bool_)
    fresh[1:] = (voxels[1:] != voxels[:-1]).any(axis=1)
    for n in np.flatnonzero(fresh):
        i, j, k = voxels[n].tolist()
        if is_shown((i, j, k)):
            return (i, j, k), float(n * step)
    return None


def is_hidden(
    store: VoxelStore,
    voxel_size_m: float,
    origin: Float64Array,
    center: Float64Array,
    size_m: Float64Array,
) -> bool:
    """Return whether surfaces are before a box on all lines to its centre and its faces' centres.

    Args:
        store: The map.
        voxel_size_m: Edge of a voxel.
        origin: (3,) metres, the eye.
        center: (3,) metres, of the box.
        size_m: (3,) metres, of the box.
    """
    aims = center + _AIMS * size_m
    toward = aims - origin
    away = np.linalg.norm(toward, axis=1)
    # The box, and what it touches, do not hide it.
    clear = away - 0.5 * float(np.linalg.norm(size_m)) - 2.0 * voxel_size_m
    if (clear <= voxel_size_m).any():
        return False
    steps = np.arange(voxel_size_m, float(clear.max()), 0.7 * voxel_size_m)
    points = origin + steps[None, :, None] * (toward / away[:, None])[:, None]
    voxels = np.floor(points / voxel_size_m).astype(np.int64)
    solid = store.holds(voxels.reshape(-1, 3)).reshape(len(aims), len(steps))
    return bool((solid & (steps < clear[:, None])).any(axis=1).all())


class SurfaceLookup:
    """Lookup of shown surface voxels; caches columns for the duration of one click."""

    def __init__(self, store: VoxelStore, below: int | None) -> None:
        self._store = store
        self._below = below
        self._columns: dict[tuple[int, int], dict[tuple[int, int, int], NDArray[np.uint8]]] = {}

    def __call__(self, voxel: tuple[int, int, int]) -> bool:
        """Return whether a voxel is surface and shown."""
        return self.attributes(voxel) is not None

    def attributes(self, voxel: tuple[int, int, int]) -> NDArray[np.uint8] | None:
        """Return the (8,) attributes of a shown surface voxel, None elsewhere."""
        i, j, k = voxel
        column = (i // COLUMN, j // COLUMN)
        known = self._columns.get(column)
        if known is None:
            local, attributes = self._store.surface(column, self._below)
            known = self._columns[column] = {
                (a, b, c): row for (a, b, c), row in zip(local.tolist(), attributes, strict=True)
            }
        return known.get((i % COLUMN, j % COLUMN, k))


def seen_from(
    store: VoxelStore,
    voxel_size_m: float,
    T_world_camera: Float64Array,
    tan_half: tuple[float, float],
    reach_m: float,
) -> NDArray[np.float32]:
    """Return the surface voxels visible to a camera.

    Args:
        store: The map.
        voxel_size_m: Edge of a voxel.
        T_world_camera: Pose; x right, y down, z forward.
        tan_half: Tangents of half the horizontal and vertical field of view.
        reach_m: Range of the camera.

    Returns:
        (M, 3) float32 centres in the world, metres.
    """
    centers = _centers_near(store, voxel_size_m, T_world_camera[:2, 3], reach_m)
    if not len(centers):
        return np.empty((0, 3), np.float32)
    local = (centers - T_world_camera[:3, 3]) @ T_world_camera[:3, :3]
    depth = local[:, 2]
    inside = (depth > 0.1) & (depth < reach_m)
    centers, local, depth = centers[inside], local[inside], depth[inside]
    u, v = local[:, 0] / depth / tan_half[0], local[:, 1] / depth / tan_half[1]
    inside = (np.abs(u) <= 1.0) & (np.abs(v) <= 1.0)
    centers, depth, u, v = centers[inside], depth[inside], u[inside], v[inside]
    nearest = _depth_buffer(depth, u * tan_half[0], v * tan_half[1], voxel_size_m)
    return centers[depth <= nearest + 1.8 * voxel_size_m].astype(np.float32)


def _depth_buffer(
    depth: Float64Array, x: Float64Array, y: Float64Array, voxel_size_m: float
) -> Float64Array:
    """Return, for each of (N,) voxels seen at tangents x and y, the least depth in front of it.

    A voxel covers all cells of its width.
    """
    if not len(depth):
        return depth
    a = np.floor(x / CELL).astype(np.int64)
    b = np.floor(y / CELL).astype(np.int64)
    a, b = a - a.min() + MOST_CELLS, b - b.min() + MOST_CELLS
    nearest = np.full((int(a.max()) + MOST_CELLS + 1, int(b.max()) + MOST_CELLS + 1), np.inf)
    reach = np.minimum(np.floor(0.5 * voxel_size_m / (CELL * depth)), MOST_CELLS).astype(np.int64)
    for da in range(-MOST_CELLS, MOST_CELLS + 1):
        for db in range(-MOST_CELLS, MOST_CELLS + 1):
            wide = reach >= max(abs(da), abs(db))
            np.minimum.at(nearest, (a[wide] + da, b[wide] + db), depth[wide])
    return nearest[a, b]


def _centers_near(
    store: VoxelStore, voxel_size_m: float, xy: Float64Array, reach_m: float
) -> Float64Array:
    edge = COLUMN * voxel_size_m
    parts: list[Float64Array] = []
    for column in store.columns:
        corner = np.array(column, dtype=np.float64) * edge
        if np.linalg.norm(corner + 0.5 * edge - xy) > reach_m + edge:
            continue
        local = store.surface(column)[0].astype(np.float64)
        if len(local):
            offset = np.array([column[0] * COLUMN, column[1] * COLUMN, 0.0])
            parts.append((local + offset + 0.5) * voxel_size_m)
    return np.concatenate(parts) if parts else np.empty((0, 3))

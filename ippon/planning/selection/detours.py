"""Ways round to what the map shows and no viewpoint comes close enough to.

The rule that ends a search asks for a place within a metre of the object. Where there seems to be
none, floor that was not seen yet may still lead there: a flood that takes unseen floor for free
tells. Where even that leads nowhere, the object is out of reach, whatever else is explored.
"""

from typing import Final, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ippon.geometry import Float64Array
from ippon.mapping.arrays import MapArrays
from ippon.planning.roadmap.sampling import mark_discs
from ippon.planning.terrain.body_limits import BodyLimits, inscribed_radius
from ippon.planning.terrain.floor_grid import (
    OBSTACLE,
    FloorGrid,
    cell_centre,
    cell_centres,
    obstacle_distance_m,
)
from ippon.planning.terrain.reachability import SLACK_CELLS, STANDABLE
from ippon.planning.visibility.viewpoints import Viewpoints

SIGHTS: Final = 6
"""Voxels of a cluster that lines of sight are drawn to."""
_TRIES: Final = 48
"""Places whose lines of sight are checked at most."""
_APART_M: Final = 0.2
"""Places that are tried lie at least this far from each other."""
_STAND_ROOM_M: Final = 0.07
"""Room beside the body where it stands to look, even after gaps were opened that leave less: those
are for passing through, and the rim of a drop is no place to stand."""
_CLOSED_M: Final = 0.35
"""Unseen floor that stays unseen is taken for blocked up to this far round the point looked at."""


class Surroundings(NamedTuple):
    """What a way is looked for on."""

    grid: FloorGrid
    limits: BodyLimits
    margin_m: float
    """Room beside the body that every move must leave."""
    reachable: NDArray[np.uint8]
    """(X, Y) from `reachable_cells`."""
    arrays: MapArrays
    views: Viewpoints

    @property
    def eye_z_m(self) -> float:
        """Height of the camera in the world, metres."""
        return self.views.eye_z_m(self.arrays)


def spread(cluster: Float64Array, most: int) -> Float64Array:
    """Return up to `most` of (M, 3) voxels, the middle one first, each far from those before."""
    away = ((cluster - cluster.mean(axis=0)) ** 2).sum(axis=1)
    chosen = [int(np.argmin(away))]
    apart = ((cluster - cluster[chosen[0]]) ** 2).sum(axis=1)
    while len(chosen) < min(most, len(cluster)):
        chosen.append(int(np.argmax(apart)))
        apart = np.minimum(apart, ((cluster - cluster[chosen[-1]]) ** 2).sum(axis=1))
    return cluster[chosen]


def way_round(
    around: Surroundings,
    cluster: Float64Array,
    closed: list[tuple[float, float]],
    reach_m: float,
    robot_xy: tuple[float, float],
) -> tuple[float, float] | None:
    """Find where unseen floor begins on the shortest way to a place close to a cluster.

    Args:
        around: Floor and map.
        cluster: (M, 3) voxel centres, metres.
        closed: Points whose surroundings were looked at and are taken for blocked.
        reach_m: A place is close to the cluster within this distance, over the floor.
        robot_xy: Where the robot stands, metres.

    Returns:
        x and y of the first cell of that way that the robot cannot be sure of, metres; None where
        no way leads close, even if all unseen floor were free.
    """
    grid = around.grid
    blocked = np.zeros(grid.kind.shape, dtype=np.uint8)
    mark_discs(blocked, grid, np.array(closed, dtype=np.float64).reshape(-1, 2), _CLOSED_M, 1)
    steps, parent = flood_unseen(around, blocked, robot_xy)
    close = np.zeros(grid.kind.shape, dtype=np.uint8)
    mark_discs(close, grid, np.ascontiguousarray(cluster[:, :2]), reach_m, 1)
    cells = np.argwhere((steps >= 0) & (close == 1) & (around.reachable == 0))
    order = np.argsort(steps[cells[:, 0], cells[:, 1]], kind="stable")
    sights = spread(cluster, SIGHTS)
    for i, j in _thinned(cells[order], grid):
        if _sees_any(around, cell_centre(grid, i, j), sights):
            return _first_unsure(around, parent, i, j)
    return None


def flood_unseen(
    around: Surroundings, blocked: NDArray[np.uint8], robot_xy: tuple[float, float]
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Flood the floor from the robot, unseen floor taken for free.

    Args:
        around: Floor and map.
        blocked: (X, Y) uint8, 1 where unseen floor is taken for blocked all the same.
        robot_xy: Where the robot stands, metres.

    Returns:
        (X, Y) int32 steps to each cell, -1 where no way leads; (X, Y) int32 cell before it on the
        way, as row * Y + column, -1 at the start.
    """
    grid = around.grid
    steps = np.full(grid.kind.shape, -1, dtype=np.int32)
    parent = np.full(grid.kind.shape, -1, dtype=np.int32)
    queue = np.empty(grid.kind.size, dtype=np.int32)
    need = (inscribed_radius(around.limits) + around.margin_m) / grid.voxel_size - SLACK_CELLS
    x, y = robot_xy
    _flood_kernel(grid, need * need, around.reachable, blocked, x, y, queue, steps, parent)
    return steps, parent


def _first_unsure(
    around: Surroundings, parent: NDArray[np.int32], i: int, j: int
) -> tuple[float, float]:
    """Follow a way back to the robot and return the unsure cell of it that is nearest to it."""
    columns, unsure = around.grid.kind.shape[1], (i, j)
    while True:
        if around.reachable[i, j] == 0:
            unsure = (i, j)
        before = int(parent[i, j])
        if before < 0:
            return cell_centre(around.grid, *unsure)
        i, j = divmod(before, columns)


def nearest_stand(
    around: Surroundings, cluster: Float64Array, enough: float
) -> tuple[Float64Array, Float64Array] | None:
    """Find the place nearest to a cluster where the robot can stand and see it.

    Args:
        around: Floor and map.
        cluster: (M, 3) voxel centres, metres.
        enough: Voxels that must be in sight.

    Returns:
        The place (2,) and a voxel (3,) in sight; None where none sees enough.
    """
    grid = around.grid
    cells = np.argwhere(around.reachable == STANDABLE)
    cells = cells[obstacle_distance_m(grid, cells) >= around.limits.radius + _STAND_ROOM_M]
    if not len(cells):
        return None
    places = cell_centres(grid, cells)
    away = np.full(len(places), np.inf)
    for voxel in np.unique(cluster[:, :2], axis=0):
        np.minimum(away, np.hypot(*(places - voxel).T), out=away)
    sample = spread(cluster, 4 * SIGHTS)
    for i, j in _thinned(cells[np.argsort(away, kind="stable")], grid):
        place = np.array(cell_centre(grid, i, j))
        seen = [v for v in sample if around.views.sees(place, v, around.arrays)]
        if len(seen) * len(cluster) > enough * len(sample):
            return place, seen[0]
    return None


def _thinned(cells: NDArray[np.int64], grid: FloorGrid) -> list[tuple[int, int]]:
    """Return the first cells of (N, 2), leaving out those close to one before."""
    kept: list[tuple[int, int]] = []
    apart = _APART_M / grid.voxel_size
    for i, j in cells.tolist():
        if all((i - a) ** 2 + (j - b) ** 2 >= apart * apart for a, b in kept):
            kept.append((i, j))
            if len(kept) == _TRIES:
                break
    return kept


def _sees_any(around: Surroundings, xy: tuple[float, float], voxels: Float64Array) -> bool:
    place = np.array(xy)
    return any(around.views.sees(place, voxel, around.arrays) for voxel in voxels)


@njit(cache=True, nogil=True)
def _flood_kernel(grid, room, reachable, blocked, x, y, queue, steps, parent):
    nx, ny = steps.shape
    fx = x / grid.voxel_size - grid.origin[0] - 0.5
    fy = y / grid.voxel_size - grid.origin[1] - 0.5
    reach = 0.5 / grid.voxel_size
    head, tail = 0, 0
    for i in range(max(0, int(fx - reach)), min(nx, int(fx + reach) + 2)):
        for j in range(max(0, int(fy - reach)), min(ny, int(fy + reach) + 2)):
            if (i - fx) ** 2 + (j - fy) ** 2 <= reach * reach and reachable[i, j]:
                steps[i, j] = 0
                queue[tail] = i * ny + j
                tail += 1
    while head < tail:
        i, j = queue[head] // ny, queue[head] % ny
        head += 1
        for n in range(4):
            a = i + (1 if n == 0 else -1 if n == 1 else 0)
            b = j + (1 if n == 2 else -1 if n == 3 else 0)
            if a < 0 or b < 0 or a >= nx or b >= ny or steps[a, b] >= 0:
                continue
            if not reachable[a, b]:
                if grid.kind[a, b] == OBSTACLE or blocked[a, b]:
                    continue
                di, dj = int(grid.obstacle[a, b, 0]), int(grid.obstacle[a, b, 1])
                if di * di + dj * dj < room:
                    continue
            steps[a, b] = steps[i, j] + 1
            parent[a, b] = i * ny + j
            queue[tail] = a * ny + b
            tail += 1

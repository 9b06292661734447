"""Detours over unseen floor to an object that no viewpoint is close enough to.

A search ends at a place within a metre of the object. Where none is known, unseen floor may still
lead to one. A flood fill that treats unseen floor as free finds that out; where it reaches no such
place either, the object is out of reach.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ippon.compiling import njit
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
from ippon.planning.visibility.view_geometry import ViewGeometry


@dataclass(frozen=True, slots=True, kw_only=True)
class DetourConfig:
    """How places close to an object are searched for."""

    max_places: int = 48
    """Places whose lines of sight are checked at most; more finds places in narrower views and
    takes longer."""
    place_spacing_m: float = 0.2
    """Least distance between such places; more covers more floor with the same number."""
    stand_room_m: float = 0.07
    """Free space beside the body where it stands to look, also after narrower gaps were opened for
    passing through; more keeps farther from the edge of a drop."""
    closed_radius_m: float = 0.35
    """Unseen floor that stays unseen counts as blocked within this radius of the point looked at;
    more gives up a detour sooner."""

    def __post_init__(self) -> None:
        """Reject a search without places."""
        if self.max_places < 1 or self.place_spacing_m < 0.0:
            raise ValueError(
                "max_places must be at least 1 and place_spacing_m at least 0; got "
                f"{self.max_places}, {self.place_spacing_m}"
            )


class Surroundings(NamedTuple):
    """Floor, body and map for a search for detours and lines of sight."""

    grid: FloorGrid
    limits: BodyLimits
    margin_m: float
    """Free space beside the body that every move must leave, metres."""
    reachable: NDArray[np.uint8]
    """(X, Y) from `reachable_cells`."""
    arrays: MapArrays
    geometry: ViewGeometry

    @property
    def camera_z_m(self) -> float:
        """Height of the camera in the world, metres."""
        return self.geometry.camera_z_m

    def is_visible(self, xy: Float64Array, point_world: Float64Array) -> bool:
        """Return whether a robot at (2,) sees a (3,) point; see `ViewGeometry.is_visible`."""
        return self.geometry.is_visible(xy, point_world, self.arrays)


def farthest_point_sample(cluster: Float64Array, most: int) -> Float64Array:
    """Return up to `most` of (M, 3) voxels: the one at the centre, then the farthest from those."""
    away = ((cluster - cluster.mean(axis=0)) ** 2).sum(axis=1)
    chosen = [int(np.argmin(away))]
    apart = ((cluster - cluster[chosen[0]]) ** 2).sum(axis=1)
    while len(chosen) < min(most, len(cluster)):
        chosen.append(int(np.argmax(apart)))
        apart = np.minimum(apart, ((cluster - cluster[chosen[-1]]) ** 2).sum(axis=1))
    return cluster[chosen]


def find_detour(
    config: DetourConfig,
    around: Surroundings,
    cluster: Float64Array,
    closed: list[tuple[float, float]],
    reach_m: float,
    robot_xy: tuple[float, float],
    sight_points: int,
) -> tuple[float, float] | None:
    """Find where unseen floor begins on the shortest detour to a place close to a cluster.

    Args:
        config: Which places are tried.
        around: Floor and map.
        cluster: (M, 3) voxel centres, metres.
        closed: Points of unseen floor that count as blocked.
        reach_m: A place is close to the cluster within this distance over the floor.
        robot_xy: Position of the robot, metres.
        sight_points: Voxels of the cluster that lines of sight are checked to.

    Returns:
        x and y of the first cell of the detour that is not known to be free, metres; None if no
        detour leads close, even over unseen floor.
    """
    grid = around.grid
    blocked = np.zeros(grid.kind.shape, dtype=np.uint8)
    mark_discs(
        blocked, grid, np.array(closed, dtype=np.float64).reshape(-1, 2), config.closed_radius_m, 1
    )
    steps, parent = flood_fill_unseen(around, blocked, robot_xy)
    close = np.zeros(grid.kind.shape, dtype=np.uint8)
    mark_discs(close, grid, np.ascontiguousarray(cluster[:, :2]), reach_m, 1)
    cells = np.argwhere((steps >= 0) & (close == 1) & (around.reachable == 0))
    order = np.argsort(steps[cells[:, 0], cells[:, 1]], kind="stable")
    sights = farthest_point_sample(cluster, sight_points)
    for i, j in _spaced(config, cells[order], grid):
        if _sees_any(around, cell_centre(grid, i, j), sights):
            return _first_unknown(around, parent, i, j)
    return None


def flood_fill_unseen(
    around: Surroundings, blocked: NDArray[np.uint8], robot_xy: tuple[float, float]
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Flood the floor from the robot; unseen floor counts as free.

    Args:
        around: Floor and map.
        blocked: (X, Y) uint8, 1 where unseen floor counts as blocked.
        robot_xy: Position of the robot, metres.

    Returns:
        (X, Y) int32 steps to each cell, -1 where the flood does not lead; (X, Y) int32 cell before
        it, as row * Y + column, -1 at the start.
    """
    grid = around.grid
    steps = np.full(grid.kind.shape, -1, dtype=np.int32)
    parent = np.full(grid.kind.shape, -1, dtype=np.int32)
    queue = np.empty(grid.kind.size, dtype=np.int32)
    need = (inscribed_radius(around.limits) + around.margin_m) / grid.voxel_size - SLACK_CELLS
    x, y = robot_xy
    _flood_kernel(grid, need * need, around.reachable, blocked, x, y, queue, steps, parent)
    return steps, parent


def _first_unknown(
    around: Surroundings, parent: NDArray[np.int32], i: int, j: int
) -> tuple[float, float]:
    """Return the centre of the detour's first cell that is not known to be reachable."""
    columns, unknown = around.grid.kind.shape[1], (i, j)
    while True:
        if around.reachable[i, j] == 0:
            unknown = (i, j)
        before = int(parent[i, j])
        if before < 0:
            return cell_centre(around.grid, *unknown)
        i, j = divmod(before, columns)


def nearest_viewing_position(
    config: DetourConfig,
    around: Surroundings,
    cluster: Float64Array,
    enough: float,
    sight_points: int,
) -> tuple[Float64Array, Float64Array] | None:
    """Find the place nearest to a cluster where the robot can stand and see it.

    Args:
        config: Which places are tried.
        around: Floor and map.
        cluster: (M, 3) voxel centres, metres.
        enough: Voxels that must be visible.
        sight_points: See `find_detour`; four times as many are checked here.

    Returns:
        The place (2,) and a visible voxel (3,), metres; None if enough is visible from no place.
    """
    grid = around.grid
    cells = np.argwhere(around.reachable == STANDABLE)
    cells = cells[obstacle_distance_m(grid, cells) >= around.limits.radius + config.stand_room_m]
    if not len(cells):
        return None
    places = cell_centres(grid, cells)
    away = np.full(len(places), np.inf)
    for voxel in np.unique(cluster[:, :2], axis=0):
        np.minimum(away, np.hypot(*(places - voxel).T), out=away)
    sample = farthest_point_sample(cluster, 4 * sight_points)
    for i, j in _spaced(config, cells[np.argsort(away, kind="stable")], grid):
        place = np.array(cell_centre(grid, i, j))
        seen = [v for v in sample if around.is_visible(place, v)]
        if len(seen) * len(cluster) > enough * len(sample):
            return place, seen[0]
    return None


def is_standable(around: Surroundings, place: Float64Array) -> bool:
    """Return whether the robot can stand at a place (2,) that it gets to."""
    cell = np.floor(place / around.grid.voxel_size).astype(np.int64) - around.grid.origin
    if (cell < 0).any() or (cell >= around.reachable.shape).any():
        # The map has dropped its blocks.
        return False
    return bool(around.reachable[cell[0], cell[1]] == STANDABLE)


def _spaced(
    config: DetourConfig, cells: NDArray[np.int64], grid: FloorGrid
) -> list[tuple[int, int]]:
    """Return the first of (N, 2) cells, without those too close to an earlier one."""
    kept: list[tuple[int, int]] = []
    apart = config.place_spacing_m / grid.voxel_size
    for i, j in cells.tolist():
        if all((i - a) ** 2 + (j - b) ** 2 >= apart * apart for a, b in kept):
            kept.append((i, j))
            if len(kept) == config.max_places:
                break
    return kept


def _sees_any(around: Surroundings, xy: tuple[float, float], voxels: Float64Array) -> bool:
    place = np.array(xy)
    return any(around.is_visible(place, voxel) for voxel in voxels)


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

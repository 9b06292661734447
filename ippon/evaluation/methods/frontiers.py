"""Quickest paths over the known floor, and its frontiers."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from skimage import graph

from ippon.geometry import Float64Array
from ippon.planning.terrain.floor_grid import (
    OBSTACLE,
    OPEN,
    UNSEEN,
    FloorGrid,
    cell_centre,
    offset_distance_cells,
)
from ippon.planning.terrain.motion_check import move_between
from ippon.planning.terrain.reachability import SLACK_CELLS
from ippon.planning.terrain.traversability import Traversability

_ndimage: Any = ndimage
_graph: Any = graph
"""Untyped, because neither library declares its return types."""

_BEGIN_WITHIN_M = 0.5
"""Distance to the free cells from which a robot too close to an obstacle starts."""


class FloorRoutes:
    """Quickest paths from the robot to every reachable cell of the known floor.

    Cells near obstacles take longer, as for the paper's planner, so that methods differ only in
    their targets.
    """

    def __init__(self, floor: Traversability, x: float, y: float) -> None:
        """Compute the paths for a robot at (x, y) metres; `floor` must be up to date."""
        self._floor = floor
        self._here = np.array([x, y])
        limits = floor.limits
        self.reachable = self._flood()
        """(X, Y) cells that the robot can reach."""
        self.time_s = np.full(self.reachable.shape, np.inf)
        """(X, Y) travel time in seconds, infinite without a path."""
        self._paths: Any = None
        if self.reachable.any():
            self._search(limits.slow_clearance, limits.slow_fraction, limits.speed)

    @property
    def grid(self) -> FloorGrid:
        """The floor grid of the paths."""
        return self._floor.grid

    def nearest_cell(self, x: float, y: float, within_m: float) -> tuple[int, int] | None:
        """Return the reachable cell nearest to a point, None if none is within `within_m`."""
        cells = np.argwhere(np.isfinite(self.time_s))
        if len(cells) == 0:
            return None
        v = self.grid.voxel_size
        centres = (cells + self.grid.origin + 0.5) * v
        apart = np.hypot(centres[:, 0] - x, centres[:, 1] - y)
        best = int(np.argmin(apart))
        if apart[best] > within_m:
            return None
        return int(cells[best, 0]), int(cells[best, 1])

    def path_to(self, cell: tuple[int, int]) -> Float64Array:
        """Return the (K, 2) corners of the path to a reachable cell, the robot's position first."""
        cells = np.array(self._paths.traceback(cell), dtype=np.int64)
        points = (cells + self.grid.origin + 0.5) * self.grid.voxel_size
        corners = np.vstack([self._here, points[1:] if len(points) > 1 else points])
        return self._straighten(corners.astype(np.float64))

    def _flood(self) -> NDArray[np.bool_]:
        """Return the cells connected to the robot with room for the body.

        A gap may have room for the body between cell centres but at none of them; the clearance may
        therefore fall short by 0.4 of a cell, as in the paper's planner.
        """
        grid, limits = self.grid, self._floor.limits
        room = offset_distance_cells(grid.obstacle)
        seen = offset_distance_cells(grid.unseen) * grid.voxel_size >= limits.unseen_radius
        needed = (limits.radius + self._floor.margin_m) / grid.voxel_size - SLACK_CELLS
        numbers, _ = _ndimage.label((grid.kind == OPEN) & seen & (room >= needed))
        cells = np.argwhere(numbers > 0)
        centres = (cells + grid.origin + 0.5) * grid.voxel_size
        near = cells[((centres - self._here) ** 2).sum(axis=1) <= _BEGIN_WITHIN_M**2]
        return np.isin(numbers, np.unique(numbers[near[:, 0], near[:, 1]])) & (numbers > 0)

    def _search(self, slow_clearance: float, slow_fraction: float, speed: float) -> None:
        grid = self.grid
        room = offset_distance_cells(grid.obstacle) * grid.voxel_size
        beside = np.clip((room - self._floor.limits.radius) / slow_clearance, 0.0, 1.0)
        speeds = speed * (slow_fraction + (1.0 - slow_fraction) * beside)
        costs = np.where(self.reachable, grid.voxel_size / speeds, -1.0)
        cells = np.argwhere(self.reachable)
        centres = (cells + grid.origin + 0.5) * grid.voxel_size
        start = cells[int(np.argmin(((centres - self._here) ** 2).sum(axis=1)))]
        self._paths = _graph.MCP_Geometric(costs)
        times, _ = self._paths.find_costs([tuple(start.tolist())])
        self.time_s = np.where(self.reachable, times, np.inf)

    def _straighten(self, path: Float64Array) -> Float64Array:
        """Shorten the grid's staircase wherever the straight move takes no longer."""
        grid, limits, margin = self.grid, self._floor.limits, self._floor.margin_m
        out, at = [path[0]], 0
        while at < len(path) - 1:
            best, spent = at + 1, 0.0
            leave = self._floor.clearance(path[0, 0], path[0, 1]) if at == 0 else np.inf
            for to in range(at + 1, len(path)):
                _, step_s, _ = move_between(grid, limits, path[to - 1], path[to], margin, leave)
                spent += step_s
                free, time_s, _ = move_between(grid, limits, path[at], path[to], margin, leave)
                if free and time_s <= 1.02 * spent + 1e-9:
                    best = to
            out.append(path[best])
            at = best
        return np.array(out)


@dataclass(frozen=True, slots=True, kw_only=True)
class Frontier:
    """A boundary between known and unknown floor."""

    position: tuple[float, float]
    """Its centre, metres."""
    yaw_rad: float
    """Direction of the unknown floor."""
    cell: tuple[int, int]
    """Reachable cell from which to view it."""
    time_s: float
    """Travel time, seconds."""
    length_m: float


def find_frontiers(
    routes: FloorRoutes, *, min_length_m: float = 0.5, within_m: float = 0.8
) -> tuple[Frontier, ...]:
    """Return the boundaries of the known floor (Yamauchi 1997).

    Args:
        routes: The floor and the paths over it.
        min_length_m: Shorter boundaries are slits between objects.
        within_m: Frontiers farther from every reachable cell are behind obstacles.
    """
    grid = routes.grid
    opened = (grid.kind == OPEN) | routes.reachable
    unseen = grid.kind == UNSEEN
    beside = np.zeros_like(opened)
    normal = np.zeros((*opened.shape, 2))
    for axis, step in ((0, 1), (0, -1), (1, 1), (1, -1)):
        shifted = np.roll(unseen, -step, axis=axis)
        edge = [slice(None), slice(None)]
        edge[axis] = slice(-1, None) if step > 0 else slice(0, 1)
        # Cells that `roll` wraps around are outside the map and unknown.
        shifted[tuple(edge)] = True
        beside |= shifted
        normal[..., axis] += step * shifted
    rim = opened & beside & (grid.kind != OBSTACLE)
    if not rim.any() or not np.isfinite(routes.time_s).any():
        return ()
    numbers, count = _ndimage.label(rim, structure=np.ones((3, 3)))
    away, nearest = _ndimage.distance_transform_edt(
        ~np.isfinite(routes.time_s), return_indices=True
    )
    found: list[Frontier] = []
    for k in range(1, int(count) + 1):
        cells = np.argwhere(numbers == k)
        if len(cells) * grid.voxel_size < min_length_m:
            continue
        frontier = _frontier(routes, cells, normal, away, nearest, within_m)
        if frontier is not None:
            found.append(frontier)
    return tuple(found)


def _frontier(
    routes: FloorRoutes,
    cells: NDArray[np.int64],
    normal: Float64Array,
    away: Float64Array,
    nearest: NDArray[np.int32],
    within_m: float,
) -> Frontier | None:
    """Return the frontier of a connected boundary, None if its centre cannot be approached."""
    grid = routes.grid
    middle = cells[int(np.argmin(((cells - cells.mean(axis=0)) ** 2).sum(axis=1)))]
    i, j = int(middle[0]), int(middle[1])
    if away[i, j] * grid.voxel_size > within_m:
        return None
    cell = (int(nearest[0, i, j]), int(nearest[1, i, j]))
    towards = normal[cells[:, 0], cells[:, 1]].sum(axis=0)
    if not towards.any():
        towards = middle - np.array(cell)
    return Frontier(
        position=cell_centre(grid, i, j),
        yaw_rad=float(np.arctan2(towards[1], towards[0])),
        cell=cell,
        time_s=float(routes.time_s[cell]),
        length_m=len(cells) * grid.voxel_size,
    )

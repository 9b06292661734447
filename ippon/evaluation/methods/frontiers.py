"""Ways over the floor that the robot knows, and where that floor ends."""

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
"""Untyped on purpose: neither library says what its functions return."""

_BEGIN_WITHIN_M = 0.5
"""A robot that stands too close to something begins on the free cells within this of it."""


class FloorRoutes:
    """Quickest ways from the robot to every cell that it can reach, over the floor as it is known.

    Cells take longer where the body passes close to something, as for the paper's planner, so that
    methods differ in where they go and not in how.
    """

    def __init__(self, floor: Traversability, x: float, y: float) -> None:
        """Find them for a robot at (x, y) metres; `floor` must be up to date."""
        self._floor = floor
        self._here = np.array([x, y])
        limits = floor.limits
        self.reachable = self._flood()
        """(X, Y) cells where the robot could stand."""
        self.time_s = np.full(self.reachable.shape, np.inf)
        """(X, Y) seconds to get there, infinite where there is no way."""
        self._paths: Any = None
        if self.reachable.any():
            self._search(limits.slow_clearance, limits.slow_fraction, limits.speed)

    @property
    def grid(self) -> FloorGrid:
        """The floor that the ways lead over."""
        return self._floor.grid

    def nearest_cell(self, x: float, y: float, within_m: float) -> tuple[int, int] | None:
        """Return the reachable cell nearest to a point, None when none is near enough."""
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
        """Return the (K, 2) corners of the way to a reachable cell, the robot's place first."""
        cells = np.array(self._paths.traceback(cell), dtype=np.int64)
        points = (cells + self.grid.origin + 0.5) * self.grid.voxel_size
        corners = np.vstack([self._here, points[1:] if len(points) > 1 else points])
        return self._straighten(corners.astype(np.float64))

    def _flood(self) -> NDArray[np.bool_]:
        """Return the cells that are joined to the robot and leave the body room.

        A gap may have room for the body between the centres of cells but on none of them, so a
        cell may miss the room by 0.4 of its edge, as the paper's planner allows.
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
        """Cut corners of the grid's staircase wherever the straight move takes no longer."""
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
    """A run of seen floor beside unseen floor."""

    position: tuple[float, float]
    """Its middle, metres."""
    yaw_rad: float
    """Direction in which the unseen floor lies."""
    cell: tuple[int, int]
    """Reachable cell from which to look over it."""
    time_s: float
    """Seconds to get there."""
    length_m: float


def find_frontiers(
    routes: FloorRoutes, *, min_length_m: float = 0.5, within_m: float = 0.8
) -> tuple[Frontier, ...]:
    """Find where the known floor ends in the unknown (Yamauchi 1997).

    Args:
        routes: The floor, and ways over it.
        min_length_m: Shorter runs are slits between things.
        within_m: A frontier farther from every reachable cell lies behind something.
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
        # What `roll` wraps round lies beyond the map, where nothing was seen.
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
    """Describe one run of cells, None when the robot cannot get near its middle."""
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

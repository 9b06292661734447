"""Shortest path lengths over the floor, any-angle."""

import math

import numpy as np
from numpy.typing import NDArray

from ippon.planning.taut_paths import is_straight, taut_field
from ippon.simulation.robot.navigation_grid import NavigationGrid

_SNAP_M = 0.3
"""Distance outside the free cells at which a position still counts, as when the base touches a
wall."""


class GeodesicField:
    """Distance over free floor from any position to the nearest of some targets."""

    def __init__(self, grid: NavigationGrid, sources: NDArray[np.float64]) -> None:
        """Compute the field.

        Args:
            grid: Where the body fits.
            sources: (N, 2) targets in metres; those where the body does not fit are ignored.
        """
        self._grid = grid
        cells = np.array(
            [c for x, y in sources.tolist() if (c := _free_cell(grid, x, y)) is not None],
            dtype=np.int64,
        ).reshape(-1, 2)
        distance, self._corner = taut_field(grid.free, cells)
        self._distance = distance * grid.cell_m

    @property
    def distance_m(self) -> NDArray[np.float64]:
        """(X, Y) metres from each cell's centre, infinite without a path."""
        return self._distance

    def distance_from(self, x: float, y: float) -> float:
        """Return the distance from a point in metres, infinite without a path.

        A point slightly outside the free cells counts from the nearest free cell.
        """
        grid = self._grid
        i, j = grid.cell_at(x, y)
        best = math.inf
        if grid.contains(i, j) and grid.free[i, j]:
            for a in range(i - 1, i + 2):
                for b in range(j - 1, j + 2):
                    if grid.contains(a, b) and np.isfinite(self._distance[a, b]):
                        best = min(best, self._by_corner(x, y, a, b))
            return best
        cell = grid.nearest_free(x, y, _SNAP_M)
        if cell is None:
            return math.inf
        px, py = grid.point_at(*cell)
        return math.hypot(px - x, py - y) + float(self._distance[cell])

    def path_from(self, x: float, y: float) -> NDArray[np.float64]:
        """Return the (K, 2) corners of the shortest path from a point; K = 0 for none.

        A point slightly outside the free cells starts at the nearest free cell.
        """
        grid = self._grid
        cell = grid.nearest_free(x, y, _SNAP_M)
        if cell is None or not np.isfinite(self._distance[cell]):
            return np.empty((0, 2))
        corners = [(x, y)]
        here = cell
        u, v = (x - grid.origin[0]) / grid.cell_m, (y - grid.origin[1]) / grid.cell_m
        ahead = (int(self._corner[cell][0]), int(self._corner[cell][1]))
        if not is_straight(grid.free, u, v, float(ahead[0]), float(ahead[1])):
            corners.append(grid.point_at(*cell))
        while here != ahead:
            corners.append(grid.point_at(*ahead))
            here, ahead = ahead, (int(self._corner[ahead][0]), int(self._corner[ahead][1]))
        if len(corners) == 1:
            corners.append(grid.point_at(*cell))
        return np.array(corners, dtype=np.float64)

    def _by_corner(self, x: float, y: float, a: int, b: int) -> float:
        """Return the length of the path through the last corner of a cell's path."""
        grid = self._grid
        ca, cb = int(self._corner[a, b, 0]), int(self._corner[a, b, 1])
        px, py = grid.point_at(ca, cb)
        u, v = (x - grid.origin[0]) / grid.cell_m, (y - grid.origin[1]) / grid.cell_m
        if not is_straight(grid.free, u, v, float(ca), float(cb)):
            px, py = grid.point_at(a, b)
            return math.hypot(px - x, py - y) + float(self._distance[a, b])
        return math.hypot(px - x, py - y) + float(self._distance[ca, cb])


def _free_cell(grid: NavigationGrid, x: float, y: float) -> tuple[int, int] | None:
    i, j = grid.cell_at(x, y)
    return (i, j) if grid.contains(i, j) and grid.free[i, j] else None

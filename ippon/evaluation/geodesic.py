"""Shortest path lengths over the floor, any-angle."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ippon.simulation.robot.navigation_grid import NavigationGrid

_SNAP_M = 0.3
"""Distance outside the free cells at which a position still counts, as when the base touches a
wall."""


class GeodesicField:
    """Distance over free floor from any position to the nearest of some targets.

    Lazy Theta* (Nash, Koenig and Tovey 2010) without heuristic: each cell stores the last corner of
    its path, and paths are straight wherever possible, so that their lengths are those of a taut
    string around the obstacles, not of steps in eight directions.
    """

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
        self._distance = np.full(grid.free.shape, np.inf)
        self._corner = np.full((*grid.free.shape, 2), -1, np.int32)
        if len(cells):
            heap_cost = np.empty(8 * grid.free.size + len(cells))
            heap_cell = np.empty(8 * grid.free.size + len(cells), np.int64)
            _field_kernel(grid.free, cells, self._distance, self._corner, heap_cost, heap_cell)
            self._distance *= grid.cell_m

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
        if not _is_straight_kernel(grid.free, u, v, float(ahead[0]), float(ahead[1])):
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
        if not _is_straight_kernel(grid.free, u, v, float(ca), float(cb)):
            px, py = grid.point_at(a, b)
            return math.hypot(px - x, py - y) + float(self._distance[a, b])
        return math.hypot(px - x, py - y) + float(self._distance[ca, cb])


def _free_cell(grid: NavigationGrid, x: float, y: float) -> tuple[int, int] | None:
    i, j = grid.cell_at(x, y)
    return (i, j) if grid.contains(i, j) and grid.free[i, j] else None


@njit(cache=True, nogil=True)
def _is_straight_kernel(free, u0, v0, u1, v1):
    """Tell whether the segment between two points, in cells, stays on free cells."""
    i, j = int(np.floor(u0 + 0.5)), int(np.floor(v0 + 0.5))
    i1, j1 = int(np.floor(u1 + 0.5)), int(np.floor(v1 + 0.5))
    du, dv = u1 - u0, v1 - v0
    step_i = 1 if du > 0.0 else -1
    step_j = 1 if dv > 0.0 else -1
    # Shares of the segment to the next border of a cell, and from border to border.
    tu = ((i + 0.5 * step_i) - u0) / du if du != 0.0 else np.inf
    tv = ((j + 0.5 * step_j) - v0) / dv if dv != 0.0 else np.inf
    delta_u = abs(1.0 / du) if du != 0.0 else np.inf
    delta_v = abs(1.0 / dv) if dv != 0.0 else np.inf
    while True:
        if i < 0 or j < 0 or i >= free.shape[0] or j >= free.shape[1] or not free[i, j]:
            return False
        if i == i1 and j == j1:
            return True
        if abs(tu - tv) < 1e-9:
            # Through a corner: blocked if both adjacent cells are blocked.
            if not free[i + step_i, j] and not free[i, j + step_j]:
                return False
            i += step_i
            j += step_j
            tu += delta_u
            tv += delta_v
        elif tu < tv:
            i += step_i
            tu += delta_u
        else:
            j += step_j
            tv += delta_v
        if min(tu, tv) > 1.0 + 1e-9 and not (i == i1 and j == j1):
            return i >= 0 and j >= 0 and i < free.shape[0] and j < free.shape[1] and free[i, j]


@njit(cache=True, nogil=True)
def _push_kernel(cost, cell, count, c, k):
    """Add an entry to a binary heap; return the new number of entries."""
    n = count
    while n > 0:
        parent = (n - 1) // 2
        if cost[parent] <= c:
            break
        cost[n], cell[n] = cost[parent], cell[parent]
        n = parent
    cost[n], cell[n] = c, k
    return count + 1


@njit(cache=True, nogil=True)
def _pop_kernel(cost, cell, count):
    """Move the cheapest entry of a binary heap to its last place."""
    c, k = cost[0], cell[0]
    last = count - 1
    x, y = cost[last], cell[last]
    n = 0
    while True:
        child = 2 * n + 1
        if child >= last:
            break
        if child + 1 < last and cost[child + 1] < cost[child]:
            child += 1
        if cost[child] >= x:
            break
        cost[n], cell[n] = cost[child], cell[child]
        n = child
    cost[n], cell[n] = x, y
    cost[last], cell[last] = c, k
    return last


@njit(cache=True, nogil=True)
def _field_kernel(free, sources, distance, corner, heap_cost, heap_cell):
    """Fill `distance`, in cells, and `corner` outwards from the sources."""
    nx, ny = free.shape
    done = np.zeros((nx, ny), np.bool_)
    count = 0
    for s in range(len(sources)):
        i, j = sources[s, 0], sources[s, 1]
        distance[i, j] = 0.0
        corner[i, j, 0], corner[i, j, 1] = i, j
        count = _push_kernel(heap_cost, heap_cell, count, 0.0, i * ny + j)
    while count > 0:
        count = _pop_kernel(heap_cost, heap_cell, count)
        i, j = heap_cell[count] // ny, heap_cell[count] % ny
        if done[i, j]:
            continue
        done[i, j] = True
        ci, cj = corner[i, j, 0], corner[i, j, 1]
        # The corner was inherited from a neighbour without a visibility test. Test it now, and the
        # corners of the other neighbours, which may give a shorter path around an obstacle.
        best = distance[i, j]
        if not _is_straight_kernel(free, float(i), float(j), float(ci), float(cj)):
            best = np.inf
        for a in range(max(i - 1, 0), min(i + 2, nx)):
            for b in range(max(j - 1, 0), min(j + 2, ny)):
                if not done[a, b] or (a == i and b == j):
                    continue
                if free[i, b] or free[a, j]:
                    d = distance[a, b] + math.hypot(a - i, b - j)
                    if d < best - 1e-12:
                        best, ci, cj = d, a, b
                p, q = corner[a, b, 0], corner[a, b, 1]
                d = distance[p, q] + math.hypot(p - i, q - j)
                if d < best - 1e-12 and _is_straight_kernel(
                    free, float(i), float(j), float(p), float(q)
                ):
                    best, ci, cj = d, p, q
        corner[i, j, 0], corner[i, j, 1] = ci, cj
        distance[i, j] = best
        base = distance[ci, cj]
        for a in range(max(i - 1, 0), min(i + 2, nx)):
            for b in range(max(j - 1, 0), min(j + 2, ny)):
                if done[a, b] or not free[a, b] or not (free[i, b] or free[a, j]):
                    continue
                d = base + math.hypot(a - ci, b - cj)
                if d < distance[a, b] - 1e-12:
                    distance[a, b] = d
                    corner[a, b, 0], corner[a, b, 1] = ci, cj
                    count = _push_kernel(heap_cost, heap_cell, count, d, a * ny + b)

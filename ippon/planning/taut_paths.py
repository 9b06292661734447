"""Shortest path lengths over free cells, any-angle.

Lazy Theta* (Nash, Koenig and Tovey 2010) without heuristic: each cell stores the last corner of its
path, and paths are straight wherever possible, so that their lengths are those of a taut string
around the obstacles, not of steps in eight directions.
"""

import math

import numpy as np
from numpy.typing import NDArray

from ippon.compiling import njit
from ippon.geometry import Float64Array


def taut_field(
    free: NDArray[np.bool_], sources: NDArray[np.int64]
) -> tuple[Float64Array, NDArray[np.int32]]:
    """Return the distance of every cell to the nearest source.

    Args:
        free: (X, Y) cells that paths may cross.
        sources: (N, 2) free cells.

    Returns:
        (X, Y) float64 in cells, infinite without a path; (X, Y, 2) int32, the last corner of the
        path to each cell, -1 without one.
    """
    distance = np.full(free.shape, np.inf)
    corner = np.full((*free.shape, 2), -1, np.int32)
    if len(sources):
        heap_cost = np.empty(8 * free.size + len(sources))
        heap_cell = np.empty(8 * free.size + len(sources), np.int64)
        _field_kernel(free, sources, distance, corner, heap_cost, heap_cell)
    return distance, corner


@njit(cache=True, nogil=True)
def is_straight(free, u0, v0, u1, v1):
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


@njit(allocates=True, cache=True, nogil=True)
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
        if not is_straight(free, float(i), float(j), float(ci), float(cj)):
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
                if d < best - 1e-12 and is_straight(free, float(i), float(j), float(p), float(q)):
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

"""Unseen floor on the straight line to a target: a detour may exist only because of it."""

import math
from typing import Final

import numpy as np

from ippon.compiling import njit
from ippon.geometry import Float64Array
from ippon.planning.terrain.body_limits import BodyLimits, inscribed_radius
from ippon.planning.terrain.clearance import clearance_at
from ippon.planning.terrain.floor_grid import UNSEEN, FloorGrid

_STEPS_PER_CELL: Final = 2.0


def unseen_shortcut_m(
    grid: FloorGrid, limits: BodyLimits, margin_m: float, path: Float64Array
) -> float:
    """Return the length of unseen floor on the straight line to a path's end.

    Args:
        grid: The floor.
        limits: Size of the body.
        margin_m: Free space beside the body that a move must leave.
        path: (K, 2) world x and y from the robot to its target, metres.

    Returns:
        Metres; 0 without a path, if all floor was seen, or if an obstacle blocks the line.
    """
    if not len(path):
        return 0.0
    start, end = path[0], path[-1]
    away = math.dist(start, end)
    steps = max(1, math.ceil(_STEPS_PER_CELL * away / grid.voxel_size))
    points = start + np.linspace(0.0, 1.0, steps + 1)[:, None] * (end - start)
    unseen = _count_unseen_kernel(grid, points, inscribed_radius(limits) + margin_m)
    return max(0, unseen) * away / steps


@njit(cache=True, nogil=True)
def _count_unseen_kernel(grid, points, room):
    """Return the number of points on unseen floor; -1 if one is too close to an obstacle."""
    unseen = 0
    for n in range(points.shape[0]):
        x, y = points[n, 0], points[n, 1]
        i = int(np.floor(x / grid.voxel_size)) - grid.origin[0]
        j = int(np.floor(y / grid.voxel_size)) - grid.origin[1]
        # The clearance is interpolated from four cells, which border cells do not have.
        if i < 1 or j < 1 or i + 1 >= grid.kind.shape[0] or j + 1 >= grid.kind.shape[1]:
            unseen += 1
            continue
        # At its start the robot may be closer to obstacles than any move may come.
        begun = np.hypot(x - points[0, 0], y - points[0, 1]) > 0.5 * room
        if begun and clearance_at(grid, x, y) < room:
            return -1
        unseen += grid.kind[i, j] == UNSEEN
    return unseen

"""Clearance of points and of the body on the floor grid, exact below a cell."""

import math

from ippon.compiling import njit
from ippon.planning.terrain.body_limits import BodyLimits
from ippon.planning.terrain.floor_grid import BEYOND_CUTOFF, FloorGrid


@njit(cache=True, nogil=True)
def clearance_at(grid: FloorGrid, x: float, y: float) -> float:
    """Return the distance from a point to the centre of the nearest obstacle cell.

    The distance is measured from the point itself to the nearest obstacles of the four cells around
    it, so it is exact below a cell. Metres; at most the cut-off; 0 outside the grid.
    """
    fx = x / grid.voxel_size - grid.origin[0] - 0.5
    fy = y / grid.voxel_size - grid.origin[1] - 0.5
    i, j = math.floor(fx), math.floor(fy)
    if i < 0 or j < 0 or i + 1 >= grid.kind.shape[0] or j + 1 >= grid.kind.shape[1]:
        return 0.0
    best = float(grid.cutoff) * grid.cutoff
    for a in range(i, i + 2):
        for b in range(j, j + 2):
            if grid.obstacle[a, b, 0] == BEYOND_CUTOFF:
                continue
            dx = a + grid.obstacle[a, b, 0] - fx
            dy = b + grid.obstacle[a, b, 1] - fy
            best = min(best, dx * dx + dy * dy)
    return math.sqrt(best) * grid.voxel_size


@njit(cache=True, nogil=True)
def seen_around(grid: FloorGrid, x: float, y: float, radius: float) -> bool:
    """Return whether no unseen cell lies within `radius` metres of the cell that holds a point."""
    i = math.floor(x / grid.voxel_size) - grid.origin[0]
    j = math.floor(y / grid.voxel_size) - grid.origin[1]
    if i < 0 or j < 0 or i >= grid.kind.shape[0] or j >= grid.kind.shape[1]:
        return False
    di, dj = grid.unseen[i, j, 0], grid.unseen[i, j, 1]
    if di == BEYOND_CUTOFF:
        return True
    reach = radius / grid.voxel_size
    return di * di + dj * dj >= reach * reach


@njit(cache=True, nogil=True)
def clearance_at_pose(grid: FloorGrid, limits: BodyLimits, x: float, y: float, yaw: float) -> float:
    """Return the clearance of the body at a pose, stated as that of a round body.

    Returns:
        Metres: the distance to an obstacle from the centre of a round body of `limits.radius` with
        the same free space beside it.
    """
    if limits.discs.shape[0] == 0:
        return clearance_at(grid, x, y)
    c, s = math.cos(yaw), math.sin(yaw)
    least = math.inf
    for disc in limits.discs:
        room = clearance_at(grid, x + c * disc[0] - s * disc[1], y + s * disc[0] + c * disc[1])
        least = min(least, room - disc[2])
    return least + limits.radius


@njit(cache=True, nogil=True)
def seen_at_pose(grid: FloorGrid, limits: BodyLimits, x: float, y: float, yaw: float) -> bool:
    """Return whether the body at a pose covers no unseen floor, apart from the allowed overlap."""
    if limits.discs.shape[0] == 0:
        return seen_around(grid, x, y, limits.unseen_radius)
    c, s = math.cos(yaw), math.sin(yaw)
    for disc in limits.discs:
        px, py = x + c * disc[0] - s * disc[1], y + s * disc[0] + c * disc[1]
        if not seen_around(grid, px, py, disc[3]):
            return False
    return True

"""The floor cells that the robot can reach from where it stands."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from ippon.compiling import njit
from ippon.planning.terrain.body_limits import BodyLimits, inscribed_radius, inscribed_unseen_radius
from ippon.planning.terrain.floor_grid import OPEN, FloorGrid

PASSED: Final = 1
"""The flood went through, but the body can neither stand nor turn with the full margin."""
STANDABLE: Final = 2
"""The body can stand and turn with the full margin."""
SLACK_CELLS: Final = 0.4
"""How far the clearance at a cell centre may miss the margin, in cells: a gap may be wide enough
between two cell centres."""


def reachable_cells(
    grid: FloorGrid, limits: BodyLimits, x: float, y: float, margin: float, comfort: float
) -> NDArray[np.uint8]:
    """Flood the floor from the robot.

    The flood runs over cells whose clearance misses the margin by up to `SLACK_CELLS`; motion
    checks, which are exact below a cell, decide whether a gap can be passed. It begins at all such
    cells within 0.5 m of the robot, so that a robot close to an obstacle is not cut off.

    Returns:
        (X, Y) uint8: `STANDABLE` where the robot can stand and turn with `margin` plus `comfort`
        metres beside the body, `PASSED` where the flood only went through, 0 elsewhere.
    """
    out = np.zeros(grid.kind.shape, dtype=np.uint8)
    queue = np.empty((grid.kind.size, 2), dtype=np.int32)
    _flood_kernel(grid, limits, x, y, margin, comfort, queue, out)
    return out


@njit(cache=True, nogil=True)
def _passable(grid, limits, i, j, margin, comfort):
    if grid.kind[i, j] != OPEN:
        return 0
    need = inscribed_unseen_radius(limits) / grid.voxel_size
    di, dj = int(grid.unseen[i, j, 0]), int(grid.unseen[i, j, 1])
    seen = di * di + dj * dj
    if seen < need * need:
        return 0
    di, dj = int(grid.obstacle[i, j, 0]), int(grid.obstacle[i, j, 1])
    room = di * di + dj * dj
    if room >= ((limits.radius + margin + comfort) / grid.voxel_size) ** 2 and (
        seen >= (limits.unseen_radius / grid.voxel_size) ** 2
    ):
        return STANDABLE
    need = (inscribed_radius(limits) + margin) / grid.voxel_size
    return PASSED if room >= (need - SLACK_CELLS) ** 2 else 0


@njit(cache=True, nogil=True)
def _flood_kernel(grid, limits, x, y, margin, comfort, queue, out):
    nx, ny = out.shape
    fx = x / grid.voxel_size - grid.origin[0] - 0.5
    fy = y / grid.voxel_size - grid.origin[1] - 0.5
    reach = 0.5 / grid.voxel_size
    head, tail = 0, 0
    for i in range(max(0, int(fx - reach)), min(nx, int(fx + reach) + 2)):
        for j in range(max(0, int(fy - reach)), min(ny, int(fy + reach) + 2)):
            if (i - fx) ** 2 + (j - fy) ** 2 > reach * reach:
                continue
            out[i, j] = _passable(grid, limits, i, j, margin, comfort)
            if out[i, j]:
                queue[tail, 0], queue[tail, 1] = i, j
                tail += 1
    while head < tail:
        i, j = queue[head, 0], queue[head, 1]
        head += 1
        for n in range(4):
            a = i + (1 if n == 0 else -1 if n == 1 else 0)
            b = j + (1 if n == 2 else -1 if n == 3 else 0)
            if a < 0 or b < 0 or a >= nx or b >= ny or out[a, b]:
                continue
            out[a, b] = _passable(grid, limits, a, b, margin, comfort)
            if out[a, b]:
                queue[tail, 0], queue[tail, 1] = a, b
                tail += 1

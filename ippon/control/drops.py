"""Drops near the robot: where the map shows that the floor ends, and what is hidden beside them."""

import math

import numpy as np

from ippon.compiling import njit
from ippon.geometry import Float64Array, yaw_of
from ippon.mapping.arrays import MapArrays
from ippon.planning.terrain.obstacle_columns import (
    DROP_COLUMNS,
    FLOOR_ABSENT,
    FLOOR_SEEN,
    HeightBands,
    floor_of_column,
    height_tolerance_m,
)
from ippon.robot import RobotProfile, disc_centres

NOWHERE: Float64Array = np.zeros((0, 2))
"""No points."""
_HIDDEN_M = 0.5
"""How far from a drop floor that no image has shown counts as hidden. A ray over an edge leaves the
floor's band behind it: by its depth times the distance over the camera's height, 0.15 to 0.45 m."""
_STANDS_IN_ONE = -1
_REACHED = 16
"""Bit: a column of a drop, or one that is hidden beside it."""


def drops_around(
    arrays: MapArrays,
    robot: RobotProfile,
    T_world_base: Float64Array,
    radius_m: float,
    floor_z_m: float | None = None,
    *,
    hidden: bool = False,
) -> tuple[Float64Array, Float64Array]:
    """List the columns in which the map shows that the floor ends, and what is hidden beside them.

    A robot that stands in the middle of a drop is not at the height that the map has there, so its
    drops are not believed.

    Args:
        arrays: The map.
        robot: Its body and step height.
        T_world_base: Pose of the robot.
        radius_m: Radius of the search around it.
        floor_z_m: Height at which the planner has read the floor, if it has: both see the same
            drops, as long as the robot is on that floor.
        hidden: Whether to list hidden columns.

    Returns:
        (M, 2) float64 world x and y of the centres of drops, metres, and (H, 2) of columns between
        them and the floor that was seen, whose own floor was not. Those under the body count as
        seen: it stands on them.
    """
    v = arrays.voxel_size
    x, y, z = T_world_base[:3, 3].tolist()
    if floor_z_m is not None and abs(floor_z_m - z) <= height_tolerance_m(robot, v):
        z = floor_z_m
    bands = HeightBands.of(robot, z, v)
    steps = math.ceil(_HIDDEN_M / v) if hidden else 0
    side = 2 * (math.ceil(radius_m / v) + steps) + 5
    floor = np.empty((side, side), dtype=np.uint8)
    drops = np.empty((side * side, 2), dtype=np.float64)
    low, high = bands.floor_low, bands.floor_high
    count = _drops_kernel(arrays, x, y, radius_m, low, high, floor, drops)
    if count == _STANDS_IN_ONE:
        return NOWHERE, NOWHERE
    if not hidden:
        return drops[:count], NOWHERE
    discs = np.array(robot.outline)
    discs[:, :2] = disc_centres(robot.outline, np.array([[x, y, yaw_of(T_world_base)]]))[0]
    queue = np.empty((side * side, 3), dtype=np.int32)
    beside = np.empty((side * side, 2), dtype=np.float64)
    found = _hidden_kernel(v, x, y, radius_m, discs, steps, floor, queue, beside)
    return drops[:count], beside[:found]


@njit(cache=True, nogil=True)
def _drops_kernel(arrays, x, y, radius, low, high, floor, out):
    v, side = arrays.voxel_size, floor.shape[0]
    middle = side // 2
    i0, j0 = math.floor(x / v) - middle, math.floor(y / v) - middle
    some = False
    for a in range(side):
        for b in range(side):
            floor[a, b] = floor_of_column(arrays, i0 + a, j0 + b, low, high)
            some = some or floor[a, b] == FLOOR_ABSENT
    count = 0
    if not some:
        return count
    for a in range(1, side - 1):
        for b in range(1, side - 1):
            columns = 0
            for c in range(a - 1, a + 2):
                for d in range(b - 1, b + 2):
                    columns += 1 if floor[c, d] & FLOOR_ABSENT else 0
            if columns < DROP_COLUMNS:
                continue
            if a == middle and b == middle and columns == 9:
                return _STANDS_IN_ONE
            floor[a, b] |= _REACHED
            cx, cy = (i0 + a + 0.5) * v, (j0 + b + 0.5) * v
            if (cx - x) ** 2 + (cy - y) ** 2 <= radius * radius:
                out[count, 0], out[count, 1] = cx, cy
                count += 1
    return count


@njit(cache=True, nogil=True)
def _hidden_kernel(v, x, y, radius, discs, steps, floor, queue, out):
    side = floor.shape[0]
    middle = side // 2
    i0, j0 = math.floor(x / v) - middle, math.floor(y / v) - middle
    tail = 0
    for a in range(side):
        for b in range(side):
            # Not from floor that was seen: the column before an edge, which counts as the drop's.
            if floor[a, b] & _REACHED and not floor[a, b] & FLOOR_SEEN:
                queue[tail, 0], queue[tail, 1], queue[tail, 2] = a, b, 0
                tail += 1
    head, count = 0, 0
    while head < tail:
        a, b, step = queue[head, 0], queue[head, 1], queue[head, 2]
        head += 1
        if step == steps:
            continue
        for c in range(max(0, a - 1), min(side, a + 2)):
            for d in range(max(0, b - 1), min(side, b + 2)):
                if floor[c, d] & (FLOOR_SEEN | _REACHED):
                    continue
                cx, cy = (i0 + c + 0.5) * v, (j0 + d + 0.5) * v
                stands = False
                for k in range(discs.shape[0]):
                    apart = (cx - discs[k, 0]) ** 2 + (cy - discs[k, 1]) ** 2
                    stands = stands or apart <= discs[k, 2] ** 2
                if stands:
                    continue
                known = floor[c, d] & FLOOR_ABSENT
                floor[c, d] |= _REACHED
                queue[tail, 0], queue[tail, 1], queue[tail, 2] = c, d, step + 1
                tail += 1
                if not known and (cx - x) ** 2 + (cy - y) ** 2 <= radius * radius:
                    out[count, 0], out[count, 1] = cx, cy
                    count += 1
    return count

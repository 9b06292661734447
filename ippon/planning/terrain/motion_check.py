"""Collision checks of the body on the floor grid: standing, turning and straight moves."""

import math
from typing import Final

from numba import njit

from ippon.geometry import Float64Array
from ippon.planning.terrain.body_limits import BodyLimits, inscribed_unseen_radius, speed_at
from ippon.planning.terrain.clearance import (
    clearance_at,
    clearance_at_pose,
    seen_around,
    seen_at_pose,
)
from ippon.planning.terrain.floor_grid import FloorGrid

_TURN_STEP_RAD: Final = 0.1
"""Headings of a turn that are checked lie so far apart: 5 cm at the end of a metre."""


@njit(cache=True, nogil=True)
def can_turn(
    grid: FloorGrid,
    limits: BodyLimits,
    x: float,
    y: float,
    start: float,
    end: float,
    margin: float,
    leave_from: float,
) -> bool:
    """Tell whether the body can turn on the spot.

    Where it stands now the floor that it turns over must have been seen; elsewhere it will have
    been, by the time that the robot is there.

    Args:
        grid: The floor.
        limits: The body.
        x: Where it stands, metres; likewise y.
        y: See x.
        start: Heading at first, radians.
        end: Heading in the end; it turns the shorter way.
        margin: Room to leave beside the body, metres.
        leave_from: See `straight_move`.
    """
    needed = limits.radius + margin
    here = leave_from < 1e6
    if limits.discs.shape[0] == 0 or (
        clearance_at(grid, x, y) >= needed
        and (not here or seen_around(grid, x, y, limits.unseen_radius))
    ):
        return True
    turn = (end - start + math.pi) % (2.0 * math.pi) - math.pi
    count = max(1, math.ceil(abs(turn) / _TURN_STEP_RAD))
    for n in range(1, count + 1):
        yaw = start + n / count * turn
        if clearance_at_pose(grid, limits, x, y, yaw) < min(needed, leave_from - 0.01):
            return False
        if here and not seen_at_pose(grid, limits, x, y, yaw):
            return False
    return True


def can_stand(grid: FloorGrid, limits: BodyLimits, point: Float64Array, margin: float) -> bool:
    """Tell whether the body fits at a (2,) point and can turn, with `margin` metres to spare.

    Of a long one that means that nothing is known to be in the way: of the floor that it turns over
    only the middle must have been seen.
    """
    return can_stand_at(grid, limits, float(point[0]), float(point[1]), margin)


@njit(cache=True, nogil=True)
def can_stand_at(grid: FloorGrid, limits: BodyLimits, x: float, y: float, margin: float) -> bool:
    """Tell what `can_stand` does."""
    return clearance_at(grid, x, y) >= limits.radius + margin and seen_around(
        grid, x, y, inscribed_unseen_radius(limits)
    )


def move_between(
    grid: FloorGrid,
    limits: BodyLimits,
    start: Float64Array,
    end: Float64Array,
    margin: float,
    leave_from: float = math.inf,
) -> tuple[bool, float, float]:
    """Check and measure a straight move between two (2,) points; see `straight_move`."""
    return straight_move(
        grid,
        limits,
        float(start[0]),
        float(start[1]),
        float(end[0]),
        float(end[1]),
        margin,
        leave_from,
    )


@njit(cache=True, nogil=True)
def straight_move(
    grid: FloorGrid,
    limits: BodyLimits,
    x0: float,
    y0: float,
    x1: float,
    y1: float,
    margin: float,
    leave_from: float,
) -> tuple[bool, float, float]:
    """Check a straight move and measure it; turns at its ends are for `can_turn`.

    Args:
        grid: The floor.
        limits: The body.
        x0: Start, metres; likewise y0, x1, y1.
        y0: See x0.
        x1: See x0.
        y1: See x0.
        margin: Room to leave beside the body, metres.
        leave_from: Clearance at the start when the robot stands there now: a robot that stands
            too close to something may leave if it gets farther away. Infinite elsewhere.

    Returns:
        Whether it is free; its travel time in seconds; its integral of one over the room beside
        the body.
    """
    length = math.hypot(x1 - x0, y1 - y0)
    count = max(1, math.ceil(length / (0.5 * grid.voxel_size)))
    needed = limits.radius + margin
    heading = math.atan2(y1 - y0, x1 - x0)
    time, crowding = 0.0, 0.0
    for n in range(count + 1):
        t = n / count
        x, y = x0 + t * (x1 - x0), y0 + t * (y1 - y0)
        room = clearance_at_pose(grid, limits, x, y, heading)
        # 1 cm of grace: rounding must not pin a robot that stands exactly at the limit.
        if room < min(needed, leave_from - 0.01 + 0.5 * t * length):
            return False, 0.0, 0.0
        if not seen_at_pose(grid, limits, x, y, heading) and (
            leave_from > 1e6 or t * length > 0.5 * limits.radius
        ):
            return False, 0.0, 0.0
        weight = (0.5 if n in (0, count) else 1.0) * length / count
        beside = room - limits.radius
        time += weight / speed_at(limits, beside)
        crowding += weight / max(beside, 0.5 * grid.voxel_size)
    return True, time, crowding

"""Collision checks of the body on the floor grid: standing, turning and straight moves."""

import math
from typing import Final

from ippon.compiling import njit
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
"""Step between the headings of a turn that are checked: 5 cm at half a metre from the centre."""


@njit(cache=True, nogil=True)
def can_turn(
    grid: FloorGrid,
    limits: BodyLimits,
    x: float,
    y: float,
    start: float,
    end: float,
    margin: float,
    start_clearance: float,
) -> bool:
    """Return whether the body can turn on the spot.

    At the robot's present position the floor below the turn must have been seen; elsewhere it will
    have been seen by the time the robot gets there.

    Args:
        grid: The floor.
        limits: The body.
        x: Position, metres; likewise y.
        y: See x.
        start: First heading, radians.
        end: Last heading, radians; the body turns through the smaller angle.
        margin: Free space to leave beside the body, metres.
        start_clearance: See `straight_move`.
    """
    needed = limits.radius + margin
    here = start_clearance < 1e6
    if limits.discs.shape[0] == 0 or (
        clearance_at(grid, x, y) >= needed
        and (not here or seen_around(grid, x, y, limits.unseen_radius))
    ):
        return True
    turn = (end - start + math.pi) % (2.0 * math.pi) - math.pi
    count = max(1, math.ceil(abs(turn) / _TURN_STEP_RAD))
    for n in range(1, count + 1):
        yaw = start + n / count * turn
        if clearance_at_pose(grid, limits, x, y, yaw) < min(needed, start_clearance - 0.01):
            return False
        if here and not seen_at_pose(grid, limits, x, y, yaw):
            return False
    return True


@njit(cache=True, nogil=True)
def free_turn(
    grid: FloorGrid,
    limits: BodyLimits,
    x: float,
    y: float,
    yaw: float,
    margin: float,
    start_clearance: float,
) -> tuple[float, float]:
    """Return how far the body can turn from a heading to the right and to the left, radians.

    See `can_turn` for the arguments, of which `yaw` is the heading. Half a turn where nothing is in
    the way.
    """
    right = _free_turn(grid, limits, x, y, yaw, -1.0, margin, start_clearance)
    left = _free_turn(grid, limits, x, y, yaw, 1.0, margin, start_clearance)
    return right, left


@njit(cache=True, nogil=True)
def _free_turn(grid, limits, x, y, yaw, sign, margin, start_clearance):
    turned = 0.0
    while turned < math.pi:
        more = min(turned + _TURN_STEP_RAD, math.pi)
        end = yaw + sign * more
        if not can_turn(grid, limits, x, y, end, end, margin, start_clearance):
            break
        turned = more
    return turned


def can_stand(grid: FloorGrid, limits: BodyLimits, point: Float64Array, margin: float) -> bool:
    """Return whether the body fits at a (2,) point and can turn, with `margin` metres to spare.

    For a long body no known obstacle may be in the way of the turn, but only the middle of the
    floor below the turn must have been seen.
    """
    return can_stand_at(grid, limits, float(point[0]), float(point[1]), margin)


@njit(cache=True, nogil=True)
def can_stand_at(grid: FloorGrid, limits: BodyLimits, x: float, y: float, margin: float) -> bool:
    """Return what `can_stand` returns, for coordinates."""
    return clearance_at(grid, x, y) >= limits.radius + margin and seen_around(
        grid, x, y, inscribed_unseen_radius(limits)
    )


def move_between(
    grid: FloorGrid,
    limits: BodyLimits,
    start: Float64Array,
    end: Float64Array,
    margin: float,
    start_clearance: float = math.inf,
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
        start_clearance,
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
    start_clearance: float,
) -> tuple[bool, float, float]:
    """Check and measure a straight move; `can_turn` checks the turns at its ends.

    Args:
        grid: The floor.
        limits: The body.
        x0: Start, metres; likewise y0, x1, y1.
        y0: See x0.
        x1: See x0.
        y1: See x0.
        margin: Free space to leave beside the body, metres.
        start_clearance: Clearance at the start if the robot stands there now: a robot that is too
            close to an obstacle may move away from it. Infinite elsewhere.

    Returns:
        Whether it is free; its travel time in seconds; the integral of the inverse free space
        beside the body.
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
        # 1 cm of tolerance: rounding must not block a robot that stands exactly at the limit.
        if room < min(needed, start_clearance - 0.01 + 0.5 * t * length):
            return False, 0.0, 0.0
        if not seen_at_pose(grid, limits, x, y, heading) and (
            start_clearance > 1e6 or t * length > 0.5 * limits.radius
        ):
            return False, 0.0, 0.0
        weight = (0.5 if n in (0, count) else 1.0) * length / count
        beside = room - limits.radius
        time += weight / speed_at(limits, beside)
        crowding += weight / max(beside, 0.5 * grid.voxel_size)
    return True, time, crowding

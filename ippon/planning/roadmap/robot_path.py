"""Paths that begin at the robot: feasibility from its heading, travel time, and shortcuts.

A long body may lack the space to turn from its heading to the direction of a path.
"""

import math
from itertools import pairwise
from typing import Final

import numpy as np

from ippon.geometry import Float64Array
from ippon.planning.deadline import UNLIMITED, Deadline
from ippon.planning.roadmap.roadmap import turning_time
from ippon.planning.terrain.motion_check import move_between
from ippon.planning.terrain.traversability import Traversability
from ippon.robot import RobotProfile

AT_NODE_M: Final = 0.15
"""A robot this close to a node counts as standing on it and does not turn towards it; see also
`PathFollower`."""
SHORTCUT_M: Final = 10.0
"""Longest stretch of a path that a shortcut replaces: the work grows with its square."""


def drive_time(
    path: Float64Array, floor: Traversability, robot: RobotProfile, margin: float, yaw: float
) -> float | None:
    """Return the travel time of a path in seconds, turns at its inner points included.

    A long body without space to turn where it stands may drive the first piece backwards.

    Args:
        path: (K, 2) from the robot on, metres.
        floor: What it leads over.
        robot: Speed, turn rate, and whether it drives backwards.
        margin: Free space to leave beside the body, metres.
        yaw: The robot's heading, radians.

    Returns:
        None if the body cannot drive a piece, or cannot turn from one piece to the next.
    """
    total = 0.0
    can_back = robot.can_reverse and len(floor.limits.discs) > 0
    start_clearance = floor.clearance_at_pose(path[0, 0], path[0, 1], yaw)
    for n, (a, b) in enumerate(pairwise(path)):
        free, time, _ = move_between(floor.grid, floor.limits, a, b, margin, start_clearance)
        backs = n == 0 and can_back
        if not free or not (
            can_face(floor, a, yaw, b, start_clearance, margin)
            or (backs and can_face(floor, a, yaw + math.pi, b, start_clearance, margin))
        ):
            return None
        total += time
        start_clearance, yaw = math.inf, math.atan2(b[1] - a[1], b[0] - a[0])
    return total + turning_time(path, robot.max_yaw_rate_rad_s)


def can_face(
    floor: Traversability,
    here: Float64Array,
    yaw: float,
    there: Float64Array,
    start_clearance: float,
    margin: float | None = None,
) -> bool:
    """Return whether the body can turn towards a point; within `AT_NODE_M` it need not turn.

    Args:
        floor: What it turns over.
        here: (2,) where it stands, metres.
        yaw: Its heading, radians.
        there: (2,) metres.
        start_clearance: See `straight_move`.
        margin: Free space to leave beside the body, metres; None for the margin of every move.
    """
    step = there - here
    if not len(floor.limits.discs) or math.hypot(step[0], step[1]) <= AT_NODE_M:
        return True
    margin = floor.margin_m if margin is None else margin
    return floor.can_turn(here, yaw, math.atan2(step[1], step[0]), margin, start_clearance)


def shorten_path(
    path: Float64Array, floor: Traversability, yaw: float, deadline: Deadline = UNLIMITED
) -> Float64Array:
    """Cut corners of a path wherever that takes less time, from its start.

    Args:
        path: (K, 2) from the robot on, metres.
        floor: What it leads over.
        yaw: The robot's heading, radians.
        deadline: Once it has passed, the rest of the path stays as it is.

    Returns:
        (L, 2) with the same ends, L at most K.
    """
    grid, limits, margin = floor.grid, floor.limits, floor.margin_m
    out, at = [path[0]], 0
    while at < len(path) - 1:
        if 0 < at < len(path) - 2 and deadline.passed():
            return np.vstack([*out, path[at + 1 :]])
        best = at + 1
        spent = length = 0.0
        start_clearance = (
            floor.clearance_at_pose(path[0, 0], path[0, 1], yaw) if at == 0 else math.inf
        )
        for to in range(at + 1, len(path)):
            free, time, _ = move_between(
                grid, limits, path[to - 1], path[to], margin, start_clearance
            )
            spent += time if free else math.inf
            length += math.dist(path[to - 1], path[to])
            if to == at + 1:
                continue
            if length > SHORTCUT_M:
                break
            free, time, _ = move_between(
                grid, limits, path[at], path[to], margin + floor.config.comfort_m, start_clearance
            )
            if free and time <= spent and can_face(floor, path[at], yaw, path[to], start_clearance):
                best = to
        out.append(path[best])
        yaw = math.atan2(path[best][1] - path[at][1], path[best][0] - path[at][0])
        at = best
    return np.array(out)

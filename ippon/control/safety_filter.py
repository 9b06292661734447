"""The safety filter: slows or stops commands that would drive the body into obstacle or drop."""

import math
from dataclasses import replace

import numpy as np

from ippon.command import Command
from ippon.control.obstacles import (
    OVERLAP_TOLERANCE_M,
    Hazards,
    body_clearance,
    hazards_around,
)
from ippon.frame import Frame
from ippon.geometry import Float64Array, yaw_of
from ippon.mapping.arrays import MapArrays
from ippon.robot import RobotProfile

_SHARES = (0.75, 0.5, 0.3, 0.15)
"""Shares of a command that are tried, the largest first."""


def filter_command(
    command: Command,
    T_world_base: Float64Array,
    robot: RobotProfile,
    map_arrays: MapArrays,
    horizon_s: float,
    frame: Frame | None = None,
    floor_z_m: float | None = None,
) -> tuple[Command, str | None]:
    """Scale a command down until the robot can execute it and still stop in time.

    The body is checked along the command's arc for the horizon plus its braking distance, and along
    the way that it takes if linear and yaw rate brake independently. A robot that is too close to
    an obstacle already may move as long as it gets no closer to it. Linear and yaw rate are scaled
    together, so that the arc is unchanged; if no part of it is free, turning in place is tried.

    Args:
        command: The requested command.
        T_world_base: Pose of the robot.
        robot: Its body and limits.
        map_arrays: The map; unknown space is no obstacle here.
        horizon_s: Longest time until the next command, seconds.
        frame: The newest image, whose obstacles may not be in the map yet; None if there is none.
        floor_z_m: See `drops_around`.

    Returns:
        The safe command, and the reason if it differs from the requested one, else None.
    """
    reach_m = checked_reach_m(robot, abs(command.linear_m_s), horizon_s)
    hazards = hazards_around(map_arrays, robot, T_world_base, reach_m, frame, floor_z_m)
    return filter_among_hazards(command, T_world_base, robot, hazards, horizon_s)


def checked_reach_m(robot: RobotProfile, speed_m_s: float, horizon_s: float) -> float:
    """Return the radius in which obstacles matter to a command with a speed and a horizon."""
    braking_s = speed_m_s / robot.max_linear_acceleration_m_s2
    return robot.radius_m + speed_m_s * (horizon_s + braking_s) + 0.3


def filter_among_hazards(
    command: Command,
    T_world_base: Float64Array,
    robot: RobotProfile,
    hazards: Hazards,
    horizon_s: float,
    margin_m: float = -OVERLAP_TOLERANCE_M,
    slack_m: float = 0.002,
) -> tuple[Command, str | None]:
    """Scale a command down among given obstacles; see `filter_command`.

    Args:
        command: The requested command.
        T_world_base: Pose of the robot.
        robot: Its body and limits.
        hazards: Obstacles and drops within reach.
        horizon_s: Longest time until the next command, seconds.
        margin_m: Least free space beside the body; manual driving needs more than a planner that
            keeps away from obstacles itself.
        slack_m: How much closer a robot that is too close already may get in one command.

    Returns:
        The safe command, and the reason if it differs from the requested one, else None.
    """
    obstacles = hazards.all
    if len(obstacles) == 0:
        return command, None
    pose = np.array([[T_world_base[0, 3], T_world_base[1, 3], yaw_of(T_world_base)]])
    allowed = np.minimum(margin_m, body_clearance(robot, pose, obstacles) - slack_m)

    def is_free(tried: Command) -> bool:
        poses = np.concatenate(_stopping_paths(tried, pose[0], robot, horizon_s))
        return bool((body_clearance(robot, poses, obstacles) >= allowed).all())

    if is_free(command):
        return command, None
    where = _where(command, T_world_base, hazards)
    for share in _SHARES:
        tried = replace(
            command,
            linear_m_s=share * command.linear_m_s,
            yaw_rate_rad_s=share * command.yaw_rate_rad_s,
        )
        if is_free(tried):
            return tried, f"slowed to {share:.0%}: {where}"
    turning = replace(command, linear_m_s=0.0)
    if not is_free(turning):
        turning = replace(turning, yaw_rate_rad_s=0.0)
    return turning, f"stopped: {where}"


def limits_ahead(
    robot: RobotProfile, speed_m_s: float, horizon_s: float, margin_m: float
) -> tuple[float, float]:
    """Return how far ahead an obstacle slows and stops a robot that drives straight.

    Args:
        robot: Its body and limits.
        speed_m_s: Speed that is requested.
        horizon_s: Longest time until the next command.
        margin_m: As for `filter_among_hazards`.

    Returns:
        Distances from the robot's centre in metres: at which the speed begins to be reduced, and at
        which even the least speed is refused.
    """
    front = max(sphere.x_m + sphere.radius_m for sphere in robot.spheres) + margin_m
    full, least = speed_m_s, _SHARES[-1] * speed_m_s

    def travelled(speed: float) -> float:
        return speed * (horizon_s + 0.5 * speed / robot.max_linear_acceleration_m_s2)

    return front + travelled(full), front + travelled(least)


def _stopping_paths(
    command: Command, pose: Float64Array, robot: RobotProfile, horizon_s: float
) -> list[Float64Array]:
    """Return (N, 3) poses until the robot has stopped, the present left out, for each way to stop.

    With both rates reduced together it stays on the command's arc; with each braked by its own
    limit, it leaves the arc as braking begins. A body that is not round needs room to stop turning,
    too.
    """
    speed, rate = abs(command.linear_m_s), abs(command.yaw_rate_rad_s)
    stop_s = speed / robot.max_linear_acceleration_m_s2
    stop_turning_s = rate / robot.max_yaw_acceleration_rad_s2
    braking_s = stop_s if robot.is_round else max(stop_s, stop_turning_s)
    # Samples a few centimetres or degrees apart.
    spacing_s = 1.0 / max(speed / 0.03, rate / 0.1, 1e-9)

    def times(end_s: float) -> Float64Array:
        return np.linspace(0.0, end_s, max(2, math.ceil(end_s / spacing_s)) + 1)

    t = times(horizon_s + 0.5 * braking_s)
    paths = [_integrated(command.linear_m_s * t, command.yaw_rate_rad_s * t, pose)]
    if min(speed, rate) > 0.0 and stop_s != stop_turning_s:
        t = times(horizon_s + braking_s)
        driven = command.linear_m_s * _time_at_full_rate(t, horizon_s, stop_s)
        turned = command.yaw_rate_rad_s * _time_at_full_rate(t, horizon_s, stop_turning_s)
        paths.append(_integrated(driven, turned, pose))
    return paths


def _time_at_full_rate(t: Float64Array, horizon_s: float, stop_s: float) -> Float64Array:
    """Return how long a full rate takes for what one with braking does until `t`, seconds."""
    braking = np.clip(t - horizon_s, 0.0, stop_s)
    return np.minimum(t, horizon_s) + braking * (1.0 - 0.5 * braking / max(stop_s, 1e-9))


def _integrated(driven: Float64Array, turned: Float64Array, pose: Float64Array) -> Float64Array:
    """Return (N, 3) poses after distances driven and angles turned, (N + 1,) that begin with 0."""
    x, y, yaw = pose
    turn = np.diff(turned)
    # The chord of an arc points to its middle heading.
    middle = yaw + turned[:-1] + 0.5 * turn
    chord = np.diff(driven) * np.sinc(0.5 * turn / math.pi)
    return np.column_stack(
        [
            x + np.cumsum(chord * np.cos(middle)),
            y + np.cumsum(chord * np.sin(middle)),
            yaw + turned[1:],
        ]
    )


def _where(command: Command, T_world_base: Float64Array, hazards: Hazards) -> str:
    """Return what is in the way of a command: the nearest obstacle or drop, and where it is."""
    offset = hazards.all - T_world_base[:2, 3]
    heading = yaw_of(T_world_base) + (math.pi if command.linear_m_s < 0.0 else 0.0)
    ahead = offset @ np.array([math.cos(heading), math.sin(heading)])
    distance = np.hypot(offset[:, 0], offset[:, 1])
    in_way = ahead > 0.5 * distance
    side = "behind" if command.linear_m_s < 0.0 else "ahead"
    if command.linear_m_s == 0.0 or not in_way.any():
        in_way, side = np.ones(len(ahead), dtype=np.bool_), "beside"
    nearest = int(np.argmin(np.where(in_way, distance, np.inf)))
    if nearest < len(hazards.obstacles):
        return f"obstacle {distance[nearest]:.2f} m {side}"
    return f"drop {distance[nearest]:.2f} m {side}"

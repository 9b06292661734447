"""The safety filter: slows or stops commands that would drive the body into an obstacle."""

import math
from dataclasses import replace

import numpy as np

from ippon.command import Command
from ippon.control.obstacles import (
    OVERLAP_TOLERANCE_M,
    body_clearance,
    mapped_obstacles,
    observed_obstacles,
)
from ippon.frame import Frame
from ippon.geometry import Float64Array, yaw_of
from ippon.mapping.arrays import MapArrays
from ippon.robot import RobotProfile

_SHARES = (1.0, 0.75, 0.5, 0.3, 0.15, 0.0)


def filter_command(
    command: Command,
    T_world_base: Float64Array,
    robot: RobotProfile,
    map_arrays: MapArrays,
    horizon_s: float,
    frame: Frame | None = None,
) -> tuple[Command, str | None]:
    """Scale a command down until the robot can execute it and still stop in time.

    The body is checked along the command's arc for the horizon plus its braking distance. A robot
    that is too close to an obstacle already may move as long as it does not get closer. Linear and
    yaw rate are scaled together, so that the arc is unchanged; if no part of it is free, turning in
    place is tried.

    Args:
        command: The requested command.
        T_world_base: Pose of the robot.
        robot: Its body and limits.
        map_arrays: The map; unknown space is no obstacle here.
        horizon_s: Longest time until the next command, seconds.
        frame: The newest image, whose obstacles may not be in the map yet; None if there is none.

    Returns:
        The safe command, and the reason if it differs from the requested one, else None.
    """
    speed = abs(command.linear_m_s)
    reach = robot.radius_m + speed * (horizon_s + speed / robot.max_linear_acceleration_m_s2) + 0.3
    obstacles = mapped_obstacles(map_arrays, robot, T_world_base, reach)
    if frame is not None:
        seen = observed_obstacles(frame, robot, map_arrays.voxel_size, reach)
        obstacles = np.concatenate([obstacles, seen])
    return filter_among_obstacles(command, T_world_base, robot, obstacles, horizon_s)


def filter_among_obstacles(
    command: Command,
    T_world_base: Float64Array,
    robot: RobotProfile,
    obstacles: Float64Array,
    horizon_s: float,
    margin_m: float = -OVERLAP_TOLERANCE_M,
    slack_m: float = 0.002,
) -> tuple[Command, str | None]:
    """Scale a command down among given obstacles; see `filter_command`.

    Args:
        command: The requested command.
        T_world_base: Pose of the robot.
        robot: Its body and limits.
        obstacles: (M, 2) world x and y of occupied voxel columns within reach, metres.
        horizon_s: Longest time until the next command, seconds.
        margin_m: Least free space beside the body; manual driving needs more than a planner that
            keeps away from obstacles itself.
        slack_m: How much closer a robot that is too close already may get in one command.

    Returns:
        The safe command, and the reason if it differs from the requested one, else None.
    """
    if len(obstacles) == 0:
        return command, None
    allowed = _least_room(robot, T_world_base, obstacles, margin_m, slack_m)
    for share in _SHARES:
        tried = replace(
            command,
            linear_m_s=share * command.linear_m_s,
            yaw_rate_rad_s=share * command.yaw_rate_rad_s,
        )
        room = _room_along(tried, T_world_base, robot, obstacles, horizon_s)
        if share == 1.0 and room >= allowed:
            return command, None
        if share > 0.0 and room >= allowed:
            return tried, f"slowed to {share:.0%}: {_where(command, T_world_base, obstacles)}"
    turning = replace(command, linear_m_s=0.0)
    if _room_along(turning, T_world_base, robot, obstacles, horizon_s) < allowed:
        turning = replace(turning, yaw_rate_rad_s=0.0)
    return turning, f"stopped: {_where(command, T_world_base, obstacles)}"


def limits_ahead(
    robot: RobotProfile, speed_m_s: float, horizon_s: float, margin_m: float
) -> tuple[float, float]:
    """Return how far ahead an obstacle slows and stops a robot that drives straight.

    Args:
        robot: Its body and limits.
        speed_m_s: Speed that is requested.
        horizon_s: Longest time until the next command.
        margin_m: As for `filter_among_obstacles`.

    Returns:
        Distances from the robot's centre in metres: at which the speed begins to be reduced, and at
        which even the least speed is refused.
    """
    front = max(sphere.x_m + sphere.radius_m for sphere in robot.spheres) + margin_m
    full, least = speed_m_s, _SHARES[-2] * speed_m_s

    def travelled(speed: float) -> float:
        return speed * (horizon_s + 0.5 * speed / robot.max_linear_acceleration_m_s2)

    return front + travelled(full), front + travelled(least)


def _least_room(
    robot: RobotProfile,
    T_world_base: Float64Array,
    obstacles: Float64Array,
    margin_m: float,
    slack_m: float,
) -> float:
    """Return the least free space allowed; less for a robot that is closer than that already."""
    pose = np.array([[T_world_base[0, 3], T_world_base[1, 3], yaw_of(T_world_base)]])
    now = float(body_clearance(robot, pose, obstacles)[0])
    return min(margin_m, now - slack_m)


def _room_along(
    command: Command,
    T_world_base: Float64Array,
    robot: RobotProfile,
    obstacles: Float64Array,
    horizon_s: float,
) -> float:
    speed = abs(command.linear_m_s)
    duration = horizon_s + 0.5 * speed / robot.max_linear_acceleration_m_s2
    # Samples a few centimetres or degrees apart, the present pose left out.
    count = max(2, math.ceil(max(speed * duration / 0.03, abs(command.yaw_rate_rad_s) / 0.1)))
    t = np.arange(1, count + 1) / count * duration
    yaw = yaw_of(T_world_base) + command.yaw_rate_rad_s * t
    middle = yaw_of(T_world_base) + 0.5 * command.yaw_rate_rad_s * t
    # The chord of an arc points to its middle heading.
    half = 0.5 * command.yaw_rate_rad_s * t
    chord = command.linear_m_s * t * np.sinc(half / math.pi)
    poses = np.column_stack(
        [
            T_world_base[0, 3] + chord * np.cos(middle),
            T_world_base[1, 3] + chord * np.sin(middle),
            yaw,
        ]
    )
    return float(body_clearance(robot, poses, obstacles).min())


def _where(command: Command, T_world_base: Float64Array, obstacles: Float64Array) -> str:
    """Return where the nearest obstacle in the way of a command is."""
    offset = obstacles - T_world_base[:2, 3]
    heading = yaw_of(T_world_base) + (math.pi if command.linear_m_s < 0.0 else 0.0)
    ahead = offset @ np.array([math.cos(heading), math.sin(heading)])
    distance = np.hypot(offset[:, 0], offset[:, 1])
    in_way = ahead > 0.5 * distance if command.linear_m_s != 0.0 else np.ones(len(ahead), bool)
    side = "behind" if command.linear_m_s < 0.0 else "ahead"
    if not in_way.any():
        in_way, side = np.ones(len(ahead), dtype=np.bool_), "beside"
    return f"obstacle {float(distance[in_way].min()):.2f} m {side}"

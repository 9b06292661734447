"""Acceleration limits between one command and the next."""

import math
from dataclasses import replace

from ippon.command import Command
from ippon.robot import RobotProfile


def limit_acceleration(
    wanted: Command,
    last: Command,
    robot: RobotProfile,
    dt_s: float,
    *,
    brakes_at_once: bool = False,
) -> Command:
    """Return the command nearest to the wanted one within the acceleration limits.

    Args:
        wanted: Wanted velocities.
        last: The previous command.
        robot: Its limits.
        dt_s: Seconds since the previous command.
        brakes_at_once: Deceleration is unlimited: after a contact, and on a stop of the operator.
    """
    return replace(
        wanted,
        linear_m_s=_approach(
            wanted.linear_m_s,
            last.linear_m_s,
            robot.max_linear_acceleration_m_s2 * dt_s,
            brakes_at_once,
        ),
        yaw_rate_rad_s=_approach(
            wanted.yaw_rate_rad_s,
            last.yaw_rate_rad_s,
            robot.max_yaw_acceleration_rad_s2 * dt_s,
            brakes_at_once,
        ),
    )


def _approach(wanted: float, last: float, step: float, brakes_at_once: bool) -> float:
    if brakes_at_once:
        same_way = wanted * last > 0.0
        last = math.copysign(min(abs(last), abs(wanted)), last) if same_way else 0.0
    return last + min(max(wanted - last, -step), step)

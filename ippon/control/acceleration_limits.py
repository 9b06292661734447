"""Commands that a body can follow: from one to the next no faster than it accelerates."""

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
    """Approach the wanted velocities as fast as the acceleration limits let the robot.

    Args:
        wanted: Where to get.
        last: What was commanded before.
        robot: Its limits.
        dt_s: Seconds since then.
        brakes_at_once: Slowing down has no limit: after a contact, and when the operator says stop.
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

"""Getting free after a contact, or when the robot does not move although it is told to."""

import math
from dataclasses import dataclass

from ippon.command import Command
from ippon.frame import NANOSECONDS
from ippon.geometry import Float64Array, wrap_angle, yaw_of
from ippon.robot import RobotProfile


@dataclass(frozen=True, slots=True, kw_only=True)
class RecoveryConfig:
    """When the robot counts as stuck, and how it gets free."""

    stuck_after_s: float = 2.5
    """Driving commands without movement for this long mean stuck."""
    moved_m: float = 0.05
    """Less than this counts as no movement."""
    back_up_s: float = 0.8
    """How long to drive back; more gives the planner more room to turn."""
    back_up_m_s: float = 0.2
    turn_s: float = 1.2
    """How long to turn instead, for a robot that cannot drive back."""


class Recovery:
    """Notices that the robot is blocked and takes over for a moment."""

    def __init__(self, config: RecoveryConfig, robot: RobotProfile) -> None:
        self._config = config
        self._robot = robot
        self._freeing_since_ns: int | None = None
        self._moving_since_ns: int | None = None
        self._moving_from = (0.0, 0.0, 0.0)
        self._was_contact = False

    def blocked(self, stamp_ns: int, T_world_base: Float64Array, contact: bool) -> bool:
        """Tell, once for each time, that the robot has just turned out to be blocked."""
        touched = contact and not self._was_contact
        self._was_contact = contact
        if touched or self._is_stuck(stamp_ns, T_world_base):
            self._freeing_since_ns = stamp_ns
            self._moving_since_ns = None
            return True
        return False

    def _is_stuck(self, stamp_ns: int, T_world_base: Float64Array) -> bool:
        if self._moving_since_ns is None:
            return False
        if stamp_ns < self._moving_since_ns:
            # The robot's clock started anew: how long it has not moved is not known.
            self._moving_since_ns = None
            return False
        x, y, yaw = self._moving_from
        moved = math.hypot(T_world_base[0, 3] - x, T_world_base[1, 3] - y)
        if moved > self._config.moved_m or abs(wrap_angle(yaw_of(T_world_base) - yaw)) > 0.1:
            self._moving_since_ns = None
            return False
        return stamp_ns - self._moving_since_ns > self._config.stuck_after_s * NANOSECONDS

    def command(self, stamp_ns: int, tilt_rad: float) -> Command | None:
        """Return the command that gets the robot free, None when nothing needs to be done."""
        since = self._freeing_since_ns
        duration_s = self._config.back_up_s if self._robot.can_reverse else self._config.turn_s
        # A stamp from before the contact means that the robot's clock started anew: it is over.
        if since is None or not 0 <= stamp_ns - since < int(duration_s * NANOSECONDS):
            self._freeing_since_ns = None
            return None
        if self._robot.can_reverse:
            speed = min(self._config.back_up_m_s, self._robot.max_linear_m_s)
            return Command(linear_m_s=-speed, tilt_rad=tilt_rad)
        return Command(yaw_rate_rad_s=self._robot.max_yaw_rate_rad_s, tilt_rad=tilt_rad)

    @property
    def frees(self) -> bool:
        """The robot is being freed."""
        return self._freeing_since_ns is not None

    def watch(self, stamp_ns: int, T_world_base: Float64Array, command: Command) -> None:
        """Take note of the command that was given, to see whether the robot follows it."""
        driving = abs(command.linear_m_s) > 0.05 or abs(command.yaw_rate_rad_s) > 0.1
        if not driving:
            self._moving_since_ns = None
        elif self._moving_since_ns is None:
            self._moving_since_ns = stamp_ns
            self._moving_from = (
                float(T_world_base[0, 3]),
                float(T_world_base[1, 3]),
                yaw_of(T_world_base),
            )

"""Getting free after a contact, or when the robot does not move although it is told to."""

import math

from ippon.command import Command
from ippon.frame import NANOSECONDS, Frame
from ippon.geometry import Float64Array, wrap_angle, yaw_of
from ippon.mission.behaviors.behavior import Action, Situation
from ippon.mission.behaviors.config import RecoveryConfig
from ippon.robot import RobotProfile


class Recovery:
    """Notices that the robot is blocked and takes over for a moment."""

    def __init__(self, config: RecoveryConfig, robot: RobotProfile) -> None:
        self._config = config
        self._robot = robot
        self._freeing_since_ns: int | None = None
        self._moving_since_ns: int | None = None
        self._moving_from = (0.0, 0.0, 0.0)
        self._was_contact = False

    def is_blocked(self, frame: Frame) -> bool:
        """Return, once for each event, whether the robot touched something or got stuck."""
        stamp_ns, contact = frame.stamp_ns, frame.contact
        touched = contact and not self._was_contact
        self._was_contact = contact
        if touched or self._is_stuck(stamp_ns, frame.T_world_base):
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

    def act(self, situation: Situation) -> Action | None:
        """See `Behavior.act`."""
        command = self._command(situation.frame.stamp_ns, situation.frame.tilt_rad)
        return None if command is None else Action(command)

    def _command(self, stamp_ns: int, tilt_rad: float) -> Command | None:
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
    def active(self) -> bool:
        """The robot is being freed."""
        return self._freeing_since_ns is not None

    def watch(self, frame: Frame, command: Command | None) -> None:
        """Remember the command that was given, to see whether the robot follows it.

        Args:
            frame: The frame that it answers.
            command: Before the collision filter: a robot that is kept from driving is stuck, too.
                None where somebody else drives.
        """
        stamp_ns, T_world_base = frame.stamp_ns, frame.T_world_base
        driving = command is not None and _drives(command)
        if not driving:
            self._moving_since_ns = None
        elif self._moving_since_ns is None:
            self._moving_since_ns = stamp_ns
            self._moving_from = (
                float(T_world_base[0, 3]),
                float(T_world_base[1, 3]),
                yaw_of(T_world_base),
            )


def _drives(command: Command) -> bool:
    return abs(command.linear_m_s) > 0.05 or abs(command.yaw_rate_rad_s) > 0.1

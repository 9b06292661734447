"""Freeing the robot after a contact, or when it does not follow its commands."""

import math

from ippon.command import COMMAND_S, Command
from ippon.frame import NANOSECONDS, Frame
from ippon.geometry import Float64Array, wrap_angle, yaw_of
from ippon.mission.behaviors.behavior import Action, StepContext
from ippon.mission.behaviors.config import RecoveryConfig
from ippon.robot import RobotProfile


class Recovery:
    """Drives back from where the robot came, or turns, for a moment when it is blocked."""

    def __init__(self, config: RecoveryConfig, robot: RobotProfile) -> None:
        self._config = config
        self._robot = robot
        self._freeing_since_ns: int | None = None
        self._frees_forwards = False
        self._unmoved_ns: int | None = None
        """Time of driving commands without movement, as if at full speed; None without one."""
        self._watched_ns = 0
        self._speed_share = 1.0
        self._moving_from = (0.0, 0.0, 0.0)
        self._was_contact = False

    def is_blocked(self, frame: Frame, motion: Command) -> bool:
        """Return whether the robot has just touched something or got stuck; once per event.

        Args:
            frame: The newest frame.
            motion: The last command: what stopped the robot lies where it drove to.
        """
        stamp_ns, contact = frame.stamp_ns, frame.contact
        touched = contact and not self._was_contact
        self._was_contact = contact
        if touched or self._is_stuck(stamp_ns, frame.T_world_base):
            self._freeing_since_ns = stamp_ns
            self._frees_forwards = motion.linear_m_s < 0.0
            self._unmoved_ns = None
            return True
        return False

    def _is_stuck(self, stamp_ns: int, T_world_base: Float64Array) -> bool:
        if self._unmoved_ns is None:
            return False
        since_ns, self._watched_ns = stamp_ns - self._watched_ns, stamp_ns
        if since_ns < 0:
            # The robot's clock was reset.
            self._unmoved_ns = None
            return False
        x, y, yaw = self._moving_from
        moved = math.hypot(T_world_base[0, 3] - x, T_world_base[1, 3] - y)
        turned = abs(wrap_angle(yaw_of(T_world_base) - yaw))
        if moved > self._config.moved_m or turned > self._config.turned_rad:
            self._unmoved_ns = None
            return False
        # While frames are missing the robot stands. A slower one takes longer to move as far.
        self._unmoved_ns += round(self._speed_share * min(since_ns, int(COMMAND_S * NANOSECONDS)))
        return self._unmoved_ns > self._config.stuck_after_s * NANOSECONDS

    def act(self, step: StepContext) -> Action | None:
        """See `Behavior.act`."""
        command = self._command(step.frame.stamp_ns, step.frame.tilt_rad)
        return None if command is None else Action(command)

    def _command(self, stamp_ns: int, tilt_rad: float) -> Command | None:
        since = self._freeing_since_ns
        duration_s = self._config.back_up_s if self._robot.can_reverse else self._config.turn_s
        # A stamp from before the contact means that the robot's clock was reset.
        if since is None or not 0 <= stamp_ns - since < int(duration_s * NANOSECONDS):
            self._freeing_since_ns = None
            return None
        if self._robot.can_reverse:
            speed = min(self._config.back_up_m_s, self._robot.max_linear_m_s)
            return Command(linear_m_s=speed if self._frees_forwards else -speed, tilt_rad=tilt_rad)
        return Command(yaw_rate_rad_s=self._robot.max_yaw_rate_rad_s, tilt_rad=tilt_rad)

    @property
    def active(self) -> bool:
        """The robot is being freed."""
        return self._freeing_since_ns is not None

    def watch(self, frame: Frame, command: Command | None, speed_share: float = 1.0) -> None:
        """Keep a command, to check in later frames whether the robot follows it.

        Args:
            frame: The frame that the command answers.
            command: The command before the collision filter, since a robot that the filter stops is
                stuck, too. None if the operator drives.
            speed_share: Share of the command's velocities that the robot is sent.
        """
        stamp_ns, T_world_base = frame.stamp_ns, frame.T_world_base
        driving = command is not None and self._drives(command)
        self._watched_ns, self._speed_share = stamp_ns, speed_share
        if not driving:
            self._unmoved_ns = None
        elif self._unmoved_ns is None:
            self._unmoved_ns = 0
            self._moving_from = (
                float(T_world_base[0, 3]),
                float(T_world_base[1, 3]),
                yaw_of(T_world_base),
            )

    def _drives(self, command: Command) -> bool:
        config = self._config
        return (
            abs(command.linear_m_s) > config.driving_m_s
            or abs(command.yaw_rate_rad_s) > config.driving_rad_s
        )

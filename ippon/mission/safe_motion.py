"""Commands within the robot's accelerations, and clear of all known obstacles."""

from typing import Final

from ippon.command import Command
from ippon.control.acceleration_limits import limit_acceleration
from ippon.control.safety_filter import filter_command
from ippon.frame import Frame
from ippon.mapping.voxel_map import VoxelMap
from ippon.robot import RobotProfile

MIN_HORIZON_S: Final = 0.1
MAX_HORIZON_S: Final = 0.5
"""A command holds until the next frame; the last interval predicts how long, within these."""


def moves_base(command: Command) -> bool:
    """Return whether a command drives or turns the body."""
    return not command.linear_m_s == command.yaw_rate_rad_s == 0.0


class SafeMotion:
    """Limits each command by the one before it and by the obstacles around the body."""

    def __init__(self, robot: RobotProfile, voxel_map: VoxelMap) -> None:
        self._robot = robot
        self._voxel_map = voxel_map
        self._manual = False
        self.last = Command()
        """The command that the robot was given last."""

    def resume_from(self, command: Command, *, manual: bool = False) -> None:
        """Replace the last command by the one that the robot was really given.

        Args:
            command: At rest where the robot was kept from driving.
            manual: It is the operator's: the next command brakes at once where it is slower.
        """
        self.last = command
        self._manual = self._manual or manual

    def accelerate(self, command: Command, dt_s: float, *, brakes_at_once: bool) -> Command:
        """Return the command that is reached from the last one within the robot's accelerations.

        Args:
            command: Wanted.
            dt_s: Seconds since the last frame.
            brakes_at_once: Slowing down is not limited.
        """
        at_once = brakes_at_once or self._manual
        self._manual = False
        return limit_acceleration(command, self.last, self._robot, dt_s, brakes_at_once=at_once)

    def avoid_collision(
        self, command: Command, frame: Frame, dt_s: float
    ) -> tuple[Command, str | None]:
        """Return the part of a command that drives the body into nothing, and remember it.

        Args:
            command: Wanted.
            frame: Pose and newest image.
            dt_s: Seconds since the last frame.

        Returns:
            The command as it may be carried out, and the reason where it is less than wanted.
        """
        reason = None
        if moves_base(command):
            horizon_s = min(max(dt_s, MIN_HORIZON_S), MAX_HORIZON_S)
            command, reason = filter_command(
                command, frame.T_world_base, self._robot, self._voxel_map.arrays(), horizon_s, frame
            )
        self.last = command
        return command, reason

"""Limits commands by the robot's accelerations and by known obstacles."""

from dataclasses import replace
from typing import Final

from ippon.command import COMMAND_S, Command
from ippon.control.acceleration_limits import limit_acceleration
from ippon.control.safety_filter import filter_command
from ippon.frame import Frame
from ippon.mapping.voxel_map import VoxelMap
from ippon.robot import RobotProfile

MIN_HORIZON_S: Final = 0.1
MAX_HORIZON_S: Final = 0.5
"""Bounds of the time until the next frame, which the last interval predicts."""
MAX_AGE_S: Final = 1.0
"""Age of a frame beyond which its obstacles are checked no farther ahead: robots refuse commands
that answer older ones."""


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
        """The last command of the robot."""

    def with_known_tilt(self, frame: Frame) -> Frame:
        """Return a frame with the profile's tilt where the camera is fixed.

        The tilt of a fixed camera may differ a little from its profile; no tilt is awaited.
        """
        return frame if self._robot.can_tilt else replace(frame, tilt_rad=self._robot.min_tilt_rad)

    def resume_from(self, command: Command, *, manual: bool = False) -> None:
        """Replace the last command by the one that the robot has executed.

        Args:
            command: The executed command.
            manual: It is the operator's: if the next command is slower, the robot brakes at once.
        """
        self.last = command
        self._manual = self._manual or manual

    def accelerate(self, command: Command, dt_s: float, *, brakes_at_once: bool) -> Command:
        """Return the command nearest to the wanted one within the robot's accelerations.

        Args:
            command: The wanted command.
            dt_s: Seconds since the last frame; after more than `COMMAND_S` the robot stands.
            brakes_at_once: Slowing down is not limited.
        """
        at_once = brakes_at_once or self._manual
        self._manual = False
        last = self.last if dt_s <= COMMAND_S else Command()
        step_s = min(dt_s, COMMAND_S)
        return limit_acceleration(command, last, self._robot, step_s, brakes_at_once=at_once)

    def avoid_collision(
        self,
        command: Command,
        frame: Frame,
        dt_s: float,
        age_s: float = 0.0,
        floor_z_m: float | None = None,
    ) -> tuple[Command, str | None]:
        """Scale a command down until it is free of collisions, and keep it as the last one.

        Args:
            command: The wanted command.
            frame: Pose and newest image.
            dt_s: Seconds since the last frame.
            age_s: Seconds since the frame was taken: the robot has driven on meanwhile.
            floor_z_m: Height at which the planner has read the floor; None for that of the base.

        Returns:
            The safe command, and the reason if it differs from the wanted one.
        """
        reason = None
        if moves_base(command):
            horizon_s = min(max(dt_s, MIN_HORIZON_S), MAX_HORIZON_S) + min(age_s, MAX_AGE_S)
            command, reason = filter_command(
                command,
                frame.T_world_base,
                self._robot,
                self._voxel_map.arrays(),
                horizon_s,
                frame,
                floor_z_m,
            )
        self.last = command
        return command, reason

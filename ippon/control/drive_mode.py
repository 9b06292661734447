"""Drive modes: autonomous, manual, and assisted (shared control of operator and planner)."""

import dataclasses
from dataclasses import dataclass
from enum import StrEnum

from ippon.command import Command
from ippon.robot import RobotProfile

STILL = 1e-3
"""Commands below this, in m/s or rad/s, count as standing still."""


class DriveMode(StrEnum):
    """Who controls the base: planner, operator, or both."""

    AUTO = "auto"
    """The planner drives; the operator's input is ignored."""
    ASSISTED = "assisted"
    """The robot moves only while a key is held; forward alone follows the planner's path."""
    MANUAL = "manual"
    """The operator drives; mapping continues."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TeleopInput:
    """The operator's input; each component is a fraction, -1 to 1, of the robot's top speed."""

    forward: float = 0.0
    turn: float = 0.0
    """Counter-clockwise from above."""
    tilt: float = 0.0
    """Positive tilts the camera up."""

    def __post_init__(self) -> None:
        """Reject components outside -1 to 1."""
        if not all(-1.0 <= value <= 1.0 for value in (self.forward, self.turn, self.tilt)):
            raise ValueError(f"each part of a teleop input lies in -1 to 1; got {self}")

    @property
    def drives(self) -> bool:
        """Whether the input moves the base."""
        return self.forward != 0.0 or self.turn != 0.0


NO_INPUT = TeleopInput()


def blend_commands(
    mode: DriveMode, teleop: TeleopInput, planned: Command, robot: RobotProfile
) -> Command:
    """Combine the operator's input and the planner's command.

    In Assisted the robot moves only with an input. Forward alone follows the planner's path: linear
    and yaw rate of the plan, both scaled by the input, so that the arc is unchanged. With any turn
    or backward input the operator steers alone.

    Args:
        mode: Drive mode.
        teleop: The operator's input.
        planned: The planner's command.
        robot: Its limits.

    Returns:
        The command, before the safety filter. Its tilt is the planner's if the planner steers;
        otherwise it is meaningless, since the operator controls the tilt by its rate.
    """
    if mode is DriveMode.AUTO:
        return planned
    if not teleop.drives:
        return dataclasses.replace(planned, linear_m_s=0.0, yaw_rate_rad_s=0.0)
    if follows_plan(mode, teleop):
        return dataclasses.replace(
            planned,
            linear_m_s=teleop.forward * planned.linear_m_s,
            yaw_rate_rad_s=teleop.forward * planned.yaw_rate_rad_s,
        )
    backwards = robot.max_linear_m_s if robot.can_reverse else 0.0
    fastest = robot.max_linear_m_s if teleop.forward > 0.0 else backwards
    return dataclasses.replace(
        planned,
        linear_m_s=teleop.forward * fastest,
        yaw_rate_rad_s=teleop.turn * robot.max_yaw_rate_rad_s,
    )


def follows_plan(mode: DriveMode, teleop: TeleopInput) -> bool:
    """Return whether the planner steers."""
    if mode is DriveMode.AUTO:
        return True
    return mode is DriveMode.ASSISTED and teleop.forward > 0.0 and teleop.turn == 0.0


def scale_command(command: Command, share: float) -> Command:
    """Return a command with both velocities scaled, so that its arc is unchanged."""
    return dataclasses.replace(
        command,
        linear_m_s=share * command.linear_m_s,
        yaw_rate_rad_s=share * command.yaw_rate_rad_s,
    )

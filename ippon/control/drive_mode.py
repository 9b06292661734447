"""Who drives: the planner, the operator, or the operator along the planner's way."""

import dataclasses
from dataclasses import dataclass
from enum import StrEnum

from ippon.command import Command
from ippon.robot import RobotProfile

STILL = 1e-3
"""Commands below this, in m/s or rad/s, move nothing."""


class DriveMode(StrEnum):
    """How the operator's hand and the planner share the wheels."""

    AUTO = "auto"
    """The planner drives; the operator's hand has no part in it."""
    ASSISTED = "assisted"
    """The robot moves only while a key is held, and forward alone follows the planner's way."""
    MANUAL = "manual"
    """The operator drives; the map goes on growing."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TeleopInput:
    """What the operator holds down; each part in -1 to 1 of what the robot can do."""

    forward: float = 0.0
    turn: float = 0.0
    """Counter-clockwise from above."""
    tilt: float = 0.0
    """Camera up."""

    def __post_init__(self) -> None:
        """Reject more than the robot can do."""
        if not all(-1.0 <= value <= 1.0 for value in (self.forward, self.turn, self.tilt)):
            raise ValueError(f"each part of a teleop input lies in -1 to 1; got {self}")

    @property
    def drives(self) -> bool:
        """Whether the base is to move."""
        return self.forward != 0.0 or self.turn != 0.0


NO_INPUT = TeleopInput()


def blend_commands(
    mode: DriveMode, hand: TeleopInput, planned: Command, robot: RobotProfile
) -> Command:
    """Make one command of what the operator holds down and what the planner wants.

    In Assisted nothing moves unless something is held. Forward alone goes the planner's way at the
    operator's pace: speed and turn of the plan, both scaled by how far the hand is pushed, so that
    the arc stays the arc. Turning or backing up is the operator's own; where both forward and turn
    are held, the planner has no part in it either.

    Args:
        mode: Who drives.
        hand: What the operator holds down.
        planned: What the planner wants now.
        robot: Its limits.

    Returns:
        The command, before the safety filter. Its tilt is the planner's in Auto and where the
        planner steers; elsewhere it means nothing, since the hand moves the camera by rate.
    """
    if mode is DriveMode.AUTO:
        return planned
    if not hand.drives:
        return dataclasses.replace(planned, linear_m_s=0.0, yaw_rate_rad_s=0.0)
    if follows_plan(mode, hand):
        return dataclasses.replace(
            planned,
            linear_m_s=hand.forward * planned.linear_m_s,
            yaw_rate_rad_s=hand.forward * planned.yaw_rate_rad_s,
        )
    backwards = robot.max_linear_m_s if robot.can_reverse else 0.0
    fastest = robot.max_linear_m_s if hand.forward > 0.0 else backwards
    return dataclasses.replace(
        planned,
        linear_m_s=hand.forward * fastest,
        yaw_rate_rad_s=hand.turn * robot.max_yaw_rate_rad_s,
    )


def follows_plan(mode: DriveMode, hand: TeleopInput) -> bool:
    """Tell whether the planner steers now."""
    if mode is DriveMode.AUTO:
        return True
    return mode is DriveMode.ASSISTED and hand.forward > 0.0 and hand.turn == 0.0


def scale_command(command: Command, share: float) -> Command:
    """Slow a command down to a share of itself; the arc stays the arc."""
    return dataclasses.replace(
        command,
        linear_m_s=share * command.linear_m_s,
        yaw_rate_rad_s=share * command.yaw_rate_rad_s,
    )

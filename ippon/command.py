"""Commands of the mission to the robot."""

from dataclasses import dataclass
from enum import StrEnum
from typing import Final

COMMAND_S: Final = 0.5
"""Time after which a robot stands that gets no other command."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NavigationGoal:
    """A pose on the floor for a robot that navigates by itself."""

    number: int
    """Counts up; a goal that is repeated keeps its number."""
    x_m: float
    """World x of the base's centre."""
    y_m: float
    yaw_rad: float


class GoalOutcome(StrEnum):
    """What the robot's navigation says about a goal."""

    ACCEPTED = "accepted"
    """It drives there."""
    REACHED = "reached"
    FAILED = "failed"
    """Refused or given up."""
    CANCELLED = "cancelled"


@dataclass(frozen=True, slots=True, kw_only=True)
class Command:
    """Velocities in the base frame, or a goal in their place, and a target tilt of the camera."""

    linear_m_s: float = 0.0
    """Forward speed; negative drives backwards."""
    yaw_rate_rad_s: float = 0.0
    """Turn rate, counter-clockwise from above."""
    tilt_rad: float = 0.0
    """Target tilt of the camera, positive up; the robot's tilt rate is limited."""
    goal: NavigationGoal | None = None
    """Where a robot that takes goals drives to; None stops it."""

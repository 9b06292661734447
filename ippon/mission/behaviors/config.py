"""Parameters of the behaviors."""

from dataclasses import dataclass


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


@dataclass(frozen=True, slots=True, kw_only=True)
class LookAroundConfig:
    """How the robot takes in its surroundings before it goes in search of an object."""

    down_tilt_rad: float = -0.9
    """Tilt at which the floor before the robot comes into view; lower sees closer floor."""
    turn_tilt_rad: float = -0.25
    """Tilt while turning; lower sees more floor and less wall."""
    turn: bool = True
    """Turn once round after looking down; off in the ablation "w/o Initial Yaw"."""
    floor_tilt_rad: float | None = -0.75
    """Tilt while turning back: the floor close by, on which the first metres are planned. None does
    not turn back, and saves the time."""
    tilt_tolerance_rad: float = 0.05


@dataclass(frozen=True, slots=True, kw_only=True)
class FloorCheckConfig:
    """When the robot checks the floor between itself and its target."""

    min_saving_s: float = 2.0
    """Time that the straight path must save beyond the check's own; more checks less often."""
    tilt_rad: float = -0.7
    """Lower sees closer floor and less far."""
    hold_s: float = 0.6
    """How long the camera rests on the floor; more takes more images of it."""

    def __post_init__(self) -> None:
        """Reject times without meaning."""
        if self.min_saving_s < 0.0 or not 0.0 < self.hold_s <= 10.0:
            raise ValueError(
                f"min_saving_s must not be negative and hold_s above 0, at most 10; got "
                f"{self.min_saving_s}, {self.hold_s}"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class TravelPitchConfig:
    """The sweep of the camera while driving (Sec. Traversability; ablation "w/o Travel Pitch")."""

    sweep: bool = True
    low_rad: float = -0.42
    """Lowest tilt of the sweep; lower sees the floor right before the robot, and less far."""
    high_rad: float = -0.18
    """Highest tilt of the sweep; higher sees the tops of shelves, and nothing that is near."""
    period_s: float = 4.0
    """A shorter period shows more and blurs more."""
    level_rad: float = -0.3
    """Tilt without a sweep."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ExhaustionConfig:
    """When nothing is left to explore."""

    empty_steps: int = 15
    """Steps in a row without a viewpoint worth a visit before the search ends as exhausted."""
    idle_gain: float = 0.3
    """Gain per second of the best path below which a step counts as idle; 0 waits until nothing is
    left to explore. Exploring has 1 to 15, the last corners less than this."""
    idle_steps: int = 15
    """Idle steps in a row before the robot returns to what it doubted."""

    def __post_init__(self) -> None:
        """Reject counts without meaning."""
        if self.idle_gain < 0.0 or self.idle_steps < 1 or self.empty_steps < 1:
            raise ValueError(
                "idle_gain must not be negative, idle_steps and empty_steps at least 1; got "
                f"{self.idle_gain}, {self.idle_steps}, {self.empty_steps}"
            )

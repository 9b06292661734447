"""Parameters of the behaviors."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class RecoveryConfig:
    """When the robot counts as stuck, and how it gets free."""

    stuck_after_s: float = 2.5
    """Seconds of driving commands without movement after which the robot is stuck, at full speed;
    at a speed limit it takes as much longer. More tolerates slow starts and frees it later."""
    moved_m: float = 0.05
    """Distance below which the robot has not moved; more frees a robot that crawls."""
    turned_rad: float = 0.1
    """Turn below which it has not moved either; more frees a robot that turns very slowly."""
    driving_m_s: float = 0.05
    """Speed of a command above which movement is expected; more ignores slow commands."""
    driving_rad_s: float = 0.1
    """Yaw rate of a command above which movement is expected; more ignores slow turns."""
    back_up_s: float = 0.8
    """Seconds of reversing; more gives the planner more space to turn."""
    back_up_m_s: float = 0.2
    """Speed of reversing; more backs off farther, over floor that the camera does not see."""
    turn_s: float = 1.2
    """Seconds of turning instead, for a robot that cannot reverse; more turns farther away."""

    def __post_init__(self) -> None:
        """Reject times and speeds without meaning."""
        if self.stuck_after_s <= 0.0 or min(self.back_up_s, self.back_up_m_s, self.turn_s) < 0.0:
            raise ValueError(
                "stuck_after_s must be above 0, back_up_s, back_up_m_s and turn_s at least 0; got "
                f"{self.stuck_after_s}, {self.back_up_s}, {self.back_up_m_s}, {self.turn_s}"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class LookAroundConfig:
    """The look around at the start of a search (Sec. Traversability)."""

    down_tilt_rad: float = -0.9
    """Tilt that shows the floor in front of the robot; less shows floor closer to it."""
    turn_tilt_rad: float = -0.25
    """Tilt while turning; less shows more floor and less wall."""
    turn: bool = True
    """Turn by a full circle after looking down; off in the ablation "w/o Initial Yaw"."""
    floor_tilt_rad: float | None = -0.75
    """Tilt while turning back, for the near floor on which the first metres are planned; less shows
    floor closer to the robot. None does not turn back, which saves the time."""
    tilt_tolerance_rad: float = 0.05
    """Error of the tilt up to which it is reached; more waits less."""
    overlap_fraction: float = 0.25
    """Overlap of the first and the last image of the circle, as a fraction of the field of view;
    more turns farther."""
    wait_steps: int = 5
    """Steps to wait for a terminating viewpoint that has just disappeared; more waits longer."""
    same_place_m: float = 0.5
    """Distance within which a look around need not be repeated or completed; more repeats fewer."""

    def __post_init__(self) -> None:
        """Reject a circle that never closes."""
        if not 0.0 <= self.overlap_fraction < 1.0 or self.tilt_tolerance_rad <= 0.0:
            raise ValueError(
                "overlap_fraction must lie in [0, 1) and tilt_tolerance_rad be above 0; got "
                f"{self.overlap_fraction}, {self.tilt_tolerance_rad}"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class FloorCheckConfig:
    """When the robot looks at unseen floor on the straight path to its target."""

    min_saving_s: float = 2.0
    """Seconds that the straight path must save beyond those of the check; more checks less."""
    tilt_rad: float = -0.7
    """Tilt of the check; less shows closer floor and less distant floor."""
    hold_s: float = 0.6
    """Seconds that the camera looks at the floor; more takes more images of it."""
    facing_rad: float = 0.1
    """Error of the heading up to which the robot faces the floor; more turns less."""
    tilt_tolerance_rad: float = 0.06
    """Error of the tilt up to which it is reached; more waits less."""
    same_place_m: float = 0.4
    """Distance from an earlier check within which the same floor is not checked again; more checks
    less often."""
    seen_fraction: float = 0.4
    """Angle to either side of an earlier check that it has seen, as a fraction of the field of
    view; more checks less often."""

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
    """Off in the ablation."""
    low_rad: float = -0.42
    """Lowest tilt of the sweep; less shows floor closer to the robot and less distant floor."""
    high_rad: float = -0.18
    """Highest tilt of the sweep; more shows higher objects and less near floor."""
    period_s: float = 4.0
    """Seconds per period; more blurs images less and shows each height less often."""
    level_rad: float = -0.3
    """Tilt without a sweep; less shows more floor."""
    arriving_m: float = 0.4
    """Distance to the viewpoint within which the camera takes the viewpoint's orientation; more
    sweeps less."""
    driving_m_s: float = 0.05
    """Speed above which the camera sweeps; more sweeps less."""

    def __post_init__(self) -> None:
        """Reject a sweep without a period."""
        if self.period_s <= 0.0:
            raise ValueError(f"period_s must be above 0; got {self.period_s}")


@dataclass(frozen=True, slots=True, kw_only=True)
class StepCloserConfig:
    """The last step towards a find that a detector has recognised."""

    share: float = 0.25
    """Share of what the last images recognise that must lie within the metre of the task; more goes
    closer more often."""
    near_m: float = 0.8
    """Distance within which that share lies at the end of the step, by more than the robot's
    tolerances less than a metre; less ends nearer to the object and takes longer."""
    least_gain_m: float = 0.05
    """How much nearer the way has to lead; more leaves out small steps."""
    detour_m: float = 0.5
    """How much longer than straight the way may be; more goes round obstacles."""
    most_s: float = 6.0
    """Seconds after which the search ends where the robot is; more waits longer where something
    blocks the way."""

    def __post_init__(self) -> None:
        """Reject distances without meaning."""
        if not 0.0 <= self.share <= 1.0:
            raise ValueError(f"share must lie in 0 to 1; got {self.share}")
        if min(self.near_m, self.least_gain_m, self.most_s) <= 0.0 or self.detour_m < 0.0:
            raise ValueError(
                "near_m, least_gain_m and most_s must be above 0 and detour_m not negative; got "
                f"{self.near_m}, {self.least_gain_m}, {self.most_s}, {self.detour_m}"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class ExhaustionConfig:
    """When a search ends without a find."""

    empty_steps: int = 15
    """Steps without a viewpoint of enough gain after which the search ends as exhausted; more waits
    longer for new viewpoints."""
    idle_gain: float = 0.3
    """Gain per second of the best path below which a step is idle. Exploring has 1 to 15; more
    returns to doubted finds earlier, 0 only after everything was explored."""
    idle_steps: int = 15
    """Idle steps in a row after which the robot returns to a doubted find; more explores longer
    before that."""

    def __post_init__(self) -> None:
        """Reject counts without meaning."""
        if not self.idle_gain >= 0.0 or self.idle_steps < 1 or self.empty_steps < 1:
            raise ValueError(
                "idle_gain must not be negative, idle_steps and empty_steps at least 1; got "
                f"{self.idle_gain}, {self.idle_steps}, {self.empty_steps}"
            )

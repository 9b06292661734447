"""The state of a mission after a step, frozen so that threads can share it."""

from dataclasses import dataclass
from enum import StrEnum
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from ippon.command import Command
from ippon.control.walking_guide import WalkingDirections
from ippon.geometry import Float64Array
from ippon.guidance.language.goals.goal import AttributeKind
from ippon.mission.goal import Goal
from ippon.planning.plan import Plan


class MissionState(StrEnum):
    """What the robot is doing; the values are the words of pages, logs and reports."""

    STARTING = "starting"
    LOOKING_AROUND = "looking_around"
    SEARCHING = "searching"
    APPROACHING = "approaching"
    FOUND = "found"
    EXHAUSTED = "exhausted"
    PAUSED = "paused"
    MANUAL = "manual"
    STOPPED = "stopped"


OVER: Final = (MissionState.FOUND, MissionState.EXHAUSTED)
"""The search has ended."""


@dataclass(frozen=True, slots=True, kw_only=True)
class JudgedAttribute:
    """Something that was said of the object, and whether a find has it."""

    value: str
    """In the operator's words: "red"."""
    kind: AttributeKind
    negated: bool = False
    verdict: Literal["right", "wrong", "unchecked"] = "unchecked"
    by: str = ""
    """What judged it: "images", "its usual size", or the name of a model; empty if unchecked."""
    seen: str = ""
    """What was seen in its place: "white"; empty if nothing was recognised."""

    @property
    def text(self) -> str:
        """In words: "not red"."""
        return f"not {self.value}" if self.negated else self.value

    @property
    def denied_text(self) -> str:
        """The opposite in words."""
        return self.value if self.negated else f"not {self.value}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Find:
    """A cluster of voxels that is probably the object."""

    position_world: tuple[float, float, float]
    """Centroid, metres."""
    size_m: tuple[float, float, float]
    """Extent of the axis-aligned box around the voxels."""
    probability: float
    """Mean p(v in O) of its voxels."""
    voxels: int
    box_px: tuple[int, int, int, int] | None
    """(u0, v0, u1, v1) in the colour image of the step, None when out of view."""
    out_of_reach_m: float | None = None
    """Set for a find out of reach: metres over the floor from the nearest place where the robot can
    stand and see it; None otherwise."""
    attributes: tuple[JudgedAttribute, ...] = ()
    """What was said of the object, judged on this find."""
    number: int = 0
    """Number among the finds of its search, from 1, also of those that were rejected; 0 for a
    candidate."""
    confirmed: bool = False
    """The operator confirmed it."""
    stamp_ns: int = 0
    """Robot time of the image with which it was announced, nanoseconds; 0 for a candidate, and for
    a find of an earlier run."""


class GoalState(StrEnum):
    """State of one goal of a tour; the values are the words of pages, logs and reports."""

    MISSING = "missing"
    FOUND = "found"
    CONFIRMED = "confirmed"
    CANCELLED = "cancelled"
    NOT_FOUND = "not_found"


@dataclass(frozen=True, slots=True, kw_only=True)
class GoalStatus:
    """One goal of a tour."""

    goal: Goal
    state: GoalState
    find: Find | None
    """The find that was announced; None for none."""
    counted: tuple[Find, ...] = ()
    """Those before it, where several are wanted."""
    rejected: tuple[Find, ...] = ()
    """Those that the operator rejected."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionEvent:
    """An event of a step, for the operator."""

    kind: str
    text: str
    find: int | None = None
    """Number of the find that was confirmed or rejected."""
    goal_id: int | None = None
    """Number of the goal whose search ended; None for another event."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Snapshot:
    """The mission after a step."""

    stamp_ns: int
    state: MissionState
    why: str
    """Where the robot goes and why, in one line."""
    goal: Goal | None
    plan: Plan | None
    find: Find | None
    """The find that ended the search, in state `found`."""
    candidates: tuple[Find, ...]
    """Clusters that look like the object, largest first."""
    far_evidence: NDArray[np.float32]
    """(M, 3) floor cells with far evidence of the object: world x and y in metres, and the
    log-likelihood ratio in nats."""
    far_evidence_cell_m: float
    T_world_base: Float64Array
    path_length_m: float
    """Path length since the goal was set."""
    elapsed_s: float
    """Robot time since the goal was set."""
    best_ooi: float
    explored_m2: float
    events: tuple[MissionEvent, ...]
    counted: tuple[Find, ...] = ()
    """Finds before the present one, where several are wanted."""
    rejected: tuple[Find, ...] = ()
    """Finds that the operator rejected."""
    tour: tuple[GoalStatus, ...] = ()
    """The goals of a tour with their states; empty for one goal. `goal`, `state`, `find`, way and
    time are those of the leading one."""
    walk: WalkingDirections | None = None
    """Where the person who carries the camera is to go and look; None for a robot, and while there
    is nowhere to go."""

    @property
    def outcome(self) -> Literal["found", "out_of_reach", "exhausted"] | None:
        """How the search ended; None while it runs."""
        if self.state is MissionState.EXHAUSTED:
            return "exhausted"
        if self.state is not MissionState.FOUND:
            return None
        near = self.find is None or self.find.out_of_reach_m is None
        return "found" if near else "out_of_reach"


@dataclass(frozen=True, slots=True, kw_only=True)
class StepResult:
    """The answer to one frame."""

    command: Command
    snapshot: Snapshot

"""What the navigator publishes beside map and commands: status, levels, events, labels."""

from typing import Literal

from msgspec import Struct

from app.messages.driving import DriveStatus
from app.messages.lease import LeaseStatus
from ippon.guidance.levels import LevelName

MissionState = Literal[
    "starting",
    "looking_around",
    "searching",
    "approaching",
    "found",
    "exhausted",
    "paused",
    "manual",
    "stopped",
    "lost",
]


class _Message(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A message that refuses unknown fields, so that a misspelt field is an error."""


class LevelRow(_Message, frozen=True):
    """Level of one common object."""

    label: str
    level: LevelName
    reason: str


class LevelTable(_Message, frozen=True):
    """Levels for the current goal, published on change and kept for late joiners."""

    goal_id: int
    object: str
    context: str
    provider: str
    elapsed_ms: float
    rows: list[LevelRow]
    notes: list[str] = []
    asking: str = ""
    """Language model whose answer is still to come; until then the provider's levels count."""
    from_cache: bool = False
    """The answer was given to the same question before, and kept on disk."""
    prompt: str = ""
    """The exact question, empty where no model was asked."""
    reply: str = ""
    """The exact answer."""


GoalOutcome = Literal["queued", "active", "found", "out_of_reach", "exhausted", "cancelled"]
"""`out_of_reach`: it was found, and no way leads close to it; the state is `found`."""


class GoalStatus(_Message, frozen=True):
    """A goal and how far it is."""

    goal_id: int
    object: str
    context: str = ""
    outcome: GoalOutcome = "queued"


class FindReport(_Message, frozen=True):
    """Where the object was found."""

    goal_id: int
    object: str
    position_world: tuple[float, float, float]
    size_m: tuple[float, float, float]
    probability: float
    voxels: int
    box_px: tuple[int, int, int, int] | None = None
    """(u0, v0, u1, v1) of the object in the colour image of that moment."""
    out_of_reach_m: float | None = None
    """Metres over the floor to it from the nearest place where the robot can stand and see it, in
    a find that no way leads close to."""


class StreamStatus(_Message, frozen=True):
    """Health of one incoming stream."""

    name: str
    age_s: float | None
    """Time since the last message; None before the first."""
    rate_hz: float
    dropped: int = 0
    rejected: int = 0


class Timings(_Message, frozen=True):
    """Medians over the last frames, milliseconds."""

    step_ms: float = 0.0
    map_ms: float = 0.0
    plan_ms: float = 0.0
    publish_ms: float = 0.0
    frame_age_ms: float = 0.0
    """From the arrival of a frame's colour image to the command that answers the frame."""
    first_motion_s: float | None = None
    """From the current goal's query, or the robot's first frame where that came later, to the first
    command that moves the base or the camera."""


class Status(_Message, frozen=True):
    """Published with every step and at least twice a second."""

    robot: str
    version: str
    stamp_ns: int
    """Clock of the robot (the latest frame's)."""
    wall_ns: int
    """Clock of the navigator's machine, nanoseconds since 1970."""
    state: MissionState
    why: str
    """One line for the operator."""
    goal: GoalStatus | None
    queue: list[GoalStatus]
    history: list[GoalStatus]
    find: FindReport | None
    streams: list[StreamStatus]
    timings: Timings
    frames: int
    elapsed_s: float
    """Robot time since the current goal was set."""
    path_length_m: float
    """Driven since the current goal was set."""
    best_ooi: float
    """Highest p(v in O) in the map."""
    explored_m2: float
    surface_voxels: int
    voxel_size_m: float
    map_revision: int
    notes: list[str] = []
    drive: DriveStatus = DriveStatus()
    lease: LeaseStatus = LeaseStatus()


class Event(_Message, frozen=True):
    """Something an operator or a reviewer wants to know of, once."""

    stamp_ns: int
    kind: Literal[
        "goal_set",
        "state",
        "found",
        "rejected",
        "doubted",
        "opinion",
        "reconsidered",
        "confirmed",
        "exhausted",
        "cancelled",
        "contact",
        "stream_lost",
        "stream_back",
        "bad_message",
        "stopped",
        "resumed",
        "level_changed",
        "guidance",
        "vocabulary",
        "drive",
        "painted",
        "lease",
        "map_full",
        "error",
    ]
    text: str
    goal_id: int | None = None


class FarEvidenceCells(_Message, frozen=True):
    """Cells with evidence of the object from beyond the map's range; kept for late joiners."""

    stamp_ns: int
    cell_m: float
    cells: list[tuple[float, float, float]]
    """World x and y of a cell's centre in metres; log-likelihood ratio of the object in nat."""
    covered: list[tuple[int, int, int]] = []
    """Present in recordings of earlier versions; ignored."""


class SegmentationLabels(_Message, frozen=True):
    """What the segmentation is asked to tell apart; published on change, kept for late joiners."""

    labels: list[str]
    ooi: str | None

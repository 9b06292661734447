"""Messages published by the navigator: status, levels, events, labels to segment."""

from typing import Annotated, Final, Literal

from msgspec import Meta, Struct

from app.messages.driving import DriveStatus, WalkStatus
from app.messages.lease import LeaseStatus
from ippon.guidance.levels import LevelName
from ippon.vocabulary import in_words

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
    "ended",
]


_RESTART_NS: Final = 1_000_000_000
MOST_COUNTED: Final = 99
Count = Literal["all"] | Annotated[int, Meta(ge=1, le=MOST_COUNTED)]
"""How many of an object; "all": everything reachable is seen before the search ends."""


class _Published(Struct, frozen=True, kw_only=True):
    """What everyone may read: fields that a later version adds are ignored."""


class LevelRow(_Published, frozen=True):
    """Level of one common object."""

    label: str
    level: LevelName
    reason: str


class LevelTable(_Published, frozen=True):
    """Levels of the current goal, published on change and stored for late joiners."""

    goal_id: int
    object: str
    context: str
    provider: str
    elapsed_ms: float
    rows: list[LevelRow]
    notes: list[str] = []
    asking: str = ""
    """Language model whose answer is pending; until then the provider's levels apply."""
    from_cache: bool = False
    """The answer to the same question was read from disk."""
    prompt: str = ""
    """The exact question, empty if no model was asked."""
    reply: str = ""
    """The exact answer."""


GoalOutcome = Literal["queued", "active", "found", "out_of_reach", "exhausted", "cancelled"]
"""`out_of_reach`: found, but no path leads close to it; the state is `found`."""


class CountedFind(_Published, frozen=True):
    """One of several that are wanted, while the search goes on for the others."""

    number: int
    """Its number among the finds of the goal, from 1, also of those that were rejected."""
    position_world: tuple[float, float, float]
    """Metres."""
    confirmed: bool = False
    """The operator confirmed it."""
    room: str = ""
    """Name or type of the room that it is in; empty where that is not clear."""


class GoalStatus(_Published, frozen=True):
    """A goal and its outcome."""

    goal_id: int
    object: str
    context: str = ""
    outcome: GoalOutcome = "queued"
    position_world: tuple[float, float, float] | None = None
    """Where it was found, metres; None for no find."""
    find: int | None = None
    """Number of that find; None for no find, and in recordings of earlier versions."""
    display: str = ""
    """As the requester named it; empty if the object says it."""
    tour: int | None = None
    """Number of the first goal of its tour; None if it is searched for by itself."""
    confirmed: bool = False
    """The operator confirmed the find."""
    rejected: int = 0
    """Number of its finds that the operator rejected."""
    took_s: float | None = None
    """Robot time that its search took; None while it goes on, or if it never began."""
    count: Count = 1
    """How many are wanted."""
    counted: list[CountedFind] = []
    """Those that were found before the present find and not rejected."""
    room: str = ""
    """Name or type of the room that it was found in; empty where that is not clear."""


class FindAttribute(_Published, frozen=True):
    """Something that was said of the object, and whether the find has it."""

    value: str
    """In the operator's words: "red", "not broken"."""
    kind: str
    """colour, size, owner, …"""
    verdict: Literal["right", "wrong", "unchecked"]
    by: str = ""
    """What judged it: "images", "its usual size" or the name of a model; empty if unchecked."""
    seen: str = ""
    """What was seen: "white"; empty if nothing was recognised."""


class FindReport(_Published, frozen=True):
    """Where the object was found."""

    goal_id: int
    object: str
    position_world: tuple[float, float, float]
    size_m: tuple[float, float, float]
    probability: float
    voxels: int
    box_px: tuple[int, int, int, int] | None = None
    """(u0, v0, u1, v1) of the object in the colour image at the time of the find."""
    stamp_ns: int | None = None
    """Robot time of that image, nanoseconds; 0 for a find of an earlier run, None in recordings of
    earlier versions."""
    out_of_reach_m: float | None = None
    """Horizontal distance in metres to the nearest reachable position that sees it, for a find that
    no path leads close to."""
    attributes: list[FindAttribute] = []
    """What was said of the object, judged on the find."""
    number: int = 0
    """Number among the finds of the goal, from 1, also of those that were rejected."""
    perhaps: bool = False
    """It was doubted before, and nothing else looks more like the object."""


class StreamStatus(_Published, frozen=True):
    """Health of one incoming stream."""

    name: str
    age_s: float | None
    """Time since the last message; None before the first."""
    rate_hz: float
    dropped: int = 0
    rejected: int = 0


class Timings(_Published, frozen=True):
    """Medians over the last frames, milliseconds."""

    step_ms: float = 0.0
    map_ms: float = 0.0
    plan_ms: float = 0.0
    publish_ms: float = 0.0
    frame_age_ms: float = 0.0
    """Time from the arrival of a frame's colour image to the command for the frame."""
    first_motion_s: float | None = None
    """Time from the query of the current goal, or the robot's first frame if later, to the first
    command that moves base or camera."""


class Status(_Published, frozen=True):
    """State of the navigator, published with every step and at least twice per second."""

    robot: str
    version: str
    stamp_ns: int
    """Robot time of the latest frame."""
    wall_ns: int
    """Clock of the navigator's machine, nanoseconds since 1970."""
    state: MissionState
    why: str
    """One line for the operator."""
    goal: GoalStatus | None
    """The goal that is searched for; of a tour the one that the plan is for."""
    queue: list[GoalStatus]
    history: list[GoalStatus]
    find: FindReport | None
    """The find that ended the search; in a tour the one announced last that is neither confirmed
    nor rejected."""
    streams: list[StreamStatus]
    timings: Timings
    frames: int
    elapsed_s: float
    """Robot time since the current goal was set."""
    path_length_m: float
    """Path length since the current goal was set."""
    best_ooi: float
    """Highest p(v in O) in the map."""
    explored_m2: float
    surface_voxels: int
    voxel_size_m: float
    map_revision: int
    notes: list[str] = []
    drive: DriveStatus = DriveStatus()
    lease: LeaseStatus = LeaseStatus()
    tour: list[GoalStatus] = []
    """All goals of the present tour; empty for one goal."""
    walk: WalkStatus | None = None
    """Directions for the person who carries the camera; None for a robot, and while there is
    nowhere to go."""
    localization: str = ""
    """Why the robot's pose in the map cannot be trusted; empty if it can."""


def name_of(goal: GoalStatus) -> str:
    """Return the object as the requester named it."""
    return goal.display or in_words(goal.object)


def goal_of(status: Status, goal_id: int) -> GoalStatus | None:
    """Return an active, waiting or finished goal by its number; None if it is not listed."""
    known = [status.goal, *status.tour, *status.queue, *status.history]
    return next((goal for goal in known if goal is not None and goal.goal_id == goal_id), None)


def awaited_find(status: Status) -> FindReport | None:
    """Return the find that waits for a verdict; None without one, and once it is confirmed."""
    find = status.find
    goal = None if find is None else goal_of(status, find.goal_id)
    return None if goal is not None and goal.confirmed else find


def is_restart(before: Status, now: Status) -> bool:
    """Return whether the map of a navigator began anew between two of its statuses."""
    return (
        now.map_revision < before.map_revision
        or now.voxel_size_m != before.voxel_size_m
        or now.stamp_ns < before.stamp_ns - _RESTART_NS
        or now.robot != before.robot
    )


def is_next_run(before: Status, now: Status) -> bool:
    """Return whether a navigator was started again between two of its statuses.

    It may go on with the map of its last run; its goals are numbered anew in any case.
    """
    return now.frames < before.frames or now.robot != before.robot


class Event(_Published, frozen=True):
    """An event for operator and review."""

    stamp_ns: int
    kind: Literal[
        "goal_set",
        "state",
        "found",
        "counted",
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
        "memory",
        "error",
    ]
    text: str
    goal_id: int | None = None
    find: int | None = None
    """Number of the find that was confirmed or rejected."""


class FarEvidenceCells(_Published, frozen=True):
    """Cells with evidence of the object beyond the map's range; stored for late joiners."""

    stamp_ns: int
    cell_m: float
    cells: list[tuple[float, float, float]]
    """World x and y of a cell's centre in metres; log-likelihood ratio of the object in nat."""
    covered: list[tuple[int, int, int]] = []
    """Ignored; present in recordings of earlier versions."""


class SegmentationLabels(_Published, frozen=True):
    """Labels to segment; published on change and stored for late joiners."""

    labels: list[str]
    ooi: str | None
    also: list[str] = []
    """Further objects of interest that are none of the labels: in a heatmap they are labels after
    those."""

"""The control plane: JSON messages that any zenoh client can send and read.

Each struct is one message. A request gets a reply, a result or an `ErrorReply`, always.
"""

from typing import Annotated, Literal, TypeVar

import msgspec
from msgspec import Meta, Struct

from app.messages.driving import DriveStatus
from app.messages.lease import LeaseStatus
from ippon.guidance.levels import LevelName

M = TypeVar("M", bound=Struct)

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

ObjectText = Annotated[str, Meta(min_length=1, max_length=80)]
ContextText = Annotated[str, Meta(max_length=2000)]
ScenarioText = Annotated[str, Meta(max_length=200)]


class _Message(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Messages refuse fields that they do not know: a misspelt field is an error."""


class SearchRequest(_Message, frozen=True):
    """Look for an object: key `search`."""

    object: ObjectText
    context: ContextText = ""
    scenario: ScenarioText = "an apartment with different rooms"
    requester: Annotated[str, Meta(max_length=80)] = ""


class SearchAccepted(_Message, frozen=True):
    """Reply to `SearchRequest`: the goal was taken over, and at which place of the queue."""

    goal_id: int
    object: str
    """Canonical label that is searched for."""
    position: int
    """0: searched for now; else goals that come first."""
    notes: list[str] = []


class ControlRequest(_Message, frozen=True):
    """Change what the navigator does: key `control`."""

    action: Literal["stop", "resume", "pause", "cancel"]
    """`stop` latches until `resume`; `cancel` ends the current goal."""
    requester: Annotated[str, Meta(max_length=80)] = ""


class ControlReply(_Message, frozen=True):
    """Reply to `ControlRequest`: the state that the navigator is in now."""

    state: MissionState
    detail: str = ""
    """What else there is to say, for the operator."""


class GuidanceRequest(_Message, frozen=True):
    """Change the level of one label for the current goal: key `guidance`."""

    label: str
    level: LevelName


class SentenceRequest(_Message, frozen=True):
    """Have one sentence read, without searching for anything yet: key `guidance/sentence`."""

    sentence: Annotated[str, Meta(min_length=1, max_length=2100)]


class SentenceReading(_Message, frozen=True):
    """Reply to `SentenceRequest`: what would be searched for."""

    object: str
    """Empty where none was found."""
    context: str
    doubtful: bool
    """Show it for correction before searching."""
    provider: str
    """A language model, or "rules"."""
    elapsed_ms: float
    note: str = ""
    """Why rules read it in the model's place."""


class VocabularyRequest(_Message, frozen=True):
    """Tell one more common object apart from now on: key `guidance/vocabulary`."""

    label: Annotated[str, Meta(min_length=1, max_length=40)]
    requester: Annotated[str, Meta(max_length=80)] = ""


class FeedbackRequest(_Message, frozen=True):
    """The operator's word on a find: key `feedback`."""

    verdict: Literal["confirm", "reject"]


class QueueRequest(_Message, frozen=True):
    """Change the order of the goals that wait: key `queue`."""

    goal_id: int
    action: Literal["first", "remove"]


class PreviewRequest(_Message, frozen=True):
    """Ask what would be chosen next with another context or level: key `preview`.

    Nothing changes by it.
    """

    context: ContextText | None = None
    levels: dict[str, LevelName] = {}


class PreviewReply(_Message, frozen=True):
    """Reply to `PreviewRequest`."""

    now: str
    """What is chosen as things are."""
    then: str
    """What would be chosen."""
    same: bool
    position_world: tuple[float, float, float] | None
    """Where that is; None when nothing would be."""
    changed: list[str] = []
    """Labels whose level differs, with both levels."""


class InspectRequest(_Message, frozen=True):
    """Ask what the map knows of a voxel: key `inspect`. Everybody may."""

    point_world: tuple[float, float, float]


class LabelShare(_Message, frozen=True):
    """One common object and its probability in a voxel."""

    label: str
    probability: float


class InspectReply(_Message, frozen=True):
    """Reply to `InspectRequest`."""

    labels: list[LabelShare]
    """The most probable first."""
    ooi: float | None
    level: LevelName | None
    room: str = ""
    """Type of the room that the voxel is in; empty where it is not clear."""


class Accepted(_Message, frozen=True):
    """Reply to a request that has nothing else to say."""

    detail: str = ""


class ErrorReply(_Message, frozen=True):
    """Reply to a request that cannot be met."""

    error: str
    """What came, what was expected, what would work."""


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


def decode(payload: bytes, kind: type[M]) -> M:
    """Read one message.

    Raises:
        msgspec.DecodeError: Not JSON, or not this message; the text says where and why.
    """
    return msgspec.json.decode(payload, type=kind)


def encode(message: Struct) -> bytes:
    """Write one message as JSON."""
    return msgspec.json.encode(message)

"""Requests to the navigator and their replies: JSON messages that any zenoh client can send.

Each struct is one message. Every request gets its reply or an `ErrorReply`. Requests that have
gained fields omit their defaults, so that navigators of earlier versions read them.
"""

from typing import Annotated, Literal, TypeVar

import msgspec
from msgspec import Meta, Struct

from app.messages.status import Count, MissionState
from ippon.guidance.language.goals.goal import Attribute, Goal
from ippon.guidance.levels import LevelName

M = TypeVar("M", bound=Struct)
T = TypeVar("T")

ObjectText = Annotated[str, Meta(min_length=1, max_length=80)]
ContextText = Annotated[str, Meta(max_length=2000)]
MAX_PICTURE_BYTES = 600_000
"""A JPEG image of 1024 pixels a side at a high quality."""
ScenarioText = Annotated[str, Meta(max_length=200)]


ShortText = Annotated[str, Meta(max_length=300)]
Obstacle = Literal[
    "", "starting", "searching", "found", "held", "manual", "stopped", "paused", "lost"
]
"""Why a robot would not take a search; empty where it would.

`starting` and `lost`: no data of the robot, or its pose is not known; `found`: its last find has
just been announced; `held`: somebody else has control; `manual`: a person drives it.
"""
Ground = Literal["room", "thing", "area", "unknown"]
"""What a robot knows of the place of a search.

`room`: the room that was said is in its map; `thing`: no room was said, and it remembers where the
object is; `area`: no room was said, and it has explored some floor; `unknown`: its map does not
have the room that was said, or is empty.
"""


class _Message(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A message that refuses unknown fields, so that a misspelt field is an error."""


class _Published(Struct, frozen=True, kw_only=True):
    """What everyone may read: fields that a later version adds are ignored."""


class SearchRequest(_Message, frozen=True, omit_defaults=True):
    """Search for an object: key `search`."""

    object: ObjectText
    context: ContextText = ""
    scenario: ScenarioText = "an apartment with different rooms"
    requester: Annotated[str, Meta(max_length=80)] = ""
    joins: int | None = None
    """Number of a goal that is searched for in one tour with this one: it waits, or its search has
    just begun. Where that is not possible, this goal waits, and a note says why."""
    attributes: list[Attribute] = []
    """What tells the object from others of its name; empty for what the object's name says."""
    count: Count = 1
    """How many are searched for, "all" until everything reachable was seen; 1 for what the object's
    name says."""
    other: bool = False
    """Another one than those of its kind that earlier searches of this run have found."""
    if_free: bool = False
    """Refused unless the search can start at once: nothing else is searched for or waits, and the
    robot is neither stopped, paused, driven by a person nor lost."""


class SearchAccepted(_Message, frozen=True):
    """Reply to `SearchRequest`: the goal and its place in the queue."""

    goal_id: int
    object: str
    """Canonical label of the object of interest."""
    position: int
    """Number of goals before it; 0 if its search starts now."""
    notes: list[str] = []
    joined: int | None = None
    """Number of the first goal of the tour that it belongs to; None if it is searched for by
    itself."""


class ControlRequest(_Message, frozen=True, omit_defaults=True):
    """Stop, resume, pause or cancel: key `control`."""

    action: Literal["stop", "resume", "pause", "cancel"]
    """`stop` latches until `resume`; `cancel` ends the current goal, or all goals of a tour."""
    requester: Annotated[str, Meta(max_length=80)] = ""
    goal_id: int | None = None
    """The only goal of a tour that `cancel` ends."""


def is_stop(request: Struct) -> bool:
    """Return whether a request is a Stop, which is accepted from everyone and goes before all."""
    return isinstance(request, ControlRequest) and request.action == "stop"


class ControlReply(_Message, frozen=True):
    """Reply to `ControlRequest`: the present state of the navigator."""

    state: MissionState
    detail: str = ""
    """Further text for the operator."""


class GuidanceRequest(_Message, frozen=True):
    """Change the level of one label for the current goal: key `guidance`."""

    label: str
    level: LevelName


class SentenceRequest(_Message, frozen=True):
    """Read goals from a sentence without searching: key `guidance/sentence`."""

    sentence: Annotated[str, Meta(min_length=1, max_length=2100)]


class PictureRequest(_Message, frozen=True):
    """Name the object that a picture shows without searching: key `guidance/picture`.

    The reply is a `SentenceReading`.
    """

    jpeg: Annotated[bytes, Meta(min_length=4, max_length=MAX_PICTURE_BYTES)]
    """The picture; base64 in JSON."""


class SentenceReading(_Message, frozen=True):
    """Reply to `SentenceRequest` and `PictureRequest`: what would be searched for."""

    goals: list[Goal]
    """In the order in which they were said; empty if no object was found."""
    doubtful: bool
    """The reading is uncertain and should be shown for correction before a search."""
    because: str
    """Why it is doubtful, and what would help."""
    unused: list[str]
    """Words that were not understood."""
    notes: list[str]
    """What was understood and the search does not use yet."""
    language: str
    """Name of the language if it is not English and rules read it."""
    provider: str
    """A language model, or "rules"."""
    elapsed_ms: float
    note: str = ""
    """Why rules read the sentence instead of the model."""


class VocabularyRequest(_Message, frozen=True):
    """Add a common object to the vocabulary: key `guidance/vocabulary`."""

    label: Annotated[str, Meta(min_length=1, max_length=40)]
    requester: Annotated[str, Meta(max_length=80)] = ""


class FeedbackRequest(_Message, frozen=True, omit_defaults=True):
    """Confirm or reject a find: key `feedback`."""

    verdict: Literal["confirm", "reject"]
    goal_id: int | None = None
    """Number of the goal; None for the find that was announced last."""
    find: int | None = None
    """Number of one of its finds, also of one that was counted; None for the find that ended the
    search."""


class QueueRequest(_Message, frozen=True, omit_defaults=True):
    """Change the queue of goals: key `queue`. Goals are named by number, never by place."""

    goal_id: int
    """The waiting goal; for `repeat` one whose search has ended."""
    action: Literal["first", "before", "remove", "edit", "repeat"]
    """Move it, with its tour, to the front or before another waiting goal; cancel it; replace its
    object and context; search once more for an ended one, after those that wait."""
    before: int | None = None
    """Number of the goal that it is moved before."""
    object: Annotated[str, Meta(max_length=80)] = ""
    """New object; empty keeps it."""
    context: ContextText | None = None
    """New context; None keeps it."""


class SavedSearchRequest(_Message, frozen=True, omit_defaults=True):
    """Save a search, run a saved one, or delete it: key `searches`."""

    action: Literal["save", "run", "delete"]
    saved_id: int | None = None
    """Number of the saved search to run or delete."""
    object: Annotated[str, Meta(max_length=80)] = ""
    """What is saved."""
    context: ContextText = ""
    scenario: ScenarioText = "an apartment with different rooms"
    goal_id: int | None = None
    """Goal whose attributes and count are saved, too."""


class SavedSearch(_Published, frozen=True):
    """A search that is kept to be run again."""

    saved_id: int
    object: ObjectText
    """As it was typed."""
    context: ContextText = ""
    scenario: ScenarioText = "an apartment with different rooms"
    attributes: list[Attribute] = []
    """As in `SearchRequest`."""
    count: Count = 1
    other: bool = False


class SavedSearches(_Published, frozen=True):
    """All saved searches: key `searches/saved`, published on change and stored for late joiners."""

    searches: list[SavedSearch]
    next_id: int = 1
    """Number of the next one; numbers are not used twice."""
    note: str = ""
    """Why they are not kept on disk."""


class PreviewRequest(_Message, frozen=True):
    """Ask for the next target under another context or other levels: key `preview`.

    The search does not change.
    """

    context: ContextText | None = None
    levels: dict[str, LevelName] = {}


class PreviewReply(_Message, frozen=True):
    """Reply to `PreviewRequest`."""

    now: str
    """Present choice and its reason."""
    then: str
    """Choice under the other levels, and its reason."""
    same: bool
    position_world: tuple[float, float, float] | None
    """Position of that choice; None without one."""
    changed: list[str] = []
    """Labels whose level differs, with both levels."""


class InspectRequest(_Message, frozen=True):
    """Ask for the map's content of a voxel: key `inspect`. Accepted from everyone."""

    point_world: tuple[float, float, float]


class LabelShare(_Message, frozen=True):
    """One common object and its probability in a voxel."""

    label: str
    probability: float


class InspectReply(_Message, frozen=True):
    """Reply to `InspectRequest`."""

    labels: list[LabelShare]
    """Labels, the most probable first."""
    ooi: float | None
    level: LevelName | None
    room: str = ""
    """Type of the voxel's room; empty if unclear."""


class BidRequest(_Message, frozen=True):
    """Ask whether a robot would take a search: key `bid`. It does not move, and nothing is queued.

    With a `Credential` attached, a robot that the requester has control of counts as free.
    """

    search: SearchRequest


class Bid(Struct, frozen=True, kw_only=True):
    """Reply to `BidRequest`. Fields of later versions are ignored."""

    obstacle: Obstacle
    detail: ShortText = ""
    """What is searched for, who has control, or what is missing."""
    ground: Ground
    place: ShortText = ""
    """The room by the name that people have given it, else by its type; of a `thing` what it is."""
    room: ShortText = ""
    """Of a `thing`: the room that it is in; empty where that is not clear."""
    way_m: Annotated[float, Meta(ge=0.0, le=1e6)] | None = None
    """Length of the way from the robot to the place over its own map; 0 for `area`, None where it
    knows no way."""
    explored_m2: Annotated[float, Meta(ge=0.0)] = 0.0
    """Floor that it has explored."""

    @property
    def is_free(self) -> bool:
        """It would take the search."""
        return self.obstacle == ""


class Accepted(_Message, frozen=True):
    """Reply to an accepted request without a result."""

    detail: str = ""


class ErrorReply(_Message, frozen=True):
    """Reply to a refused or failed request."""

    error: str
    """What was received, what was expected, and what would work."""


def decode(payload: bytes, kind: type[T]) -> T:
    """Read one message, or a file of the same form.

    Raises:
        msgspec.DecodeError: Not JSON, or not this message; the text says where and why.
    """
    try:
        return msgspec.json.decode(payload, type=kind)
    except (UnicodeDecodeError, RecursionError) as error:
        # msgspec raises these for bytes that are no text, and for values nested too deeply.
        raise msgspec.DecodeError(f"not JSON: {error}") from error


def encode(message: Struct) -> bytes:
    """Write one message as JSON."""
    return msgspec.json.encode(message)

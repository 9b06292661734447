"""The control plane: JSON messages that any zenoh client can send and read.

Each struct is one message. A request gets a reply, a result or an `ErrorReply`, always.
"""

from typing import Annotated, Literal, TypeVar

import msgspec
from msgspec import Meta, Struct

from app.messages.status import MissionState
from ippon.guidance.levels import LevelName

M = TypeVar("M", bound=Struct)

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


def decode(payload: bytes, kind: type[M]) -> M:
    """Read one message.

    Raises:
        msgspec.DecodeError: Not JSON, or not this message; the text says where and why.
    """
    return msgspec.json.decode(payload, type=kind)


def encode(message: Struct) -> bytes:
    """Write one message as JSON."""
    return msgspec.json.encode(message)

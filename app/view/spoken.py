"""Messages and recordings with the navigator's texts in the language of the console."""

from typing import Any, Final, TypeVar

import msgspec

from app.messages.control import (
    Accepted,
    ControlReply,
    PreviewReply,
    SavedSearches,
    SearchAccepted,
    SentenceReading,
)
from app.messages.driving import DriveStatus
from app.messages.lease import LeaseReply
from app.messages.memory import MemoryReply, RoomsReply
from app.messages.recording import RecordingStatus
from app.messages.status import (
    Event,
    FindAttribute,
    FindReport,
    LevelRow,
    LevelTable,
    Status,
    StreamStatus,
)
from app.recording.catalogue import SessionEntry
from app.view.model.seek_history import SeekHistory
from app.view.words import Words

T = TypeVar("T")

TEXTS: Final[dict[type[msgspec.Struct], tuple[str, ...]]] = {
    Status: ("why", "localization", "notes", "streams", "drive", "find"),
    StreamStatus: ("name",),
    DriveStatus: ("intervention",),
    FindReport: ("attributes",),
    FindAttribute: ("by",),
    Event: ("text",),
    LevelTable: ("provider", "rows", "notes"),
    LevelRow: ("reason",),
    RecordingStatus: ("text", "warning"),
    SavedSearches: ("note",),
    SeekHistory: ("events",),
    SessionEntry: ("problem",),
    Accepted: ("detail",),
    ControlReply: ("detail",),
    SearchAccepted: ("notes",),
    SentenceReading: ("because", "notes", "provider", "note"),
    PreviewReply: ("now", "then", "changed"),
    LeaseReply: ("detail",),
    MemoryReply: ("note",),
    RoomsReply: ("note",),
}
"""Fields of the messages that hold texts for people, or messages that do."""


def spoken(message: T, say: Words) -> T:
    """Return a message with its texts in another language; what has none of them as it is."""
    return message if say.language == "en" else _spoken(message, say)


def _spoken(value: Any, say: Words) -> Any:
    if isinstance(value, str):
        return say.said(value)
    if isinstance(value, list):
        return [_spoken(one, say) for one in value]
    names = TEXTS.get(type(value), ())
    told = {name: _spoken(getattr(value, name), say) for name in names}
    return msgspec.structs.replace(value, **told) if told else value

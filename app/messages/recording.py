"""Messages about the recording of a session, as JSON."""

from typing import Annotated, Literal

import msgspec
from msgspec import Meta, Struct


class RecordRequest(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Start or stop a recording, or add a note or mark: key `record`, answered by the recorder."""

    action: Literal["start", "stop", "note", "mark"]
    text: Annotated[str, Meta(max_length=2000)] = ""
    """Text of a note or mark."""
    requester: Annotated[str, Meta(max_length=80)] = ""


class RecordingStatus(Struct, frozen=True, kw_only=True):
    """Status of the recorder: key `recording`, twice per second; also the reply to a request."""

    state: Literal["recording", "off", "failed"]
    text: str
    """One line for the operator."""
    session: str = ""
    """Folder of the present or last recording."""
    seconds: float = 0.0
    written_bytes: int = 0
    messages: int = 0
    dropped: int = 0
    """Messages dropped because they arrived faster than they were written."""
    warning: str = ""
    """Warning when a limit is near."""


class RecordingGap(Struct, frozen=True, kw_only=True):
    """Messages are missing at this place of a recording: the recorder did not get or write them."""

    dropped: int = 0
    """Messages dropped because they arrived faster than they were written; 0 for a broken link."""


class Exchange(Struct, frozen=True, kw_only=True):
    """A request with its reply, for recordings: key of the request + `/exchange`."""

    number: int
    """Sequence number for this key; a gap shows a lost exchange."""
    wall_ns: int
    name: str = ""
    """Name of the requester, if given."""
    request: msgspec.Raw
    reply: msgspec.Raw

"""Messages round the recording of a session: JSON, like the rest of the control plane."""

from typing import Annotated, Literal

import msgspec
from msgspec import Meta, Struct


class RecordRequest(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Change the recording, or write beside it: key `record`, answered by the recorder."""

    action: Literal["start", "stop", "note", "mark"]
    text: Annotated[str, Meta(max_length=2000)] = ""
    """Of a note or mark."""
    requester: Annotated[str, Meta(max_length=80)] = ""


class RecordingStatus(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What the recorder does: key `recording`, twice a second; also the reply to a request."""

    state: Literal["recording", "off", "failed"]
    text: str
    """One line for the operator."""
    session: str = ""
    """Folder that is written, or was last."""
    seconds: float = 0.0
    written_bytes: int = 0
    messages: int = 0
    dropped: int = 0
    """Messages that came faster than they could be written."""
    warning: str = ""
    """A limit comes near."""


class Exchange(Struct, frozen=True, kw_only=True):
    """A request and its reply, as those who record see them: key of the request + `/exchange`."""

    number: int
    """Counts the exchanges of this key; a gap shows that one was lost."""
    wall_ns: int
    name: str = ""
    """Who asked, where they said so."""
    request: msgspec.Raw
    reply: msgspec.Raw

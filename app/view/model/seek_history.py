"""What a jump in a recording restores that no single message holds."""

from typing import Final

from msgspec import Struct

from app.messages.status import Event, Status

SEEK_HISTORY: Final = "view/restore"
"""Key of a `SeekHistory`, as JSON: it begins the messages that a jump in a recording feeds."""


class SeekHistory(Struct, frozen=True, kw_only=True):
    """The past of one moment: the model forgets everything else."""

    trail: list[tuple[float, float, float]] = []
    """Where the base was, metres in the world."""
    statuses: list[Status] = []
    """For the plots, in order."""
    events: list[Event] = []

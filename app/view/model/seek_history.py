"""History that a jump in a recording restores, beyond its messages."""

from typing import Final

from msgspec import Struct

from app.messages.status import Event, Status

SEEK_HISTORY: Final = "view/restore"
"""Key of a `SeekHistory`, as JSON: the first message after a jump in a recording."""


class SeekHistory(Struct, frozen=True, kw_only=True):
    """History up to a moment; all other state of the model is reset."""

    trail: list[tuple[float, float, float]] = []
    """Positions of the base, metres in the world."""
    statuses: list[Status] = []
    """Statuses for the plots, in order."""
    events: list[Event] = []

"""Knows what of a map was missed on its way, and whether a fetched map covers it."""

import logging
from collections.abc import Callable
from typing import Final

from app.links.network.inbox import Inbox

logger = logging.getLogger(__name__)

Missed = tuple[int, int]
"""Openings of the link, before each of which messages were missed, and messages dropped."""

_NOTHING: Final = (0, 0)


class MapGaps:
    """Tells when the whole map must be fetched.

    `now` and `note_fetched` are called by the thread that fetches, the others by the one that reads
    the inbox.
    """

    def __init__(self, openings: Callable[[], int], inbox: Inbox) -> None:
        """Watch a link.

        Args:
            openings: Returns how often the link was opened.
            inbox: Counts the messages that were dropped.
        """
        self._openings = openings
        self._inbox = inbox
        self._seen = self._fetched_at = _NOTHING

    def now(self) -> Missed:
        """Return what was missed so far; remembered with each request of the whole map."""
        return self._openings(), self._inbox.dropped

    def note_fetched(self, asked_at: Missed) -> None:
        """Note that a reply comes next, which holds what was missed before its request."""
        self._fetched_at = asked_at

    def are_new(self) -> bool:
        """Return whether something was missed since the last call; tells of dropped messages."""
        seen = self.now()
        if seen == self._seen:
            return False
        if seen[1] != self._seen[1]:
            logger.warning("%d messages were dropped: fetching the whole map", seen[1])
        self._seen = seen
        return True

    def are_filled(self) -> bool:
        """Return whether the last reply holds all that was missed."""
        return self._fetched_at == self.now()

"""Messages that were published and have not arrived, by the numbers attached to them."""

import threading
from typing import Final

from app.links.rmw_zenoh.protocol.attachment import Attachment

MOST_PUBLISHERS: Final = 100
LONGEST_GAP: Final = 10_000
"""A larger step of the numbers is another publisher, not a loss."""


class LossCount:
    """Counts the messages of a topic that came, and the gaps between their numbers."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._last: dict[bytes, int] = {}
        self._came = self._lost = 0

    def add(self, attachment: Attachment) -> None:
        """Count a message."""
        with self._lock:
            last = self._last.get(attachment.gid)
            gap = 0 if last is None else attachment.sequence - last - 1
            if 0 < gap < LONGEST_GAP:
                self._lost += gap
            self._came += 1
            if last is None and len(self._last) >= MOST_PUBLISHERS:
                self._last.clear()
            self._last[attachment.gid] = attachment.sequence

    def take_share(self) -> float:
        """Return the lost share of the messages since the last call, 0 to 1."""
        with self._lock:
            sent = self._came + self._lost
            share = self._lost / sent if sent else 0.0
            self._came = self._lost = 0
            return share

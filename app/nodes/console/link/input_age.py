"""How late the input of a page arrives."""

import math
from typing import Final

LATE_S: Final = 0.5
"""Delay beyond the usual one from which input counts as released: the keys may be up by now."""
_SLACK_MS: Final = 100.0
"""A ping that takes so much more than the shortest one shows how the page's clock stands."""


class InputAge:
    """Compares the times of a page's messages, by its own clock, with those of their arrival.

    An uplink that queues delivers all messages of held keys in order and at their rate, each of
    them late: silence tells nothing. Clocks may drift or stand still while a computer sleeps; a
    ping with an ordinary round trip sets them right.
    """

    def __init__(self) -> None:
        self._usual_s = math.inf
        self._shortest_ms = math.inf
        self._pinged_s: float | None = None

    def ping(self, sent_ms: float, trip_ms: float | None, now_s: float) -> None:
        """Note a ping.

        Args:
            sent_ms: When the page sent it, by the page's clock.
            trip_ms: Round trip of the ping before it; None if that was not answered.
            now_s: When it arrived.
        """
        if trip_ms is not None and self._pinged_s is not None:
            self._shortest_ms = min(self._shortest_ms, trip_ms)
            if trip_ms <= self._shortest_ms + _SLACK_MS:
                self._usual_s = self._pinged_s
        self._pinged_s = now_s - 1e-3 * sent_ms
        self._usual_s = min(self._usual_s, self._pinged_s)

    def late_s(self, sent_ms: float, now_s: float) -> float:
        """Return by how many seconds a message arrives later than usual."""
        taken_s = now_s - 1e-3 * sent_ms
        self._usual_s = min(self._usual_s, taken_s)
        return taken_s - self._usual_s

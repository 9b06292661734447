"""A bounded queue between zenoh's network thread and the thread that answers queries.

zenoh's Python binding queues queries without a limit: whoever sends them faster than they are
answered fills the memory and delays everyone else's.
"""

import logging
import math
import threading
import time
from collections import deque
from collections.abc import Callable
from contextvars import ContextVar
from typing import Any, Final

import zenoh

logger = logging.getLogger(__name__)

RATE_HZ: Final = 50.0
"""Queries of one key that are answered in a second, on average."""
BURST: Final = 100
"""Queries that are answered at once after a pause."""
MAX_WAITING: Final = 200
"""Queries of one key that wait; more are dropped without a reply."""
QUIET_S: Final = 5.0
"""Time without a refusal after which the next one is logged again."""

Answer = Callable[[zenoh.Query], None]

_waited_s: ContextVar[float] = ContextVar("waited_s", default=0.0)


def waited_s() -> float:
    """Return how long the query that this thread answers waited for its turn; 0 without one.

    Those that were answered before it took that much of the time that its asker waits.
    """
    return _waited_s.get()


class QueryQueue:
    """Answers the queries of one key in a thread of its own, at a limited rate.

    Args:
        session: An open session.
        key: Key of the queries.
        answer: Answers a query.
        refuse: Answers a query beyond the limits; None drops it, and zenoh tells the asker that
            there was no reply.
        urgent: Returns whether a query goes before all others and past the limit of the rate.
            Called in zenoh's network thread: it must return at once.
        rate_hz: Queries that are answered in a second, on average.
        burst: Queries that are answered at once after a pause.
        clock: Seconds of a monotonic clock.
    """

    def __init__(
        self,
        session: zenoh.Session,
        key: str,
        answer: Answer,
        refuse: Answer | None = None,
        urgent: Callable[[zenoh.Query], bool] | None = None,
        *,
        rate_hz: float = RATE_HZ,
        burst: int = BURST,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._key = key
        self._answer, self._refuse, self._urgent = answer, refuse, urgent
        self._clock = clock
        self._changed = threading.Condition()
        # Each with its time of arrival, seconds of the clock.
        self._first: deque[tuple[zenoh.Query, Answer, float]] = deque()
        self._waiting: deque[tuple[zenoh.Query, Answer, float]] = deque()
        self._rate_hz, self._burst = rate_hz, burst
        self._credit, self._credit_at = float(burst), clock()
        self._refused_at = -math.inf
        self._closed = False
        self._thread = threading.Thread(target=self._run, name=f"answers {key}", daemon=True)
        self._thread.start()
        handler: Any = zenoh.handlers.Callback(self._receive, self._close, indirect=False)
        self._queryable = session.declare_queryable(key, handler)

    def _receive(self, query: zenoh.Query) -> None:
        with self._changed:
            now = self._clock()
            if self._urgent is not None and self._urgent(query):
                if len(self._first) < MAX_WAITING:
                    self._first.append((query, self._answer, now))
            elif self._admits(now):
                self._waiting.append((query, self._answer, now))
            elif self._refuse is not None and len(self._waiting) < MAX_WAITING:
                self._waiting.append((query, self._refuse, now))
            self._changed.notify()

    def _admits(self, now: float) -> bool:
        """Return whether the rate and the queue allow another query; log the first refusal."""
        self._credit = min(self._burst, self._credit + (now - self._credit_at) * self._rate_hz)
        self._credit_at = now
        if self._credit >= 1.0 and len(self._waiting) < MAX_WAITING:
            self._credit -= 1.0
            return True
        if now - self._refused_at > QUIET_S:
            logger.warning(
                "%s: more than %g queries a second; the others are refused",
                self._key,
                self._rate_hz,
            )
        self._refused_at = now
        return False

    def _close(self) -> None:
        with self._changed:
            self._closed = True
            self._changed.notify()

    def _run(self) -> None:
        while True:
            with self._changed:
                while not (self._first or self._waiting or self._closed):
                    self._changed.wait()
                if self._closed:
                    self._first.clear()
                    self._waiting.clear()
                    return
                query, answer, arrived_s = (self._first or self._waiting).popleft()
            _waited_s.set(self._clock() - arrived_s)
            try:
                answer(query)
            except zenoh.ZError as error:
                logger.debug("%s: no reply was sent: %s", self._key, error)
            except Exception:  # The next query must be answered.
                logger.exception("a query on %s", self._key)
            del query

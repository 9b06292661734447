"""Statistics of incoming streams: age, rate, dropped and refused messages."""

import threading
import time
from collections import deque
from typing import Final

from app.messages.status import StreamStatus

WINDOW: Final = 20


class StreamMonitor:
    """Counts the messages of one stream; safe from any thread."""

    def __init__(self, name: str) -> None:
        self.name = name
        self._lock = threading.Lock()
        self._arrivals: deque[float] = deque(maxlen=WINDOW)
        self._dropped = 0
        self._rejected = 0
        self.last_problem = ""
        """Why the last refused message was refused."""

    def arrived(self) -> None:
        """Count a message."""
        with self._lock:
            self._arrivals.append(time.monotonic())

    def dropped(self, count: int = 1) -> None:
        """Count messages that were replaced by newer ones before use."""
        with self._lock:
            self._dropped += count

    def rejected(self, problem: str) -> int:
        """Count a message that could not be used; returns how many there were."""
        with self._lock:
            self._rejected += 1
            self.last_problem = problem
            return self._rejected

    def age_s(self) -> float | None:
        """Return the time since the last message, None before the first."""
        with self._lock:
            return time.monotonic() - self._arrivals[-1] if self._arrivals else None

    def status(self) -> StreamStatus:
        """Return the stream's entry of the status message."""
        with self._lock:
            arrivals = list(self._arrivals)
            dropped, rejected = self._dropped, self._rejected
        span = arrivals[-1] - arrivals[0] if len(arrivals) > 1 else 0.0
        return StreamStatus(
            name=self.name,
            age_s=time.monotonic() - arrivals[-1] if arrivals else None,
            rate_hz=(len(arrivals) - 1) / span if span > 0 else 0.0,
            dropped=dropped,
            rejected=rejected,
        )

"""Messages on their way from the network's thread to the one that writes."""

import threading
import time
from collections import deque
from dataclasses import dataclass
from typing import Final

MAX_WAITING_BYTES: Final = 128 * 2**20


@dataclass(frozen=True, slots=True)
class QueuedMessage:
    """One message and when it came."""

    key: str
    payload: bytes
    wall_ns: int
    now_s: float


class WriteQueue:
    """Messages between the network's thread and the one that writes, within a bound."""

    def __init__(self, limit_bytes: int = MAX_WAITING_BYTES) -> None:
        self.dropped = 0
        """Messages that found no room."""
        self._limit = limit_bytes
        self._size = 0
        self._waiting: deque[QueuedMessage] = deque()
        self._arrived = threading.Condition()

    def put(self, key: str, payload: bytes) -> None:
        """Hand over a message; never waits."""
        arrival = QueuedMessage(key, payload, time.time_ns(), time.monotonic())
        with self._arrived:
            if self._size + len(payload) > self._limit:
                self.dropped += 1
                return
            self._size += len(payload)
            self._waiting.append(arrival)
            self._arrived.notify()

    def wake(self) -> None:
        """Let `take` return."""
        with self._arrived:
            self._arrived.notify()

    def take(self, timeout_s: float) -> list[QueuedMessage]:
        """Return everything, after waiting for a first message at most so long."""
        with self._arrived:
            if not self._waiting:
                self._arrived.wait(timeout_s)
            batch = list(self._waiting)
            self._waiting.clear()
            self._size = 0
        return batch

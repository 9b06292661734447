"""Bounded queue of messages from the network's thread to the writing thread."""

import threading
import time
from collections import deque
from dataclasses import dataclass
from typing import Final

from app.messages.control import encode
from app.messages.recording import RecordingGap
from app.recording.channels import GAP_KEY

MAX_WAITING_BYTES: Final = 128 * 2**20


@dataclass(frozen=True, slots=True)
class QueuedMessage:
    """One message and its time of arrival."""

    key: str
    payload: bytes
    now_s: float
    """Of a monotonic clock."""


class WriteQueue:
    """First-in, first-out queue bounded in bytes; new messages are dropped while it is full.

    In the place of dropped ones there is a `RecordingGap` with their number.
    """

    def __init__(self, limit_bytes: int = MAX_WAITING_BYTES) -> None:
        self._lost = 0
        """Messages dropped since the last that was queued."""
        self._limit = limit_bytes
        self._size = 0
        self._waiting: deque[QueuedMessage] = deque()
        self._arrived = threading.Condition()

    def put(self, key: str, payload: bytes) -> None:
        """Queue a message without blocking."""
        arrival = QueuedMessage(key, payload, time.monotonic())
        with self._arrived:
            if self._size + len(payload) > self._limit:
                self._lost += 1
                return
            self._mark_loss()
            self._size += len(payload)
            self._waiting.append(arrival)
            self._arrived.notify()

    def wake(self) -> None:
        """End a wait in `take`."""
        with self._arrived:
            self._arrived.notify()

    def take(self, timeout_s: float) -> list[QueuedMessage]:
        """Return all queued messages; wait at most `timeout_s` for the first."""
        with self._arrived:
            if not self._waiting:
                self._arrived.wait(timeout_s)
            self._mark_loss()
            batch = list(self._waiting)
            self._waiting.clear()
            self._size = 0
        return batch

    def _mark_loss(self) -> None:
        """Queue how many messages were dropped, if any."""
        lost, self._lost = self._lost, 0
        if lost:
            payload = encode(RecordingGap(dropped=lost))
            self._waiting.append(QueuedMessage(GAP_KEY, payload, time.monotonic()))

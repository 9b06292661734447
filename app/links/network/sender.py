"""A thread that sends messages, so that a slow link does not block the caller."""

import logging
import threading
from collections import deque
from collections.abc import Callable
from typing import Final

import zenoh

logger = logging.getLogger(__name__)

Send = Callable[[], object]
FLUSH_S: Final = 1.0


class Sender:
    """Queues messages and sends them one by one; safe from any thread.

    A reliable put blocks for up to five seconds behind a slow subscriber; it blocks this thread and
    not the caller.
    """

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._latest: dict[str, Send] = {}
        self._queue: deque[tuple[int, Send]] = deque()
        self._backlog_bytes = 0
        self._closed = False
        self._thread = threading.Thread(target=self._run, name="sender", daemon=True)
        self._thread.start()

    @property
    def backlog_bytes(self) -> int:
        """Bytes queued by `put` and not sent yet."""
        with self._changed:
            return self._backlog_bytes

    def put_latest(self, key: str, send: Send) -> None:
        """Queue a message, replacing one that waits under the same key."""
        with self._changed:
            self._latest[key] = send
            self._changed.notify()

    def put(self, size_bytes: int, send: Send) -> None:
        """Queue a message; all are sent, in the order of the calls."""
        with self._changed:
            self._queue.append((size_bytes, send))
            self._backlog_bytes += size_bytes
            self._changed.notify()

    def close(self) -> None:
        """Send what is queued, for at most `FLUSH_S`, and end the thread."""
        with self._changed:
            self._closed = True
            self._changed.notify()
        self._thread.join(timeout=FLUSH_S)

    def _run(self) -> None:
        while True:
            with self._changed:
                while not (self._latest or self._queue or self._closed):
                    self._changed.wait()
                if self._closed and not (self._latest or self._queue):
                    return
                # Alternating, so that a long queue does not delay the latest-wins messages.
                latest = self._latest.pop(next(iter(self._latest))) if self._latest else None
                size, queued = self._queue.popleft() if self._queue else (0, None)
            for send in (latest, queued):
                if send is not None:
                    _try(send)
            with self._changed:
                self._backlog_bytes -= size


def _try(send: Send) -> None:
    try:
        send()
    except zenoh.ZError as error:
        logger.warning("a message was not sent: %s", error)
    except Exception:  # The next message must be sent: it may stop the robot.
        logger.exception("a message was not sent")

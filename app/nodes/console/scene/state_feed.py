"""The latest state for every shell, from one thread to many sockets."""

import asyncio
import contextlib
import threading
import time
from collections.abc import AsyncGenerator
from typing import Final

from app.nodes.console.scene.export_requests import ExportRequests

PICTURES = 32
STALLED_S: Final = 5.0
"""Who posts does so five times a second, also when nothing changes: silence means that it hangs."""
STALLED: Final = b'{"type":"stalled"}'
_LOOK_S: Final = 1.0


class StateFeed:
    """Holds the newest notice; readers get it at once and then each newer one, never a backlog."""

    def __init__(self) -> None:
        self.exports = ExportRequests()
        """Where pages ask whoever posts for files."""
        self._lock = threading.Lock()
        self._notice: bytes | None = None
        self._number = 0
        self._posted_s = time.monotonic()
        self._pictures: dict[str, bytes] = {}
        self._readers: dict[asyncio.Event, asyncio.AbstractEventLoop] = {}

    @property
    def notice(self) -> bytes | None:
        """What was posted last."""
        return self._notice

    def show(self, name: str, jpeg: bytes) -> None:
        """Keep a picture that the notices name; the oldest gives way."""
        with self._lock:
            self._pictures[name] = jpeg
            while len(self._pictures) > PICTURES:
                del self._pictures[next(iter(self._pictures))]

    def picture(self, name: str) -> bytes | None:
        """Return a picture that was shown, None when it is gone."""
        with self._lock:
            return self._pictures.get(name)

    def post(self, notice: bytes) -> None:
        """Replace the notice; the same as before wakes nobody. Any thread may call this."""
        with self._lock:
            self._posted_s = time.monotonic()
            if notice == self._notice:
                return
            self._notice = notice
            self._number += 1
            readers = list(self._readers.items())
        for event, loop in readers:
            if not loop.is_closed():
                loop.call_soon_threadsafe(event.set)

    @property
    def is_stalled(self) -> bool:
        """Whether nobody has posted for so long that what is shown is old."""
        return time.monotonic() - self._posted_s > STALLED_S

    async def follow(self) -> AsyncGenerator[bytes]:
        """Yield the current notice, then every newest one; `STALLED` when they stay away."""
        event = asyncio.Event()
        event.set()
        with self._lock:
            self._readers[event] = asyncio.get_running_loop()
        seen, was_stalled = 0, False
        try:
            while True:
                with contextlib.suppress(TimeoutError):
                    async with asyncio.timeout(_LOOK_S):
                        await event.wait()
                event.clear()
                if self.is_stalled != was_stalled:
                    was_stalled, seen = not was_stalled, 0
                    if was_stalled:
                        yield STALLED
                if was_stalled:
                    continue
                with self._lock:
                    notice, number = self._notice, self._number
                if notice is not None and number != seen:
                    seen = number
                    yield notice
        finally:
            with self._lock:
                self._readers.pop(event, None)

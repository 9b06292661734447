"""The latest state, published by one thread to the WebSockets of all pages."""

import asyncio
import contextlib
import threading
import time
from collections.abc import AsyncGenerator
from typing import Final

from app.nodes.console.camera.camera_feed import CameraFeed
from app.nodes.console.scene.export_requests import ExportRequests
from app.nodes.console.scene.scene_requests import SceneRequests

PICTURES = 32
STALLED_S: Final = 5.0
"""Without a post for this long the scene thread hangs; it posts five times a second."""
STALLED: Final = b'{"type":"stalled"}'
_LOOK_S: Final = 1.0


class StateFeed:
    """Holds the newest state; readers get it at once, then each newer one, without a backlog."""

    def __init__(self) -> None:
        self.camera = CameraFeed()
        """Camera pictures for the pages."""
        self.exports = ExportRequests()
        """Export files that pages requested."""
        self.scene = SceneRequests()
        """Places that pages point at."""
        self.goals = b"{}"
        """The list of goals as JSON, see `goal_list`; replaced as a whole."""
        self.calls = b"{}"
        """The calls as JSON, see `CallsShown`; replaced as a whole."""
        self._lock = threading.Lock()
        self._notice: bytes | None = None
        self._number = 0
        self._posted_s = time.monotonic()
        self._pictures: dict[str, bytes] = {}
        self._readers: dict[asyncio.Event, asyncio.AbstractEventLoop] = {}

    @property
    def notice(self) -> bytes | None:
        """The last posted state."""
        return self._notice

    def show(self, name: str, jpeg: bytes) -> None:
        """Store a picture that a state refers to; the oldest is dropped beyond `PICTURES`."""
        with self._lock:
            self._pictures[name] = jpeg
            while len(self._pictures) > PICTURES:
                del self._pictures[next(iter(self._pictures))]

    def picture(self, name: str) -> bytes | None:
        """Return a stored picture, None when it was dropped."""
        with self._lock:
            return self._pictures.get(name)

    def post(self, notice: bytes) -> None:
        """Publish a state; an unchanged one wakes no reader. Safe from any thread."""
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
        """Whether nothing has been posted for `STALLED_S`."""
        return time.monotonic() - self._posted_s > STALLED_S

    async def follow(self) -> AsyncGenerator[bytes]:
        """Yield the current state, then each newer one, and `STALLED` when posts stop."""
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
                    was_stalled = not was_stalled
                    if was_stalled:
                        if seen == 0 and self._notice is not None:
                            # Who comes only now is told what has stalled.
                            yield self._notice
                        yield STALLED
                    seen = 0
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

"""The latest state for every shell, from one thread to many sockets."""

import asyncio
import threading
from collections.abc import AsyncGenerator

PICTURES = 32


class Bulletin:
    """Holds the newest notice; readers get it at once and then each newer one, never a backlog."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._notice: bytes | None = None
        self._number = 0
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
            if notice == self._notice:
                return
            self._notice = notice
            self._number += 1
            readers = list(self._readers.items())
        for event, loop in readers:
            if not loop.is_closed():
                loop.call_soon_threadsafe(event.set)

    async def follow(self) -> AsyncGenerator[bytes]:
        """Yield the current notice, then every newest one."""
        event = asyncio.Event()
        event.set()
        with self._lock:
            self._readers[event] = asyncio.get_running_loop()
        seen = 0
        try:
            while True:
                await event.wait()
                event.clear()
                with self._lock:
                    notice, number = self._notice, self._number
                if notice is not None and number != seen:
                    seen = number
                    yield notice
        finally:
            with self._lock:
                self._readers.pop(event, None)

"""Messages from the network's threads to the one that uses them."""

import threading
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from typing import Final

_LIMIT: Final = 4096

Message = tuple[str, bytes]


class Inbox:
    """Keeps every message of the topics in `every`, and only the latest of the others.

    Args:
        every: Topics of which every message is kept.
        takers: Called at once with each message of their topics, in the thread that brings it.
        only_taken: Topics of `takers` that are not kept as well.
        anew: Topics of `every` of which a message replaces all that waits.
    """

    def __init__(
        self,
        every: Iterable[str],
        takers: Mapping[str, Callable[[bytes], None]] | None = None,
        only_taken: Iterable[str] = (),
        anew: Iterable[str] = (),
    ) -> None:
        self._takers = takers or {}
        self._only_taken = frozenset(only_taken)
        self._anew = frozenset(anew)
        self.dropped = 0
        """Messages of the topics in `every` that arrived while the inbox was full."""
        self._every = frozenset(every)
        self._queue: deque[Message] = deque()
        self._latest: dict[str, bytes] = {}
        self._arrived = threading.Condition()
        self._woken = False

    def put(self, key: str, payload: bytes) -> None:
        """Add a message without waiting."""
        take = self._takers.get(key)
        if take is not None:
            take(payload)
        if key in self._only_taken:
            return
        with self._arrived:
            if key in self._anew:
                self._latest.clear()
                self._queue.clear()
            if key not in self._every:
                self._latest[key] = payload
            elif len(self._queue) < _LIMIT:
                self._queue.append((key, payload))
            else:
                self.dropped += 1
            self._arrived.notify()

    def has_room(self) -> bool:
        """Return whether at most half of what it holds waits, so that a sender may go on."""
        with self._arrived:
            return 2 * len(self._queue) <= _LIMIT

    def wake(self) -> None:
        """Let `drain` return, or the next one return at once."""
        with self._arrived:
            self._woken = True
            self._arrived.notify()

    def drain(self, timeout_s: float) -> list[Message]:
        """Take all messages; wait at most `timeout_s` for the first."""
        with self._arrived:
            if not self._queue and not self._latest and not self._woken:
                self._arrived.wait(timeout_s)
            self._woken = False
            batch = [*self._latest.items(), *self._queue]
            self._latest.clear()
            self._queue.clear()
        return batch

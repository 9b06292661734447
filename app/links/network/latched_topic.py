"""A topic that answers late joiners with its last message: its sender and its receiver."""

import threading
from collections.abc import Callable
from functools import partial
from typing import Final, Protocol

import zenoh

from app.links.network.query_queue import QueryQueue
from app.links.network.sender import Sender

_FRESH_S: Final = 1.0
"""How long a reply waits for a message that is queued; a slow link may hold it up for longer."""


class Topic(Protocol):
    """A topic that messages are published on."""

    def put(self, payload: bytes) -> None:
        """Publish a message."""
        ...


class LatchedTopic:
    """Publisher, and queryable of the same key that replies with the last message."""

    def __init__(self, session: zenoh.Session, key: str, sender: Sender) -> None:
        self._key = key
        self._sender = sender
        self._changed = threading.Condition()
        self._newest: bytes | None = None
        self._last: bytes | None = None
        """The last message that was published or is being published."""
        self._publisher = session.declare_publisher(
            key, congestion_control=zenoh.CongestionControl.BLOCK
        )
        self._queries = QueryQueue(session, key, self._answer)

    def put(self, payload: bytes) -> None:
        """Publish a message and keep it; a newer one replaces it while the link is busy."""
        with self._changed:
            self._newest = payload
        self._sender.put_latest(self._key, partial(self._publish, payload))

    def _publish(self, payload: bytes) -> None:
        # Not in `put`: the message before may still be on its way, and would follow the reply.
        with self._changed:
            self._last = payload
            self._changed.notify_all()
        self._publisher.put(payload)

    def _answer(self, query: zenoh.Query) -> None:
        with query:
            with self._changed:
                self._changed.wait_for(lambda: self._last is self._newest, _FRESH_S)
                last = self._last
            if last is not None:
                query.reply(self._key, last)


class LatchedReceiver:
    """Takes the messages of a subscription, and the last one on request, never an older one after.

    The reply to a request waits until nobody else may reply; what was published meanwhile arrives
    before it.
    """

    def __init__(self, take: Callable[[bytes], None]) -> None:
        """Prepare a receiver.

        Args:
            take: Called with each message in zenoh's network thread, and with a requested one in
                the thread that requests: it must return at once and not use the session.
        """
        self._take = take
        self._lock = threading.Lock()
        self._received = 0

    def receive(self, payload: bytes) -> None:
        """Take a message of the subscription."""
        with self._lock:
            self._received += 1
            self._take(payload)

    def request(self, last_message: Callable[[], bytes | None]) -> bool:
        """Take the last message unless another was received meanwhile; return whether it came.

        Args:
            last_message: Requests the last message; None without a reply.
        """
        before = self._received
        payload = last_message()
        if payload is None:
            return False
        with self._lock:
            if self._received == before:
                self._take(payload)
        return True

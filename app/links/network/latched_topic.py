"""A topic that answers late joiners with its last message."""

import threading
from functools import partial

import zenoh

from app.links.network.query_queue import QueryQueue
from app.links.network.sender import Sender


class LatchedTopic:
    """Publisher, and queryable of the same key that replies with the last message."""

    def __init__(self, session: zenoh.Session, key: str, sender: Sender) -> None:
        self._key = key
        self._sender = sender
        self._lock = threading.Lock()
        self._last: bytes | None = None
        self._publisher = session.declare_publisher(
            key, congestion_control=zenoh.CongestionControl.BLOCK
        )
        self._queries = QueryQueue(session, key, self._answer)

    @property
    def last(self) -> bytes | None:
        """The last message, None before the first."""
        with self._lock:
            return self._last

    def put(self, payload: bytes) -> None:
        """Store and publish a message; a newer one replaces it while the link is busy."""
        with self._lock:
            self._last = payload
        self._sender.put_latest(self._key, partial(self._publisher.put, payload))

    def _answer(self, query: zenoh.Query) -> None:
        with query:
            last = self.last
            if last is not None:
                query.reply(self._key, last)

"""A topic that remembers its last message for those who join late."""

import threading
from functools import partial

import zenoh

from app.links.network.sender import Sender


class LatchedTopic:
    """Publishes, and answers queries of the same key with the last message."""

    def __init__(self, session: zenoh.Session, key: str, sender: Sender) -> None:
        self._key = key
        self._sender = sender
        self._lock = threading.Lock()
        self._last: bytes | None = None
        self._publisher = session.declare_publisher(
            key, congestion_control=zenoh.CongestionControl.BLOCK
        )
        self._queryable = session.declare_queryable(key, self._answer)

    @property
    def last(self) -> bytes | None:
        """What was published last."""
        with self._lock:
            return self._last

    def put(self, payload: bytes) -> None:
        """Remember, and publish unless the next one comes sooner than the link is free."""
        with self._lock:
            self._last = payload
        self._sender.put_latest(self._key, partial(self._publisher.put, payload))

    def _answer(self, query: zenoh.Query) -> None:
        with query:
            last = self.last
            if last is not None:
                query.reply(self._key, last)

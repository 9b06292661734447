"""Receives a robot's topics, reconnects after silence, and fetches what was missed."""

import logging
import time
from collections.abc import Callable, Iterable
from functools import partial
from typing import Any, Final

import zenoh

from app.links.network.last_messages import request_when_seen
from app.links.network.latched_topic import LatchedReceiver
from app.links.network.requests import last_message
from app.links.network.session import open_client
from app.links.network.subscription import on_token, subscribe
from app.messages import keys

logger = logging.getLogger(__name__)

_KEYFRAME_S: Final = 20.0
"""Time for the whole map, which has megabytes."""
SILENT_S: Final = 4.0
"""Silence after which the session is reopened."""
CONNECT_S: Final = 1.5
_QUERY_S: Final = 2.0
_TOKEN_S: Final = 1.0


class TopicListener:
    """One zenoh session that listens; the thread that calls `check` keeps it open."""

    def __init__(
        self, endpoint: str, robot: str, topics: Iterable[str], put: Callable[[str, bytes], None]
    ) -> None:
        """Prepare a listener; `check` opens it.

        Args:
            endpoint: zenoh endpoint of the navigator.
            robot: Key prefix.
            topics: Keys to subscribe to. The whole map is not heard, because it is published for
                recordings, every few seconds: who needs it queries it.
            put: Called with each message in zenoh's network thread, and with fetched ones in the
                thread that requests: it must return at once.
        """
        self.endpoint = endpoint
        self.robot = robot
        self.openings = 0
        """How often the link was opened or broke; each time, messages may have been missed."""
        self.session: zenoh.Session | None = None
        self._topics = tuple(topic for topic in topics if topic != keys.MAP_KEYFRAME)
        self._put = put
        self._latched = {
            topic: LatchedReceiver(partial(put, topic))
            for topic in keys.LATCHED
            if topic in self._topics
        }
        self._heard_at = self._opened_at = time.monotonic()
        self._was_heard = False
        self._silence_told_of: float | None = None
        """Time of the last message before the silence that was logged."""

    @property
    def is_open(self) -> bool:
        """Whether a router answers at the endpoint."""
        return self.session is not None

    def silence_s(self) -> float:
        """Return how long ago the navigator was heard last, or the listener was made."""
        return time.monotonic() - self._heard_at

    def has_token(self, token: str) -> bool:
        """Return whether a liveliness token of the robot is there."""
        session = self.session
        if session is None:
            return False
        replies: Any = session.liveliness().get(self._key(token), timeout=_TOKEN_S)
        return any(reply.ok is not None for reply in replies)

    def query(self, topic: str, timeout_s: float | None = None) -> bytes | None:
        """Ask for the last message of a topic; None when nobody answers.

        Args:
            topic: Key under the robot's prefix.
            timeout_s: Time to wait; None for what the topic may need.
        """
        session = self.session
        if session is None:
            return None
        if timeout_s is None:
            timeout_s = _KEYFRAME_S if topic == keys.MAP_KEYFRAME else _QUERY_S
        try:
            return last_message(session, self._key(topic), timeout_s)
        except zenoh.ZError as error:
            logger.debug("query of %s: %s", topic, error)
            return None

    def check(self) -> None:
        """Open the session, and open it again after silence.

        Raises:
            LinkError: No router answers.
            zenoh.ZError: The session cannot be used.
        """
        quiet_s = time.monotonic() - max(self._heard_at, self._opened_at)
        if self.session is not None and quiet_s > SILENT_S:
            if self._silence_told_of != self._heard_at:
                if self._was_heard:
                    logger.info("no data from the navigator at %s: reconnecting", self.endpoint)
                else:
                    logger.info(
                        "the router at %s answers; waiting for the navigator of %s to start",
                        self.endpoint, self.robot,
                    )  # fmt: skip
                self._silence_told_of = self._heard_at
            self.close()
        if self.session is None:
            self._open()

    def close(self) -> None:
        """Close the session."""
        session, self.session = self.session, None
        if session is not None:
            session.close()  # pyright: ignore[reportUnknownMemberType]

    def _open(self) -> None:
        session = open_client(self.endpoint, CONNECT_S)
        try:
            for topic in self._topics:
                kept = topic == keys.TF_STATIC
                subscribe(session, self._key(topic), self._receiver(topic), kept=kept)
            on_token(session, self._key(keys.NAVIGATOR_ALIVE), lost=self._note_break)
            request_when_seen(session, self.robot, self._latched)
        except zenoh.ZError:
            session.close()  # pyright: ignore[reportUnknownMemberType]
            raise
        self.session = session
        self._opened_at = time.monotonic()
        self.openings += 1

    def _note_break(self) -> None:
        self.openings += 1

    def _receiver(self, topic: str) -> Callable[[bytes], None]:
        latched = self._latched.get(topic)
        take = partial(self._put, topic) if latched is None else latched.receive
        if topic != keys.STATUS:
            return take

        def receive(payload: bytes) -> None:
            take(payload)
            self._heard_at, self._was_heard = time.monotonic(), True

        return receive

    def _key(self, topic: str) -> str:
        return f"{self.robot}/{topic}"

"""The recorder's link to the navigator: every message in, requests in, its state out."""

import logging
from collections.abc import Callable
from functools import partial
from typing import Any, Final

import zenoh

from app.links.network.last_messages import request_when_seen
from app.links.network.latched_topic import LatchedReceiver
from app.links.network.requests import last_message, serve
from app.links.network.session import open_client
from app.links.network.subscription import on_token, subscribe
from app.messages import keys
from app.messages.control import encode
from app.messages.recording import RecordingGap, RecordingStatus, RecordRequest
from app.recording.channels import GAP_KEY

logger = logging.getLogger(__name__)

REQUESTED: Final = (*keys.LATCHED, keys.MAP_KEYFRAME)
"""Topics whose last message is requested when a recording begins."""
LAST_S: Final = 1.0
_LEFT_OUT: Final = (keys.COLOR_RAW, keys.RECORDING, *keys.KEPT)
"""Not received with all others: kept topics, which `catch_up` subscribes to, raw colour, which is
also published as JPEG, and a recorder's own status, which would break every silence."""


class RecorderNetwork:
    """One zenoh session at a time, used by the thread that records."""

    def __init__(
        self,
        endpoint: str,
        robot: str,
        take: Callable[[str, bytes], None],
        handle: Callable[[RecordRequest], RecordingStatus],
        status: Callable[[], RecordingStatus],
    ) -> None:
        """Prepare a link; `open` opens it.

        Args:
            endpoint: zenoh endpoint of the navigator.
            robot: Key prefix.
            take: Called with the topic and payload of each message, in zenoh's network thread and
                in the thread that requests last messages: it must return at once.
            handle: Answers a request, in the thread of its key.
            status: Returns the recorder's status.
        """
        self._endpoint = endpoint
        self._robot = robot
        self._take = take
        self._handle = handle
        self._status = status
        self._session: zenoh.Session | None = None
        self._publishers: dict[str, zenoh.Publisher] = {}
        self._latched = {topic: LatchedReceiver(partial(take, topic)) for topic in REQUESTED}
        self._request_latched: Callable[[], None] = lambda: None
        self._kept: list[Callable[[], None]] = []
        """Ends of the subscriptions to topics that are sent once."""

    def open(self) -> None:
        """Open a session.

        Raises:
            LinkError: No navigator answers.
        """
        session = self._session = open_client(self._endpoint)
        skipped = len(self._robot) + 1

        def receive(sample: zenoh.Sample) -> None:
            topic = str(sample.key_expr)[skipped:]
            if topic in _LEFT_OUT:
                return
            payload, latched = sample.payload.to_bytes(), self._latched.get(topic)
            if latched is None:
                self._take(topic, payload)
            else:
                latched.receive(payload)

        handler: Any = zenoh.handlers.Callback(receive, indirect=False)
        session.declare_subscriber(self._key("**"), handler)
        serve(session, self._key(keys.RECORD), RecordRequest, self._handle)
        session.declare_queryable(self._key(keys.RECORDING), self._answer_status)
        on_token(session, self._key(keys.NAVIGATOR_ALIVE), lost=self.mark_gap)
        self._request_latched = request_when_seen(session, self._robot, self._latched)
        # The status is repeated; an event is not, and must not be dropped on a busy link.
        self._publishers = {
            keys.RECORDING: session.declare_publisher(self._key(keys.RECORDING)),
            keys.EVENT: session.declare_publisher(
                self._key(keys.EVENT), congestion_control=zenoh.CongestionControl.BLOCK
            ),
        }

    def close(self) -> None:
        """Close the session, if one is open."""
        session, self._session = self._session, None
        self._publishers = {}
        self._kept = []
        if session is not None:
            session.close()  # pyright: ignore[reportUnknownMemberType]

    def catch_up(self) -> None:
        """Get what was sent before: kept topics by subscription, latched ones by request."""
        session = self._session
        if session is None:
            return
        self._kept = [
            subscribe(session, self._key(topic), partial(self._take, topic), kept=True)
            for topic in keys.KEPT
        ]
        self._request_latched()

    def mark_gap(self) -> None:
        """Record that messages of a broken link are missing, safe from any thread."""
        self._take(GAP_KEY, encode(RecordingGap()))

    def end_kept(self) -> None:
        """Unsubscribe from kept topics, so that the next recording gets them again."""
        while self._kept:
            self._kept.pop()()

    def publish(self, topic: str, payload: bytes) -> None:
        """Publish a message while a session is open."""
        publisher = self._publishers.get(topic)
        if publisher is None:
            return
        try:
            publisher.put(payload)
        except zenoh.ZError as error:
            logger.debug("%s: %s", topic, error)

    def last(self, topic: str) -> bytes:
        """Return the last message of a topic of the navigator; empty without an answer."""
        session = self._session
        try:
            return (session and last_message(session, self._key(topic), LAST_S)) or b""
        except zenoh.ZError as error:
            logger.debug("%s: %s", topic, error)
            return b""

    def _answer_status(self, query: zenoh.Query) -> None:
        with query:
            query.reply(self._key(keys.RECORDING), encode(self._status()))

    def _key(self, topic: str) -> str:
        return f"{self._robot}/{topic}"

"""Streams of a robot on their way from its topics to the navigator's keys."""

import logging
import time
from collections.abc import Callable, Iterable
from functools import partial
from typing import Any, Final

import zenoh

from app.links.network.sender import Sender
from app.links.rmw_zenoh.losses import LossCount
from app.links.rmw_zenoh.matching import Match, match_topic
from app.links.rmw_zenoh.participant import Endpoint, Participant
from app.links.rmw_zenoh.protocol.attachment import Attachment
from app.links.rmw_zenoh.protocol.tokens import Entity, Qos
from app.ros2.ippon_ros2.depth_png import DepthOutput
from app.ros2.ippon_ros2.rates import PairedRates, RateLimit
from app.ros2.ippon_ros2.serialized import stamp_of
from app.ros2.ippon_ros2.settings import (
    COMPRESSED,
    IMAGE,
    IMAGES,
    KEPT,
    STREAMS,
    Settings,
    Topic,
)
from app.ros2.ippon_ros2.zenoh_side import stream_publisher

logger = logging.getLogger(__name__)

DEPTH_OF_IMAGES: Final = 2
DEPTH_OF_OTHERS: Final = 100

SawImage = Callable[[float, float], None]


class Streams:
    """Subscribes to the topics of a robot that have appeared, and carries their bytes.

    Args:
        participant: Of the robot's graph.
        session: Of the navigator.
        robot: Key prefix.
        settings: Topics of the robot.
        saw_image: Called with stamp (s) and arrival (s, monotonic) of each colour image.
    """

    def __init__(
        self,
        participant: Participant,
        session: zenoh.Session,
        robot: str,
        settings: Settings,
        saw_image: SawImage,
    ) -> None:
        self._participant, self._session, self._robot = participant, session, robot
        self._domain = settings.domain
        self._topics = {key: t for key, t in settings.topics.items() if key in STREAMS}
        self._saw_image = saw_image
        self._sender = Sender()
        self._puts: dict[str, Callable[[bytes], Any]] = {}
        self._endpoints: dict[str, Endpoint] = {}
        rates = [of.max_hz if (of := self._topics.get(k)) else 0.0 for k in ("color", "depth")]
        self._rates = PairedRates(*rates)
        self._send_depth: Callable[[bytes], None] | None = None
        self.losses = {key: LossCount() for key in self._topics}

    def follow(self, entities: Iterable[Entity]) -> dict[str, Match]:
        """Subscribe to topics that have appeared or changed; return what was found for each."""
        found = tuple(entities)
        matches: dict[str, Match] = {}
        for key, topic in self._topics.items():
            match = match_topic(key, topic, tuple(STREAMS[key][1]), "MP", found)
            matches[key] = match
            if not match.problem:
                self._subscribe(key, topic, match)
        return matches

    def close(self) -> None:
        """Send what is queued."""
        self._sender.close()

    def _subscribe(self, key: str, topic: Topic, match: Match) -> None:
        kept = key in KEPT and match.qos.transient_local
        depth = DEPTH_OF_IMAGES if key in IMAGES else DEPTH_OF_OTHERS
        qos = Qos(reliable=match.qos.reliable, transient_local=kept, depth=depth)
        known = self._endpoints.get(key)
        if known is not None:
            same = known.entity.key == match.key(self._domain, topic.name)
            if same and known.entity.qos == qos:
                return
            self._participant.withdraw(known)
        take = self._carrier(key, topic, match.type)
        self._endpoints[key] = self._participant.subscribe(
            topic.name, match.type, match.type_hash, qos, take
        )
        logger.info("%s: %s (%s, %s) of %s", key, topic.name, match.type, qos, match.nodes[0])

    def _carrier(
        self, key: str, topic: Topic, kind: str
    ) -> Callable[[bytes, Attachment | None], None]:
        """Return what takes the messages of a topic."""
        types, losses = STREAMS[key][1], self.losses[key]
        put = self._put_of(types[kind], kept=key in KEPT)
        if topic.compress and kind == IMAGE:
            put = DepthOutput(put, self._put_of(types[COMPRESSED], kept=False)).put
        limit = RateLimit(topic.max_hz)

        def send(payload: bytes) -> None:
            if key in IMAGES:
                self._sender.put_latest(key, partial(put, payload))
            else:
                self._sender.put(len(payload), partial(put, payload))

        def take(payload: bytes, attachment: Attachment | None) -> None:
            if attachment is not None:
                losses.add(attachment)
            if key == "color":
                self._take_color(payload, send)
            elif key == "depth":
                for one in self._rates.depth(payload):
                    send(one)
            elif limit.passes(payload):
                send(payload)

        if key == "depth":
            self._send_depth = send
        return take

    def _take_color(self, payload: bytes, send: Callable[[bytes], None]) -> None:
        """Send a colour image, and the depth images that waited for it."""
        passes, depths = self._rates.color(payload)
        if passes:
            send(payload)
            stamp = stamp_of(payload)
            if stamp is not None:
                self._saw_image(stamp, time.monotonic())
        for one in depths:
            if self._send_depth is not None:
                self._send_depth(one)

    def _put_of(self, key: str, *, kept: bool) -> Callable[[bytes], Any]:
        if key not in self._puts:
            whole = f"{self._robot}/{key}"
            self._puts[key] = stream_publisher(self._session, whole, kept=kept)
        return self._puts[key]

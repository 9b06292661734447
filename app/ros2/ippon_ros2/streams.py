"""Topics of the robot on their way to the navigator: found, subscribed to, carried as bytes."""

# pyright: reportMissingImports=false
from __future__ import annotations

import logging
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rclpy.qos import DurabilityPolicy

from .depth_png import DepthOutput
from .interfaces import interface, package_of
from .quality import qos_of
from .rates import PairedRates, RateLimit
from .serialized import stamp_of
from .settings import COMPRESSED, IMAGE, KEPT, STREAMS, Settings, Topic
from .zenoh_side import stream_publisher

try:
    from rclpy.event_handler import SubscriptionEventCallbacks
except ImportError:  # Before ROS 2 Iron.
    from rclpy.qos_event import SubscriptionEventCallbacks

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    import zenoh
    from rclpy.node import Node

logger = logging.getLogger(__name__)

NOBODY = "nobody publishes it"
LEAST_S = 0.1
"""Shortest time of which rates are told."""


@dataclass
class Stream:
    """One topic on its way to the navigator, for the log and `--check`."""

    topic: Topic
    type: str = ""
    reliability: str = ""
    publishers: int = 0
    received: int = 0
    carried: int = 0
    bytes: int = 0
    problem: str = NOBODY
    since: float = 0.0
    """When it was subscribed to first, monotonic seconds."""

    def rates(self, now: float) -> str:
        """Return messages and bytes per second since then."""
        seconds = max(now - self.since, LEAST_S)
        return f"{self.received / seconds:.1f} Hz, {self.bytes / seconds / 1e6:.2f} MB/s"


class Streams:
    """Subscribes to a robot's topics as their publishers allow.

    Args:
        node: Whose executor calls `follow` and takes the messages.
        session: Connected to the navigator's router.
        robot: Key prefix.
        settings: Topics and limits.
        saw_image: Called with stamp (s) and arrival (s, monotonic) of each colour image.
    """

    def __init__(
        self,
        node: Node,
        session: zenoh.Session,
        robot: str,
        settings: Settings,
        saw_image: Callable[[float, float], None],
    ) -> None:
        self._node, self._session, self._robot = node, session, robot
        self._saw_image = saw_image
        self.of = {key: Stream(topic) for key, topic in settings.topics.items() if key in STREAMS}
        """Streams by the profile's entry."""
        self._subscriptions: dict[str, Any] = {}
        self._again: set[str] = set()
        rates = [of.topic.max_hz if (of := self.of.get(k)) else 0.0 for k in ("color", "depth")]
        self._rates = PairedRates(*rates)
        self._put_depth: Callable[[bytes], Any] | None = None

    def follow(self, types: dict[str, list[str]]) -> None:
        """Subscribe to topics that have appeared.

        Args:
            types: Types of each topic that there is.
        """
        for key, stream in self.of.items():
            if key in self._again:
                self._again.discard(key)
                self._node.destroy_subscription(self._subscriptions.pop(key))
            if key not in self._subscriptions:
                self._try_to_subscribe(key, stream, types)

    def problems(self, types: dict[str, list[str]]) -> dict[str, str]:
        """Return what keeps each stream from being carried, with topics that could be meant."""
        found: dict[str, str] = {}
        for key, stream in self.of.items():
            if stream.topic.is_optional and stream.publishers == 0:
                continue
            if stream.publishers == 0:
                others = self._others(stream.topic, STREAMS[key][1], types)
                found[key] = f"{key}: nobody publishes {stream.topic.name}{others}"
            elif stream.problem:
                found[key] = f"{key}: {stream.topic.name} {stream.problem}"
        return found

    def _try_to_subscribe(self, key: str, stream: Stream, there: dict[str, list[str]]) -> None:
        topic, accepted = stream.topic, STREAMS[key][1]
        types = there.get(topic.name, [])
        publishers = self._node.get_publishers_info_by_topic(topic.name)
        stream.publishers = len(publishers)
        if not publishers:
            stream.problem = NOBODY + self._others(topic, accepted, there)
            return
        kind = topic.type or next((one for one in accepted if one in types), None)
        if kind is None or kind not in types:
            wanted = topic.type or " or ".join(accepted)
            stream.problem = f"is {', '.join(types) or 'of no known type'}; needed: {wanted}"
            return
        try:
            message = interface(kind)
        except (ImportError, AttributeError) as error:
            stream.problem = f"needs the package {package_of(kind)}: {error}"
            return
        qos = qos_of(key, publishers)
        late = key in KEPT and qos.durability != DurabilityPolicy.TRANSIENT_LOCAL
        events = SubscriptionEventCallbacks(
            incompatible_qos=lambda _: self._again.add(key), use_default_callbacks=False
        )
        self._subscriptions[key] = self._node.create_subscription(
            message,
            topic.name,
            self._taker(key, stream, self._output(key, topic, kind)),
            qos,
            raw=True,
            event_callbacks=events,
        )
        stream.type, stream.problem = kind, ""
        stream.since = stream.since or time.monotonic()
        stream.reliability = qos.reliability.name.lower()
        logger.info("%s: %s (%s, %s)", key, topic.name, kind, stream.reliability)
        if late:
            logger.warning(
                "%s is published volatile: what was sent before now is lost; publish it transient "
                "local", topic.name,
            )  # fmt: skip

    def _output(self, key: str, topic: Topic, kind: str) -> Callable[[bytes], Any]:
        """Return what carries the messages of a topic; it returns how many bytes went, or None."""
        keys = STREAMS[key][1]
        put = stream_publisher(self._session, f"{self._robot}/{keys[kind]}", kept=key in KEPT)
        if topic.compress and kind == IMAGE:
            compressed = f"{self._robot}/{keys[COMPRESSED]}"
            return DepthOutput(put, stream_publisher(self._session, compressed, kept=False)).put
        return put

    def _taker(
        self, key: str, stream: Stream, put: Callable[[bytes], Any]
    ) -> Callable[[bytes], None]:
        """Return what takes the messages of a topic."""
        limit = RateLimit(stream.topic.max_hz)

        def carry(payload: bytes) -> None:
            size = put(payload) or len(payload)
            stream.carried += 1
            stream.bytes += size

        def take(payload: bytes) -> None:
            stream.received += 1
            if limit.passes(payload):
                carry(payload)

        def take_color(payload: bytes) -> None:
            stream.received += 1
            passes, depths = self._rates.color(payload)
            if passes:
                carry(payload)
                stamp = stamp_of(payload)
                if stamp is not None:
                    self._saw_image(stamp, time.monotonic())
            for one in depths:
                if self._put_depth is not None:
                    self._put_depth(one)

        def take_depth(payload: bytes) -> None:
            stream.received += 1
            for one in self._rates.depth(payload):
                carry(one)

        if key == "depth":
            self._put_depth = carry
        return {"color": take_color, "depth": take_depth}.get(key, take)

    def _others(self, topic: Topic, accepted: Iterable[str], there: dict[str, list[str]]) -> str:
        """Return the published topics of a fitting type, those of a like name first."""
        wanted = {topic.type} if topic.type else set(accepted)
        last = topic.name.rsplit("/", 1)[-1]
        found = sorted(
            (name.rsplit("/", 1)[-1] != last, name)
            for name, types in there.items()
            if wanted & set(types) and self._node.count_publishers(name) > 0
        )
        return f"; there is {', '.join(name for _, name in found[:4])}" if found else ""

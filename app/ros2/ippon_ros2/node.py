"""The ROS 2 node: finds the robot's topics, subscribes as their publishers allow, carries bytes."""

# pyright: reportMissingImports=false
from __future__ import annotations

import importlib
import logging
import struct
import time
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import zenoh
from rclpy.clock import Clock, ClockType
from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from .depth_png import DepthOutput
from .driver import Driver
from .goal_clients import GoalAction, GoalTopic
from .goals import Goals, with_pose
from .quality import qos_of
from .serialized import RateLimit, goal_status, stamp_of
from .settings import (
    COMMANDS,
    COMPRESSED,
    FLOAT,
    GOALS,
    IMAGE,
    KEPT,
    PUBLISHED,
    STREAMS,
    TWIST_STAMPED,
    Ros2Error,
    Settings,
    Topic,
)
from .zenoh_side import stream_publisher

if TYPE_CHECKING:
    from collections.abc import Iterable

logger = logging.getLogger(__name__)

NOBODY = "nobody publishes it"
DISCOVER_S = 0.5
MISSING_AFTER_S = 5.0
"""Time without a publisher after which a topic is reported."""
TILT_STEP_RAD, MOST_TILT_RAD = 0.01, 3.2
TILT_REACH_S = 0.3
"""Time in which a trajectory reaches the camera's tilt."""


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


class BridgeNode(Node):  # type: ignore[misc]
    """Carries a robot's topics to zenoh and commands back.

    Args:
        session: Connected to the navigator's router.
        robot: Key prefix.
        settings: Topics and limits.
    """

    def __init__(self, session: zenoh.Session, robot: str, settings: Settings) -> None:
        super().__init__("ippon_ros2")
        self._session, self._robot = session, robot
        self._settings = settings
        self._started = time.monotonic()
        self.streams = {
            key: Stream(topic) for key, topic in settings.topics.items() if key in STREAMS
        }
        self._subscriptions_of: dict[str, Any] = {}
        self._again: set[str] = set()
        self._reported: set[str] = set()
        self._commands: dict[str, tuple[str, Any]] = {}
        self._tilt: float | None = None
        self.driver = Driver(
            self._send_velocity, settings.max_linear_m_s, settings.max_yaw_rate_rad_s
        )
        self.goals, self.navigation = self._find_navigation()
        if "cmd_vel" in settings.topics:
            self._subscribe_zenoh("cmd_vel", lambda p: self.driver.take(p, time.monotonic()))
        self._subscribe_zenoh("camera/cmd_tilt", self._send_tilt)
        if self.navigation is not None:
            logger.info("goals go to %s (%s)", self.navigation.name, self.navigation.kind)
        # By a clock that goes on while a simulation is paused.
        self.create_timer(DISCOVER_S, self.discover, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def discover(self) -> None:
        """Subscribe to topics that have appeared, and report those that do not."""
        types = dict(self.get_topic_names_and_types())
        for key, stream in self.streams.items():
            if key in self._again:
                self._again.discard(key)
                self.destroy_subscription(self._subscriptions_of.pop(key))
            if key not in self._subscriptions_of:
                self._try_to_subscribe(key, stream, types)
        for key, topic in self._settings.topics.items():
            if key in PUBLISHED and key not in self._commands:
                self._try_to_publish(key, topic, types.get(topic.name, []))
        navigation = self.navigation
        if self.goals and isinstance(navigation, GoalTopic) and navigation.problem():
            self.goals.lost()
        if time.monotonic() - self._started > MISSING_AFTER_S:
            self._report_missing(types)

    def command_topics(self) -> list[tuple[str, str, str, str]]:
        """Return key, topic, problem (empty for none) and type of each command."""
        rows: list[tuple[str, str, str, str]] = []
        for key, topic in self._settings.topics.items():
            if key in GOALS and self.navigation is not None:
                problem = self.navigation.problem()
                rows.append((key, topic.name, problem, self.navigation.kind))
            if key in PUBLISHED:
                kind = self._commands[key][0] if key in self._commands else ""
                problem = "" if kind else f"no subscriber with {' or '.join(COMMANDS[key][1])}"
                rows.append((key, topic.name, problem, kind))
        return rows

    def _try_to_subscribe(self, key: str, stream: Stream, there: dict[str, list[str]]) -> None:
        topic, accepted = stream.topic, STREAMS[key][1]
        types = there.get(topic.name, [])
        publishers = self.get_publishers_info_by_topic(topic.name)
        stream.publishers = len(publishers)
        if not publishers:
            stream.problem = NOBODY + self._others(topic, accepted, there)
            return
        kind = topic.type or next((one for one in accepted if one in types), None)
        if kind is None or kind not in types:
            wanted = topic.type or " or ".join(accepted)
            stream.problem = f"is {', '.join(types) or 'of no known type'}; needed: {wanted}"
            return
        message = self._message_class(kind, stream)
        if message is None:
            return
        qos = qos_of(key, publishers)
        late = key in KEPT and qos.durability != DurabilityPolicy.TRANSIENT_LOCAL
        put = stream_publisher(self._session, f"{self._robot}/{accepted[kind]}", kept=key in KEPT)
        if topic.compress and kind == IMAGE:
            compressed = f"{self._robot}/{accepted[COMPRESSED]}"
            put = DepthOutput(put, stream_publisher(self._session, compressed, kept=False)).put
        receive = partial(self._carry, stream, RateLimit(topic.max_hz), put)
        events = SubscriptionEventCallbacks(
            incompatible_qos=lambda _: self._again.add(key), use_default_callbacks=False
        )
        self._subscriptions_of[key] = self.create_subscription(
            message, topic.name, receive, qos, raw=True, event_callbacks=events
        )
        stream.type, stream.problem = kind, ""
        stream.reliability = qos.reliability.name.lower()
        logger.info("%s: %s (%s, %s)", key, topic.name, kind, stream.reliability)
        if late:
            logger.warning(
                "%s is published volatile: what was sent before now is lost; publish it transient "
                "local", topic.name,
            )  # fmt: skip

    def _others(self, topic: Topic, accepted: Iterable[str], there: dict[str, list[str]]) -> str:
        """Return the published topics of a fitting type, those of a like name first."""
        wanted = {topic.type} if topic.type else set(accepted)
        last = topic.name.rsplit("/", 1)[-1]
        found = sorted(
            (name.rsplit("/", 1)[-1] != last, name)
            for name, types in there.items()
            if wanted & set(types) and self.count_publishers(name) > 0
        )
        return f"; there is {', '.join(name for _, name in found[:4])}" if found else ""

    def _carry(self, stream: Stream, limit: RateLimit, put: Any, payload: bytes) -> None:
        stream.received += 1
        if limit.passes(payload):
            size = put(payload) or len(payload)
            stamp = stamp_of(payload) if stream is self.streams.get("color") else None
            if stamp is not None:
                self.driver.saw_image(stamp, time.monotonic())
            stream.carried += 1
            stream.bytes += size

    def _try_to_publish(self, key: str, topic: Topic, types: list[str]) -> None:
        accepted = COMMANDS[key][1]
        subscribed = bool(self.get_subscriptions_info_by_topic(topic.name))
        kind = topic.type or next((one for one in accepted if one in types), None)
        if kind is None or not (subscribed or topic.type):
            return
        stream = Stream(topic)
        message = self._message_class(kind, stream)
        if message is None:
            self._report(key, f"{key}: {topic.name} {stream.problem}")
            return
        events = PublisherEventCallbacks(
            incompatible_qos=lambda _: self._report(
                f"{key} qos", f"{key}: a subscriber of {topic.name} asks for a quality of service "
                "that commands do not have (reliable, volatile, depth 1)"
            ),
            use_default_callbacks=False,
        )  # fmt: skip
        qos = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE)
        publisher = self.create_publisher(message, topic.name, qos, event_callbacks=events)
        self._commands[key] = kind, publisher
        logger.info("%s: %s (%s)", key, topic.name, kind)

    def _send_velocity(self, linear: float, turn: float) -> None:
        if "cmd_vel" not in self._commands:
            return
        kind, publisher = self._commands["cmd_vel"]
        message = publisher.msg_type()
        twist = message
        if kind == TWIST_STAMPED:
            # Controllers compare stamps with the robot's clock; the navigator's are of images.
            message.header.stamp = self.get_clock().now().to_msg()
            message.header.frame_id = "base_link"
            twist = message.twist
        twist.linear.x, twist.angular.z = linear, turn
        publisher.publish(message)

    def _send_tilt(self, payload: bytes) -> None:
        if "cmd_tilt" not in self._commands or len(payload) != 12:
            return
        kind, publisher = self._commands["cmd_tilt"]
        (tilt,) = struct.unpack_from("<d" if payload[1] & 1 else ">d", payload, 4)
        if not abs(tilt) < MOST_TILT_RAD:
            return
        if kind == FLOAT:
            publisher.publish(payload)
            return
        if self._tilt is not None and abs(tilt - self._tilt) < TILT_STEP_RAD:
            return
        self._tilt = tilt
        topic = self._settings.topics["cmd_tilt"]
        point = _message("trajectory_msgs/msg/JointTrajectoryPoint")()
        point.positions = [topic.sign * tilt]
        point.time_from_start.nanosec = int(1e9 * TILT_REACH_S)
        message = publisher.msg_type()
        message.joint_names, message.points = [topic.joint], [point]
        publisher.publish(message)

    def _subscribe_zenoh(self, topic: str, take: Any) -> None:
        def receive(sample: zenoh.Sample) -> None:
            take(sample.payload.to_bytes())

        handler = zenoh.handlers.Callback(receive, indirect=False)
        self._session.declare_subscriber(f"{self._robot}/{topic}", handler)

    def _message_class(self, kind: str, stream: Stream) -> Any:
        try:
            return _message(kind)
        except (ImportError, AttributeError) as error:
            package = kind.split("/", 1)[0].replace("_", "-")
            stream.problem = f"needs the package ros-$ROS_DISTRO-{package}: {error}"
            return None

    def _report_missing(self, types: dict[str, list[str]]) -> None:
        for key, stream in self.streams.items():
            if stream.publishers == 0:
                others = self._others(stream.topic, STREAMS[key][1], types)
                self._report(key, f"{key}: nobody publishes {stream.topic.name}{others}")
            elif stream.problem:
                self._report(key, f"{key}: {stream.topic.name} {stream.problem}")
        for key, topic in self._settings.topics.items():
            if key in PUBLISHED and key not in self._commands:
                self._report(
                    key, f"{key}: nobody subscribes to {topic.name} with a type that is carried "
                    f"({' or '.join(COMMANDS[key][1])}): the robot will not move"
                )  # fmt: skip
        if self.count_publishers("/clock") and not self.get_parameter("use_sim_time").value:
            self._report(
                "clock", "/clock is published, and this node goes by another clock: commands would "
                "have stamps of another time; start it with --ros-args -p use_sim_time:=true"
            )  # fmt: skip
        if self.navigation is not None and self.navigation.problem():
            self._report("goals", f"{self.navigation.problem()}: the robot will not move")

    def _find_navigation(self) -> tuple[Goals | None, GoalTopic | GoalAction | None]:
        """Return what carries goals to a robot that navigates by itself; None for others.

        Raises:
            Ros2Error: ROS 2 has no such message or action.
        """
        key = next((key for key in GOALS if key in self._settings.topics), None)
        if key is None:
            return None, None
        kind = GoalAction if key == "navigate" else GoalTopic

        def ended(goal: bytes, code: int) -> None:
            goals.ended(goal, code)

        try:
            navigation = kind(self, self._settings.topics[key], ended)
        except ImportError as error:
            package = kind.kind.split("/", 1)[0].replace("_", "-")
            raise Ros2Error(
                f"`ros2: {key}` needs the package ros-$ROS_DISTRO-{package}: {error}"
            ) from error
        status = self._session.declare_publisher(f"{self._robot}/navigation/status")
        goals = Goals(navigation, lambda stamp, code: status.put(goal_status(stamp, code)))

        def take(payload: bytes) -> None:
            self.driver.release()
            goals.take_goal(payload, time.monotonic())

        def keep(payload: bytes) -> None:
            goals.take_active(payload, time.monotonic())

        self._subscribe_zenoh("navigation/goal", with_pose(take))
        self._subscribe_zenoh("navigation/active", with_pose(keep))
        return goals, navigation

    def tick(self) -> None:
        """Stop the robot where the navigator has fallen silent."""
        self.driver.tick(time.monotonic())
        if self.goals is not None:
            self.goals.tick(time.monotonic())

    def stop(self) -> None:
        """Stop the robot now."""
        self.driver.stop()
        if self.goals is not None:
            self.goals.stop()

    def _report(self, key: str, text: str) -> None:
        if key not in self._reported:
            self._reported.add(key)
            logger.warning("%s", text)


def _message(kind: str) -> Any:
    package, _, name = kind.split("/")
    return getattr(importlib.import_module(f"{package}.msg"), name)

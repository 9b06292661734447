"""Velocities and tilt of the navigator on their way to the robot's topics."""

# pyright: reportMissingImports=false
from __future__ import annotations

import logging
import struct
import time
from typing import TYPE_CHECKING, Any

from rclpy.qos import QoSProfile, ReliabilityPolicy

from .interfaces import interface, package_of
from .rates import TiltSteps
from .settings import COMMANDS, FLOAT, PUBLISHED, TWIST_STAMPED, Settings, Topic

try:
    from rclpy.event_handler import PublisherEventCallbacks
except ImportError:  # Before ROS 2 Iron.
    from rclpy.qos_event import PublisherEventCallbacks

if TYPE_CHECKING:
    from collections.abc import Callable

    from rclpy.node import Node

logger = logging.getLogger(__name__)

MOST_TILT_RAD = 3.2
TILT_REACH_S = 0.3
"""Time in which a trajectory reaches the camera's tilt."""


class Commands:
    """Publishes commands in the types that the robot's nodes subscribe to.

    Args:
        node: That publishes.
        settings: Topics of the robot.
        report: Called with a key and a text for what the user has to know, once for each key.
    """

    def __init__(self, node: Node, settings: Settings, report: Callable[[str, str], None]) -> None:
        self._node, self._report = node, report
        self._topics = {key: t for key, t in settings.topics.items() if key in PUBLISHED}
        self._publishers: dict[str, tuple[str, Any]] = {}
        self._tilt_steps = TiltSteps()

    def follow(self, types: dict[str, list[str]]) -> None:
        """Publish where somebody has subscribed.

        Args:
            types: Types of each topic that there is.
        """
        for key, topic in self._topics.items():
            if key not in self._publishers:
                self._try_to_publish(key, topic, types.get(topic.name, []))

    def rows(self) -> list[tuple[str, str, str, str]]:
        """Return key, topic, problem (empty for none) and type of each command."""
        found: list[tuple[str, str, str, str]] = []
        for key, topic in self._topics.items():
            kind = self._publishers[key][0] if key in self._publishers else ""
            problem = "" if kind else f"no subscriber with {' or '.join(COMMANDS[key][1])}"
            found.append((key, topic.name, problem, kind))
        return found

    def problems(self) -> dict[str, str]:
        """Return what keeps each command from the robot."""
        return {
            key: f"{key}: nobody subscribes to {topic.name} with a type that is carried "
            f"({' or '.join(COMMANDS[key][1])}): the robot will not move"
            for key, topic in self._topics.items()
            if key not in self._publishers
        }

    def send_velocity(self, linear: float, turn: float) -> None:
        """Publish forward speed (m/s) and turn (rad/s)."""
        if "cmd_vel" not in self._publishers:
            return
        kind, publisher = self._publishers["cmd_vel"]
        message = publisher.msg_type()
        twist = message
        if kind == TWIST_STAMPED:
            # Controllers compare stamps with the robot's clock; the navigator's are of images.
            message.header.stamp = self._node.get_clock().now().to_msg()
            message.header.frame_id = "base_link"
            twist = message.twist
        twist.linear.x, twist.angular.z = linear, turn
        publisher.publish(message)

    def send_tilt(self, payload: bytes) -> None:
        """Publish the tilt of a serialized Float64, radians."""
        if "cmd_tilt" not in self._publishers or len(payload) != 12:
            return
        kind, publisher = self._publishers["cmd_tilt"]
        (tilt,) = struct.unpack_from("<d" if payload[1] & 1 else ">d", payload, 4)
        if not abs(tilt) < MOST_TILT_RAD:
            return
        if kind == FLOAT:
            publisher.publish(payload)
        elif self._tilt_steps.is_due(tilt, time.monotonic()):
            publisher.publish(_trajectory(publisher.msg_type, self._topics["cmd_tilt"], tilt))

    def _try_to_publish(self, key: str, topic: Topic, types: list[str]) -> None:
        accepted = COMMANDS[key][1]
        subscribed = bool(self._node.get_subscriptions_info_by_topic(topic.name))
        kind = topic.type or next((one for one in accepted if one in types), None)
        if kind is None or not (subscribed or topic.type):
            return
        try:
            message = interface(kind)
        except (ImportError, AttributeError) as error:
            self._report(key, f"{key}: {topic.name} needs the package {package_of(kind)}: {error}")
            return
        events = PublisherEventCallbacks(
            incompatible_qos=lambda _: self._report(
                f"{key} qos", f"{key}: a subscriber of {topic.name} asks for a quality of service "
                "that commands do not have (reliable, volatile, depth 1)"
            ),
            use_default_callbacks=False,
        )  # fmt: skip
        qos = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE)
        publisher = self._node.create_publisher(message, topic.name, qos, event_callbacks=events)
        self._publishers[key] = kind, publisher
        logger.info("%s: %s (%s)", key, topic.name, kind)


def _trajectory(message_class: Any, topic: Topic, tilt_rad: float) -> Any:
    point = interface("trajectory_msgs/msg/JointTrajectoryPoint")()
    point.positions = [topic.sign * tilt_rad]
    point.time_from_start.nanosec = int(1e9 * TILT_REACH_S)
    message = message_class()
    message.joint_names, message.points = [topic.joint], [point]
    return message

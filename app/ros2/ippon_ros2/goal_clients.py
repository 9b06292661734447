"""Ways to a robot's own navigation: Nav2's action NavigateToPose, or a topic of goals."""

# pyright: reportMissingImports=false
from __future__ import annotations

import importlib
import logging
import math
from collections import deque
from collections.abc import Callable
from typing import Any

from rclpy.action import ActionClient
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message

from .goals import ACCEPTED, CANCELLED, FAILED, REACHED, Ended
from .settings import NAVIGATE, POSE, Topic

logger = logging.getLogger(__name__)

_STATUSES = {4: REACHED, 5: CANCELLED, 6: FAILED}


class GoalTopic:
    """A topic of PoseStamped. Its robot says nothing: a cancelled goal is one where it stands."""

    kind = POSE

    def __init__(self, node: Node, topic: Topic, ended: Ended) -> None:
        self._node, self._topic, self._ended = node, topic, ended
        self.name = topic.name
        self._class = _interface(POSE)
        qos = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE)
        self._publisher = node.create_publisher(self._class, topic.name, qos)

    def problem(self) -> str:
        """Return why nobody takes goals; empty where somebody does."""
        there = self._node.get_subscriptions_info_by_topic(self._topic.name)
        return "" if there else f"nobody subscribes to {self._topic.name} with {POSE}"

    def send(self, goal: bytes) -> bool:
        """See `Navigation.send`."""
        if self.problem():
            return False
        self._publisher.publish(_pose_of(goal, self._class, self._topic.frame))
        self._ended(goal, ACCEPTED)
        return True

    def cancel(self, here: bytes) -> None:
        """See `Navigation.cancel`."""
        if here:
            self._publisher.publish(_pose_of(here, self._class, self._topic.frame))


class GoalAction:
    """Nav2's action NavigateToPose. All calls of ROS 2 are made by the executor's thread."""

    kind = NAVIGATE

    def __init__(self, node: Node, topic: Topic, ended: Ended) -> None:
        self._topic, self._ended = topic, ended
        self.name = topic.name
        self._action = _interface(NAVIGATE)
        self._pose = _interface(POSE)
        self._client = ActionClient(node, self._action, topic.name)
        self._wanted = b""
        self._handle: Any = None
        self._calls: deque[Callable[[], None]] = deque()
        self._wake = node.create_guard_condition(self._run_calls)

    def problem(self) -> str:
        """Return why nobody takes goals; empty where somebody does."""
        if self._client.server_is_ready():
            return ""
        return f"nobody serves the action {self._topic.name} ({NAVIGATE})"

    def send(self, goal: bytes) -> bool:
        """See `Navigation.send`."""
        if not self._client.server_is_ready():
            return False
        self._call(lambda: self._send(goal))
        return True

    def cancel(self, here: bytes) -> None:
        """See `Navigation.cancel`."""
        del here
        self._call(self._cancel)

    def _call(self, call: Callable[[], None]) -> None:
        self._calls.append(call)
        self._wake.trigger()

    def _run_calls(self) -> None:
        while self._calls:
            self._calls.popleft()()

    def _send(self, goal: bytes) -> None:
        # Nav2 replaces its goal by a new one: the old one need not be cancelled first.
        self._wanted, self._handle = goal, None
        request = self._action.Goal()
        request.pose = _pose_of(goal, self._pose, self._topic.frame)
        answer = self._client.send_goal_async(request)
        answer.add_done_callback(lambda future: self._answered(goal, future.result()))

    def _answered(self, goal: bytes, handle: Any) -> None:
        if not handle.accepted:
            logger.warning("the robot's navigation refuses the goal")
            self._ended(goal, FAILED)
            return
        self._ended(goal, ACCEPTED)
        handle.get_result_async().add_done_callback(
            lambda future: self._finished(goal, future.result())
        )
        if goal == self._wanted:
            self._handle = handle
        else:
            handle.cancel_goal_async()

    def _finished(self, goal: bytes, response: Any) -> None:
        code = getattr(response.result, "error_code", 0)
        if response.status == 6:
            text = getattr(response.result, "error_msg", "")
            logger.warning("the robot's navigation gave up the goal (error %s %s)", code, text)
        self._ended(goal, _STATUSES.get(response.status, FAILED))

    def _cancel(self) -> None:
        self._wanted = b""
        if self._handle is not None:
            self._handle.cancel_goal_async()
            self._handle = None


def _interface(name: str) -> Any:
    package, kind, message = name.split("/")
    return getattr(importlib.import_module(f"{package}.{kind}"), message)


def _pose_of(payload: bytes, message: Any, frame: str) -> Any:
    pose = deserialize_message(payload, message)
    at, turn = pose.pose.position, pose.pose.orientation
    numbers = (at.x, at.y, at.z, turn.x, turn.y, turn.z, turn.w)
    if not all(math.isfinite(number) for number in numbers):
        raise ValueError(f"a goal needs finite numbers; got {numbers}")
    if frame:
        pose.header.frame_id = frame
    return pose

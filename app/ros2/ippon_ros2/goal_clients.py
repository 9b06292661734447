"""Ways to a robot's own navigation: Nav2's action NavigateToPose, or a topic of goals."""

# pyright: reportMissingImports=false
from __future__ import annotations

import logging
import os
import time
from collections import deque
from collections.abc import Callable
from typing import Any

from rclpy.action import ActionClient
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message

from .goals import ACCEPTED, CANCELLED, EVERY_GOAL, FAILED, REACHED, Ended
from .interfaces import interface
from .settings import NAVIGATE, POSE, Topic

logger = logging.getLogger(__name__)

CANCEL, UUID = "action_msgs/srv/CancelGoal", "unique_identifier_msgs/msg/UUID"
ANSWER_S = 5.0
"""How long a server may take to accept or refuse a goal."""
AGAIN_S = 1.0
"""Time after which what was not confirmed is cancelled again."""
MOST_GOALS = 20
_REJECTED = 1
"""Of action_msgs/CancelGoal: nothing was cancelled."""
_STATUSES = {4: REACHED, 5: CANCELLED, 6: FAILED}


class GoalTopic:
    """A topic of PoseStamped. Its robot says nothing: a cancelled goal is one where it stands."""

    kind = POSE

    def __init__(self, node: Node, topic: Topic, ended: Ended) -> None:
        self._node, self._topic, self._ended = node, topic, ended
        self.name = topic.name
        self._class = interface(POSE)
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

    def cancel_every(self, here: bytes) -> bool:
        """See `Navigation.cancel_every`."""
        if not here or self.problem():
            return False
        self.cancel(here)
        return True


class GoalAction:
    """Nav2's action NavigateToPose. All calls of ROS 2 are made by the executor's thread."""

    kind = NAVIGATE

    def __init__(self, node: Node, topic: Topic, ended: Ended) -> None:
        self._topic, self._ended = topic, ended
        self.name = topic.name
        self._action, self._cancelling = interface(NAVIGATE), interface(CANCEL)
        self._pose = interface(POSE)
        self._client = ActionClient(node, self._action, topic.name)
        self._cancels = node.create_client(self._cancelling, f"{topic.name}/_action/cancel_goal")
        self._last = b""
        """Number of the last goal that was sent."""
        self._wanted = False
        """The robot is to drive to it."""
        self._unanswered: dict[bytes, tuple[bytes, float]] = {}
        """Goals that the server has neither accepted nor refused, by number, and when they went."""
        self._accepted = [EVERY_GOAL]
        """Goals that the server may drive to, at first all from before this program: where it gives
        up a goal that was to replace another, Nav2 goes on to the other."""
        self._uncancelled: dict[bytes, Any] = {}
        """Goals to cancel that the server has not confirmed, by number."""
        self._calls: deque[Callable[[], None]] = deque()
        self._wake = node.create_guard_condition(self._run_calls)
        node.create_timer(AGAIN_S, self._repeat)

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
        self._call(self._cancel_wanted)

    def cancel_every(self, here: bytes) -> bool:
        """See `Navigation.cancel_every`."""
        if not self._client.server_is_ready():
            return False
        self.cancel(here)
        return True

    def _call(self, call: Callable[[], None]) -> None:
        self._calls.append(call)
        self._wake.trigger()

    def _run_calls(self) -> None:
        while self._calls:
            self._calls.popleft()()

    def _send(self, goal: bytes) -> None:
        # Nav2 replaces its goal by a new one: the old one need not be cancelled first.
        number = os.urandom(16)
        self._last, self._wanted = number, True
        if EVERY_GOAL in self._uncancelled:
            # Repeated, it would cancel this one, too.
            self._forget_cancel(EVERY_GOAL)
            self._accepted.append(EVERY_GOAL)
        self._unanswered[number] = goal, time.monotonic()
        request = self._action.Goal()
        request.pose = _pose_of(goal, self._pose, self._topic.frame)
        answer = self._client.send_goal_async(request, goal_uuid=interface(UUID)(uuid=list(number)))
        answer.add_done_callback(lambda future: self._answered(goal, number, future.result()))

    def _answered(self, goal: bytes, number: bytes, handle: Any) -> None:
        """Take the server's answer to a goal; None where none came in time."""
        in_time = self._unanswered.pop(number, None) is not None
        is_accepted = handle is not None and handle.accepted
        is_wanted = in_time and number == self._last and self._wanted
        if is_accepted and is_wanted:
            self._accepted = [*self._accepted[1 - MOST_GOALS :], number]
        if handle is None or (is_accepted and not is_wanted):
            # Without an answer, the goal may have been accepted all the same.
            self._cancel(number)
        if handle is not None and handle.accepted:
            handle.get_result_async().add_done_callback(
                lambda future: self._finished(goal, number, future.result())
            )
        elif in_time:
            silent = "does not answer" if handle is None else "refuses the goal"
            logger.warning("the robot's navigation %s", silent)
        if in_time and number == self._last:
            self._report(goal, ACCEPTED if is_accepted else FAILED)

    def _finished(self, goal: bytes, number: bytes, response: Any) -> None:
        self._accepted = [one for one in self._accepted if one != number]
        self._forget_cancel(number)
        if number != self._last:
            return
        code = getattr(response.result, "error_code", 0)
        if response.status == 6:
            text = getattr(response.result, "error_msg", "")
            logger.warning("the robot's navigation gave up the goal (error %s %s)", code, text)
        self._report(goal, _STATUSES.get(response.status, FAILED))

    def _report(self, goal: bytes, status: int) -> None:
        """Say what became of the last goal; the robot drives to no other one after its end."""
        if status != ACCEPTED:
            self._cancel_accepted()
        self._ended(goal, status)

    def _cancel_wanted(self) -> None:
        self._wanted = False
        self._cancel_accepted()

    def _cancel_accepted(self) -> None:
        numbers, self._accepted = self._accepted, []
        for number in numbers:
            self._cancel(number)

    def _cancel(self, number: bytes) -> None:
        """Cancel a goal; `_repeat` does it again until the server answers."""
        self._forget_cancel(number)
        while len(self._uncancelled) >= MOST_GOALS:
            self._forget_cancel(next(iter(self._uncancelled)))
        request = self._cancelling.Request()
        request.goal_info.goal_id.uuid = list(number)
        answer = self._cancels.call_async(request)
        self._uncancelled[number] = answer
        answer.add_done_callback(lambda future: self._cancelled(number, future.result()))

    def _forget_cancel(self, number: bytes) -> None:
        answer = self._uncancelled.pop(number, None)
        if answer is not None:
            self._cancels.remove_pending_request(answer)

    def _cancelled(self, number: bytes, response: Any) -> None:
        self._uncancelled.pop(number, None)
        if response.return_code == _REJECTED:
            logger.error("the robot's navigation refuses to cancel a goal: stop it at the robot")

    def _repeat(self) -> None:
        """Cancel what was not confirmed, and goals whose acceptance did not come.

        Calls that wait are made as well: a robot must not drive on because one wake-up was missed.
        """
        self._run_calls()
        for number in tuple(self._uncancelled):
            self._cancel(number)
        old = time.monotonic() - ANSWER_S
        for number, (goal, at) in tuple(self._unanswered.items()):
            if at < old:
                self._answered(goal, number, None)


def _pose_of(payload: bytes, message: Any, frame: str) -> Any:
    pose = deserialize_message(payload, message)
    if frame:
        pose.header.frame_id = frame
    return pose

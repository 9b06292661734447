"""Goals by Nav2's action NavigateToPose: three services, as ROS 2 makes actions of them."""

import logging
import os
import struct
import threading
from collections.abc import Iterable
from functools import partial
from typing import Final

from app.links.network.sender import Sender
from app.links.rmw_zenoh.goal_topic import in_frame
from app.links.rmw_zenoh.participant import Participant
from app.links.rmw_zenoh.protocol.tokens import Entity
from app.links.rmw_zenoh.services import ServiceClient
from app.ros2.ippon_ros2.goals import ACCEPTED, CANCELLED, EVERY_GOAL, FAILED, REACHED, Ended
from app.ros2.ippon_ros2.settings import NAVIGATE, Topic

logger = logging.getLogger(__name__)

ANSWER_S: Final = 5.0
"""How long a server may take to accept, refuse or cancel a goal."""
DRIVE_S: Final = 3600.0
"""How long a robot may drive to a goal."""
MOST_GOALS: Final = 20
_CDR: Final = b"\0\1\0\0"
_NO_BEHAVIOR_TREE: Final = struct.pack("<I", 1) + b"\0"
_CANCEL: Final = "action_msgs/srv/CancelGoal"
_REJECTED: Final = 1
"""Of action_msgs/CancelGoal: nothing was cancelled."""
_ERROR: Final = struct.Struct("<H")


class GoalAction:
    """The action of a robot's own navigation. What it uses is the same in all versions of Nav2.

    Args:
        participant: Of the robot's graph.
        topic: Name of the action, and the frame of its goals.
        ended: Takes a goal with its status.
    """

    def __init__(self, participant: Participant, topic: Topic, ended: Ended) -> None:
        self._name, self._frame, self._ended = topic.name, topic.frame, ended
        under = f"{topic.name}/_action"
        self._send_goal = ServiceClient(participant, f"{under}/send_goal", f"{NAVIGATE}_SendGoal")
        self._result = ServiceClient(participant, f"{under}/get_result", f"{NAVIGATE}_GetResult")
        self._cancel_goal = ServiceClient(participant, f"{under}/cancel_goal", _CANCEL)
        self._lock = threading.Lock()
        self._there = False
        self._last = b""
        """Number of the last goal that was sent."""
        self._wanted = False
        """The robot is to drive to it."""
        self._accepted = [EVERY_GOAL]
        """Goals that the server may drive to, at first all from before this program: where it gives
        up a goal that was to replace another, Nav2 goes on to the other."""
        self._uncancelled: dict[bytes, bool] = {}
        """Goals to cancel that the server has not confirmed, and whether an answer is awaited."""
        self._calls = Sender()

    def follow(self, entities: Iterable[Entity]) -> str:
        """Find the action's server; return why nobody takes goals, empty where somebody does."""
        found = tuple(entities)
        services = (self._send_goal, self._result, self._cancel_goal)
        there = [service.follow(found) for service in services]
        self._there = all(there)
        with self._lock:
            again = [number for number, awaited in self._uncancelled.items() if not awaited]
        for number in again if self._there else ():
            self._cancel(number)
        return "" if self._there else f"nobody serves the action {self._name} ({NAVIGATE})"

    def send(self, goal: bytes) -> bool:
        """See `Navigation.send`."""
        if not self._there:
            return False
        pose = in_frame(goal, self._frame)
        number = os.urandom(16)
        with self._lock:
            # Nav2 replaces its goal by a new one: the old one need not be cancelled first.
            self._last, self._wanted = number, True
            if self._uncancelled.pop(EVERY_GOAL, None) is not None:
                # Repeated, it would cancel this one, too.
                self._accepted.append(EVERY_GOAL)
        request = _CDR + number + pose[len(_CDR) :] + _NO_BEHAVIOR_TREE
        answered = partial(self._answered, goal, number)
        self._later(partial(self._send_goal.call, request, ANSWER_S, answered))
        return True

    def cancel(self, here: bytes) -> None:
        """See `Navigation.cancel`."""
        del here
        with self._lock:
            self._wanted = False
        self._cancel_accepted()

    def cancel_every(self, here: bytes) -> bool:
        """See `Navigation.cancel_every`."""
        if not self._there:
            return False
        self.cancel(here)
        return True

    def close(self) -> None:
        """Send what is queued."""
        self._calls.close()
        for service in (self._send_goal, self._result, self._cancel_goal):
            service.close()

    def _answered(self, goal: bytes, number: bytes, response: bytes | None) -> None:
        is_accepted = bool(response and response[len(_CDR) : len(_CDR) + 1] > b"\0")
        with self._lock:
            is_last = number == self._last
            is_wanted = is_last and self._wanted
            if is_accepted and is_wanted:
                self._accepted = [*self._accepted[1 - MOST_GOALS :], number]
        if response is None or (is_accepted and not is_wanted):
            # Without an answer, the goal may have been accepted all the same.
            self._cancel(number)
        if is_accepted:
            finished = partial(self._finished, goal, number)
            self._later(partial(self._result.call, _CDR + number, DRIVE_S, finished))
        else:
            silent = "does not answer" if response is None else "refuses the goal"
            logger.warning("the robot's navigation %s", silent)
        if is_last:
            self._report(goal, ACCEPTED if is_accepted else FAILED)

    def _finished(self, goal: bytes, number: bytes, response: bytes | None) -> None:
        with self._lock:
            is_last = number == self._last
            self._accepted = [one for one in self._accepted if one != number]
        if response is None:
            # The robot may still drive.
            self._cancel(number)
        if not is_last:
            return
        status = response[len(_CDR)] if response and len(response) > len(_CDR) else FAILED
        if status == FAILED:
            at = len(_CDR) + _ERROR.size
            whole = response is not None and len(response) >= at + _ERROR.size
            code = _ERROR.unpack_from(response, at)[0] if whole and response else 0
            logger.warning("the robot's navigation gave up the goal (error %d)", code)
        self._report(goal, status if status in (REACHED, CANCELLED, FAILED) else FAILED)

    def _report(self, goal: bytes, status: int) -> None:
        """Say what became of the last goal; the robot drives to no other one after its end."""
        if status != ACCEPTED:
            self._cancel_accepted()
        self._later(partial(self._ended, goal, status))

    def _cancel_accepted(self) -> None:
        with self._lock:
            numbers, self._accepted = self._accepted, []
        for number in numbers:
            self._cancel(number)

    def _cancel(self, number: bytes) -> None:
        """Cancel a goal; `follow` does it again until the server answers."""
        with self._lock:
            self._uncancelled[number] = True
            while len(self._uncancelled) > MOST_GOALS:
                del self._uncancelled[next(iter(self._uncancelled))]
        request, answered = _CDR + number + bytes(8), partial(self._cancelled, number)
        self._later(partial(self._cancel_goal.call, request, ANSWER_S, answered))

    def _cancelled(self, number: bytes, response: bytes | None) -> None:
        with self._lock:
            awaited = self._uncancelled.pop(number, None) is not None
            if response is None and awaited:
                self._uncancelled[number] = False
        if response is None:
            logger.warning("the robot's navigation did not confirm that a goal is cancelled")
        elif len(response) > len(_CDR) and response[len(_CDR)] == _REJECTED:
            logger.error("the robot's navigation refuses to cancel a goal: stop it at the robot")

    def _later(self, call: partial[None]) -> None:
        # Not in zenoh's network thread, which must not use the session.
        self._calls.put(0, call)

"""The goal of the navigator on its way to the robot's own navigation."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from typing import Protocol

from .serialized import check_pose, stamp_bytes_of

logger = logging.getLogger(__name__)

WATCHDOG_S = 0.5
"""Silence of the navigator from which the goal is cancelled."""
ACCEPTED, REACHED, CANCELLED, FAILED = 1, 4, 5, 6
"""Of action_msgs/GoalStatus."""
NO_GOAL = bytes(8)
EVERY_GOAL = bytes(16)
"""Number that stands for all goals of a server in action_msgs/CancelGoal."""

Ended = Callable[[bytes, int], None]
"""Takes a goal with its status."""


class Navigation(Protocol):
    """What drives the robot: an action server, or a subscriber of a topic."""

    def send(self, goal: bytes) -> bool:
        """Start driving to a serialized PoseStamped; False where nobody takes it now."""
        ...

    def cancel(self, here: bytes) -> None:
        """Stop; `here` is the serialized PoseStamped where the robot stands, empty if unknown."""
        ...

    def cancel_every(self, here: bytes) -> bool:
        """Stop, whoever gave the goal; False where nobody can be told now. `here` as above."""
        ...


class Goals:
    """Passes each goal on once, and cancels it when the navigator says so or falls silent.

    Args:
        navigation: Of the robot.
        report: Publishes the status (of action_msgs/GoalStatus) of the goal with a stamp.
    """

    def __init__(self, navigation: Navigation, report: Callable[[bytes, int], None]) -> None:
        self._navigation = navigation
        self._report = report
        self._lock = threading.RLock()
        self._goal = b""
        self._driving = self._ended = self._waiting = self._stopped = False
        self._earlier = True
        """The robot may drive to a goal from before this program ran."""
        self._here = b""
        self._at = 0.0
        self.sent = 0

    def take_goal(self, payload: bytes, now: float) -> None:
        """Drive to a new goal; one that was sent already is not sent again."""
        with self._lock:
            if stamp_bytes_of(payload) in (b"", stamp_bytes_of(self._goal)):
                return
            self._goal, self._at, self._ended = payload, now, False
            self._start()

    def take_active(self, payload: bytes, now: float) -> None:
        """Take the stamp of the goal in force, 0 for none, and the pose of the robot."""
        stamp = stamp_bytes_of(payload)
        if not stamp:
            return
        with self._lock:
            self._here = payload
            if stamp == NO_GOAL:
                self._stop("the navigator has cancelled the goal", payload)
                self._goal = b""
                return
            self._at = now
            if stamp != stamp_bytes_of(self._goal):
                # It was sent before this bridge ran, or was lost: the navigator sends another one.
                self._stop("another goal is in force: this one is cancelled", payload)
                self._say(stamp, CANCELLED)
            elif not self._driving and not self._ended:
                self._start()

    def ended(self, goal: bytes, status: int) -> None:
        """Take a status from the robot's navigation; that of an earlier goal is no news."""
        with self._lock:
            if goal == self._goal:
                if status == ACCEPTED:
                    self._earlier = False  # It has taken the place of any other.
                if status in (REACHED, FAILED, CANCELLED):
                    if not self._driving and status == CANCELLED:
                        return  # The bridge cancelled it itself and may go on with it.
                    self._ended, self._driving = True, False
                self._say(stamp_bytes_of(goal), status)

    def lost(self) -> None:
        """Note that nobody takes goals now: the one in force is sent again once somebody does."""
        with self._lock:
            if self._driving:
                self._driving = False
                logger.warning("who took the goal has gone: it is sent again to who comes back")

    def tick(self, now: float) -> None:
        """Cancel the goal where the navigator has fallen silent."""
        with self._lock:
            if now - self._at > WATCHDOG_S:
                self._stop(f"the navigator is silent for {WATCHDOG_S:g} s: the goal is cancelled")

    def stop(self) -> None:
        """Cancel the goal now; goals that arrive after it are not sent."""
        with self._lock:
            self._stopped = True
            self._stop("the goal is cancelled")

    def _start(self) -> None:
        if self._stopped:
            return
        is_sent = self._navigation.send(self._goal)
        if not is_sent:
            self._stop("nobody takes the new goal: the old one is cancelled")
        self._driving = is_sent
        if is_sent:
            self.sent += 1
            self._waiting = False
        elif not self._waiting:
            self._waiting = True
            logger.warning("nobody takes goals yet: this one waits")

    def _stop(self, why: str, here: bytes = b"") -> None:
        if self._driving:
            self._driving = False
            logger.info("%s", why)
            self._navigation.cancel(self._here)
        # Once: goals that somebody else gives later are not the navigator's. Only a place of now
        # will do for a topic: to an old one the robot would drive back.
        if self._earlier and self._navigation.cancel_every(here):
            self._earlier = False
            logger.info("goals from before this start are cancelled, if there are any")

    def _say(self, stamp: bytes, status: int) -> None:
        if stamp:
            self._report(stamp, status)


def with_pose(take: Callable[[bytes], None]) -> Callable[[bytes], None]:
    """Return what passes on a PoseStamped that can be driven to: the watchdog uses it, too."""

    def check(payload: bytes) -> None:
        try:
            check_pose(payload)
        except ValueError as error:
            logger.warning("a goal was refused: %s", error)
            return
        take(payload)

    return check

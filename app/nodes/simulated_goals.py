"""The goal of the navigator, as a simulated robot that navigates by itself keeps it."""

import threading
import time
from typing import Final

from app.messages.navigation import StampedPose, decode_pose
from ippon.command import NavigationGoal
from ippon.geometry import yaw_of

WATCHDOG_S: Final = 0.5
"""Silence of the navigator from which the goal is cancelled."""


class SimulatedGoals:
    """Takes `navigation/goal` and `navigation/active`; safe from any thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._goal: StampedPose | None = None
        self._active_ns = 0
        self._at = 0.0

    def take_goal(self, payload: bytes) -> None:
        """Keep a goal; raises MessageError."""
        goal = decode_pose(payload)
        with self._lock:
            self._goal, self._active_ns, self._at = goal, goal.stamp_ns, time.monotonic()

    def take_active(self, payload: bytes) -> None:
        """Keep the stamp of the goal in force; raises MessageError."""
        active = decode_pose(payload)
        with self._lock:
            self._active_ns, self._at = active.stamp_ns, time.monotonic()

    def in_force(self, now: float) -> NavigationGoal | None:
        """Return the goal to drive to, numbered by its stamp; `now` is monotonic seconds."""
        with self._lock:
            goal, active_ns, at = self._goal, self._active_ns, self._at
        if goal is None or goal.stamp_ns != active_ns or now - at > WATCHDOG_S:
            return None
        x, y, _ = goal.T_frame_base[:3, 3].tolist()
        yaw = yaw_of(goal.T_frame_base)
        return NavigationGoal(number=goal.stamp_ns, x_m=x, y_m=y, yaw_rad=yaw)

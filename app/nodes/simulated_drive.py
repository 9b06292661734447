"""Velocity commands on their way to the simulated base, and how it moved between them."""

import threading
from collections import deque
from typing import Final

from app.messages.motion import StampedTwist
from ippon.frame import NANOSECONDS
from ippon.simulation.robot.mobile_base import SimulatedBase

LATEST_S: Final = 1.0
"""Age of the image that a command answers from which it is not followed: a slow network delivers
commands at their rate, and each of them seconds late."""
SPEEDS_KEPT: Final = 6000

Speed = tuple[float, float, float]
"""Linear and yaw rate, and the time since the last command that was followed (m/s, rad/s, s)."""


class SimulatedDrive:
    """Keeps the newest command until the next step; safe from any thread.

    Args:
        speed: Seconds of the robot in a second of real time.
    """

    def __init__(self, speed: float = 1.0) -> None:
        self._latest_ns = round(LATEST_S * speed * NANOSECONDS)
        self._lock = threading.Lock()
        self._twist: StampedTwist | None = None
        self._followed_ns = 0
        self._speeds: deque[Speed] = deque(maxlen=SPEEDS_KEPT)

    def take(self, twist: StampedTwist) -> None:
        """Take a command."""
        with self._lock:
            self._twist = twist

    def fresh(self, stamp_ns: int) -> StampedTwist | None:
        """Return the command since the last call; None where there is none, or a late one.

        Args:
            stamp_ns: The robot's clock. The stamp of a command is that of the image that it
                answers; 0 is the stamp of one that answers none.
        """
        with self._lock:
            twist, self._twist = self._twist, None
            if twist is None or 0 < twist.stamp_ns < stamp_ns - self._latest_ns:
                return None
            self._followed_ns = stamp_ns
            return twist

    def note(self, base: SimulatedBase, stamp_ns: int) -> None:
        """Note how the base moves after a step."""
        with self._lock:
            age_s = (stamp_ns - self._followed_ns) / NANOSECONDS
            self._speeds.append((base.linear_m_s, base.yaw_rate_rad_s, age_s))

    def speeds(self) -> list[Speed]:
        """Return the speeds of the last steps, two minutes of real time."""
        with self._lock:
            return list(self._speeds)

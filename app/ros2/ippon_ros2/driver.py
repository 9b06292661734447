"""Commands of the navigator on their way to the wheels."""

from __future__ import annotations

import logging
import math
import struct
import threading
from collections.abc import Callable

from .serialized import velocity_of

logger = logging.getLogger(__name__)

WATCHDOG_S = 0.3
"""Age of a command from which the robot gets zero velocity."""
LATEST_S = 1.0
"""Age of the image that a command answers from which the robot gets zero velocity instead."""
ZEROS_S = 1.0
"""How long zero velocity is repeated; after that another source may drive the robot."""


class Driver:
    """Commands of the navigator, made safe: limits of speed, and zero velocity when they stop.

    Args:
        send: Publishes forward speed (m/s) and turn (rad/s) on the robot.
        max_linear_m_s: Of the robot.
        max_yaw_rate_rad_s: Of the robot.
    """

    def __init__(
        self, send: Callable[[float, float], None], max_linear_m_s: float, max_yaw_rate_rad_s: float
    ) -> None:
        self._send = send
        self._limits = max_linear_m_s, max_yaw_rate_rad_s
        self._lock = threading.Lock()
        self._at = -math.inf
        self._stamp = -math.inf
        self._moving = self._driving = False
        self._zeros_until = -math.inf
        self._image: tuple[float, float] | None = None
        self._late = self._stopped = False
        self.refused = self.clamped = 0

    def saw_image(self, stamp: float, now: float) -> None:
        """Note an image on its way to the navigator: stamp (s), and the time that it passed."""
        self._image = stamp, now

    def take(self, payload: bytes, now: float) -> None:
        """Pass on a serialized TwistStamped that has just arrived; `now` is monotonic seconds."""
        try:
            stamp, linear, turn = velocity_of(payload)
        except (ValueError, struct.error) as error:
            self.refused += 1
            if self.refused == 1:
                logger.warning("a command was refused: %s", error)
            return
        with self._lock:
            if self._stopped:
                return
            if self._stamp - 1.0 < stamp < self._stamp:
                return  # It was overtaken on its way.
            self._stamp = stamp
            self._at = now
            if not self._driving:
                logger.info("commands arrive")
            self._driving = True
            safe = _within(linear, self._limits[0]), _within(turn, self._limits[1])
            if safe != (linear, turn):
                self.clamped += 1
                if self.clamped == 1:
                    logger.warning(
                        "a command of %.2f m/s and %.2f rad/s exceeds the profile's limits: "
                        "reduced", linear, turn,
                    )  # fmt: skip
            if safe != (0.0, 0.0) and self._is_late(stamp, now):
                safe = 0.0, 0.0
            self._moving = safe != (0.0, 0.0)
            self._send(*safe)

    def _is_late(self, stamp: float, now: float) -> bool:
        """Tell whether a command answers an image that is too old; only image stamps are compared.

        A slow network delivers commands at their rate, and each of them seconds late.
        """
        image = self._image
        if image is None or stamp == 0.0:
            return False
        age = image[0] - stamp + now - image[1]
        late = age > LATEST_S
        if late != self._late:
            self._late = late
            if late:
                logger.warning(
                    "commands answer images that are %.1f s old: the robot gets zero velocity; "
                    "the network or the navigator is too slow", age,
                )  # fmt: skip
            else:
                logger.info("commands are in time again")
        return late

    def tick(self, now: float) -> None:
        """Send zero velocity where commands have stopped; also to one that comes here late."""
        with self._lock:
            age = now - self._at
            if age < WATCHDOG_S:
                return
            if self._driving:
                self._driving = False
                self._zeros_until = now + ZEROS_S
                level = logging.WARNING if self._moving else logging.INFO
                logger.log(level, "no command for %.1f s: the robot gets zero velocity", age)
            if now <= self._zeros_until:
                self._send(0.0, 0.0)

    def release(self) -> None:
        """Leave the wheels to the robot's own navigation, without zero velocities in between."""
        with self._lock:
            self._zeros_until = -math.inf
            self._driving = False

    def stop(self) -> None:
        """Send zero velocity now; commands that arrive after it are not followed."""
        with self._lock:
            self._stopped = True
            self._zeros_until = -math.inf
            self._driving = False
            self._send(0.0, 0.0)


def _within(value: float, limit: float) -> float:
    return max(-limit, min(limit, value))

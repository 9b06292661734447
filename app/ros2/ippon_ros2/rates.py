"""Which images are carried where the profile limits their rate (`max_hz`), and which tilts."""

from __future__ import annotations

import math
import threading
from collections import deque

from .serialized import stamp_of

PAIRED_S = 0.02
"""Stamps of colour and depth that differ by no more belong together, as for the navigator."""
MOST_HELD = 8
"""Depth images that wait for the colour image of their time."""
ALONE_AFTER_S = 1.0
"""Time without a colour image after which depth images are chosen by themselves."""
TILT_STEP_RAD = 0.01
"""Least change of the tilt that begins another trajectory."""
TILT_AGAIN_S = 1.0
"""Time after which the same one is sent again: the first may have been lost, or who takes it
started again since."""


class RateLimit:
    """Passes one message of each period of stamps, so that messages of one stamp stay together."""

    def __init__(self, max_hz: float) -> None:
        self._max_hz = max_hz
        self._last: int | None = None

    def passes(self, payload: bytes) -> bool:
        """Tell whether to carry a message."""
        stamp = stamp_of(payload)
        return stamp is None or self.is_new(stamp)

    def is_new(self, stamp: float) -> bool:
        """Tell whether a stamp is the first of its period."""
        if not self._max_hz:
            return True
        period = math.floor(stamp * self._max_hz)
        new = period != self._last
        self._last = period
        return new


class PairedRates:
    """Thins colour and depth, so that a depth image is that of a colour image which is carried.

    Each by itself would do where both have one stamp. Where they differ, a period may begin with a
    colour image and the depth image of the one before it, in every period.

    Args:
        color_hz: Limit for colour images, 0 for none.
        depth_hz: Limit for depth images, 0 for none.
    """

    def __init__(self, color_hz: float, depth_hz: float) -> None:
        self._color, self._depth = RateLimit(color_hz), RateLimit(depth_hz)
        self._alone = RateLimit(depth_hz)
        self._all = depth_hz == 0.0
        self._lock = threading.Lock()
        self._held: deque[tuple[float, bytes]] = deque(maxlen=MOST_HELD)
        self._color_stamp: float | None = None
        """Of the last colour image, carried or not."""
        self._wanted: deque[float] = deque(maxlen=MOST_HELD)
        """Of the carried colour images whose depth image is still to come, oldest first."""
        self._spacing_s = 0.0

    def color(self, payload: bytes) -> tuple[bool, list[bytes]]:
        """Take a colour image; return whether to carry it, and the depth images to carry now."""
        stamp = stamp_of(payload)
        if stamp is None:
            return True, []
        with self._lock:
            self._color_stamp = stamp
            if not self._color.is_new(stamp):
                return False, []
            if self._all or not self._depth.is_new(stamp):
                return True, []
            self._wanted.append(stamp)
            return True, self._choose()

    def depth(self, payload: bytes) -> list[bytes]:
        """Take a depth image; return those to carry now, of which it may be one."""
        stamp = stamp_of(payload)
        if stamp is None or self._all:
            return [payload]
        with self._lock:
            if self._held:
                self._spacing_s = abs(stamp - self._held[-1][0])
            self._held.append((stamp, payload))
            if self._color_stamp is None or abs(stamp - self._color_stamp) > ALONE_AFTER_S:
                return [self._held.pop()[1]] if self._alone.is_new(stamp) else []
            return self._choose()

    def _choose(self) -> list[bytes]:
        """Return the depth image nearest to each wanted stamp, once no nearer one can come."""
        chosen: list[bytes] = []
        for wanted in tuple(self._wanted):
            near = [one for one in self._held if abs(one[0] - wanted) <= PAIRED_S]
            if not near:
                continue
            best = min(near, key=lambda one: abs(one[0] - wanted))
            is_nearest = abs(best[0] - wanted) <= 0.5 * self._spacing_s
            if is_nearest or self._held[-1][0] >= wanted:
                self._wanted.remove(wanted)
                self._held.remove(best)
                chosen.append(best[1])
        return chosen


class TiltSteps:
    """Tells which of the tilts that the navigator repeats are sent as a trajectory."""

    def __init__(self) -> None:
        self._tilt_rad = self._at = -math.inf

    def is_due(self, tilt_rad: float, now: float) -> bool:
        """Tell whether to send a tilt; `now` is monotonic seconds."""
        if abs(tilt_rad - self._tilt_rad) < TILT_STEP_RAD and now - self._at < TILT_AGAIN_S:
            return False
        self._tilt_rad, self._at = tilt_rad, now
        return True

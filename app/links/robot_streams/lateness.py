"""How much later images arrive than they did: a slow network queues them, and all come late."""

from collections import deque
from typing import Final

from ippon.frame import NANOSECONDS

WINDOW_S: Final = 60.0
RECENT_S: Final = 3.0
LATE_S: Final = 1.0
STEADY: Final = 0.1
"""Largest difference of the clocks' rates; a simulation slower than real time differs by more."""


class Lateness:
    """Compares arrivals and stamps; the clocks need not agree, only run equally fast."""

    def __init__(self) -> None:
        self._arrivals: deque[tuple[float, float]] = deque()

    def add(self, stamp_ns: int, arrived_s: float) -> None:
        """Take an image's stamp, and when it arrived by a monotonic clock."""
        stamp_s = stamp_ns / NANOSECONDS
        if self._arrivals and stamp_s <= self._arrivals[-1][1]:
            self._arrivals.clear()
        self._arrivals.append((arrived_s, stamp_s))
        while arrived_s - self._arrivals[0][0] > WINDOW_S:
            self._arrivals.popleft()

    def late_s(self) -> float:
        """Return by how much the last images were late, 0 below `LATE_S` and while unknown."""
        if not self._arrivals:
            return 0.0
        now, stamp_s = self._arrivals[-1]
        recent = next(one for one in self._arrivals if now - one[0] <= RECENT_S)
        passed_s = now - recent[0]
        if passed_s < 0.5 * RECENT_S:
            return 0.0
        late_s = now - stamp_s - min(at - stamp for at, stamp in self._arrivals)
        steady = abs((stamp_s - recent[1]) / passed_s - 1.0) < STEADY
        return late_s if steady and late_s > LATE_S else 0.0

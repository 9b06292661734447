"""How many of the last colour images have a depth image of their time."""

from collections import deque
from typing import Final

from ippon.frame import NANOSECONDS

WINDOW: Final = 50
"""Number of colour images that are counted."""
FEW: Final = 0.2
"""Share of images without depth that is not reported; a lossy network loses some."""
_DEPTHS: Final = 200
"""Depth images whose stamps are kept: those of one may come before those of the other."""
_BACKWARDS_NS: Final = NANOSECONDS


class DepthMatch:
    """Compares the stamps of all images that arrive, used or not.

    Args:
        tolerance_s: Stamps that differ by no more belong together.
    """

    def __init__(self, tolerance_s: float) -> None:
        self._tolerance_s = tolerance_s
        self._tolerance_ns = round(NANOSECONDS * tolerance_s)
        self._matched: dict[int, bool] = {}
        self._depths: deque[int] = deque(maxlen=_DEPTHS)

    def add_color(self, stamp_ns: int) -> None:
        """Take the stamp of a colour image."""
        if self._matched and stamp_ns < next(reversed(self._matched)) - _BACKWARDS_NS:
            self._matched.clear()
        self._matched[stamp_ns] = any(self._near(stamp_ns, one) for one in self._depths)
        if len(self._matched) > WINDOW:
            del self._matched[next(iter(self._matched))]

    def add_depth(self, stamp_ns: int) -> None:
        """Take the stamp of a depth image."""
        self._depths.append(stamp_ns)
        for one in self._matched:
            if self._near(stamp_ns, one):
                self._matched[one] = True

    def problem(self) -> str:
        """Return how many have none; empty where few have none, and while that is not known."""
        alone = WINDOW - sum(self._matched.values())
        if len(self._matched) < WINDOW or not self._depths or alone <= FEW * WINDOW:
            return ""
        return (
            f"{alone} of the last {WINDOW} colour images have no depth image within "
            f"{1000 * self._tolerance_s:.0f} ms of their stamp: they are not mapped"
        )

    def _near(self, a_ns: int, b_ns: int) -> bool:
        return abs(a_ns - b_ns) <= self._tolerance_ns

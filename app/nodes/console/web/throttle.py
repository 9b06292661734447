"""Limit on password guesses."""

from collections import OrderedDict
from typing import Final

FREE: Final = 5
"""Wrong passwords before the first wait."""
FIRST_WAIT_S: Final = 2.0
LONGEST_WAIT_S: Final = 300.0
FORGOTTEN_S: Final = 3600.0
MAX_KEYS: Final = 10_000

Key = tuple[str, str]


class Throttle:
    """Counts failures per address and name, and per address.

    After five, each further one doubles the wait. A name cannot be locked out from another address,
    because addresses are counted separately. Times are seconds of a monotonic clock.
    """

    def __init__(self) -> None:
        self._failures: OrderedDict[Key, tuple[int, float]] = OrderedDict()

    def wait_s(self, address: str, name: str, now_s: float) -> float:
        """Return how long the next attempt must wait, 0 if it may come now."""
        return max(
            self._left_s((address, name), FREE, now_s), self._left_s((address, ""), 4 * FREE, now_s)
        )

    def failed(self, address: str, name: str, now_s: float) -> None:
        """Count a wrong password."""
        for key in ((address, name), (address, "")):
            count, at_s = self._failures.pop(key, (0, now_s))
            count = 0 if now_s - at_s > FORGOTTEN_S else count
            self._failures[key] = (count + 1, now_s)
        while len(self._failures) > MAX_KEYS:
            self._failures.popitem(last=False)

    def succeeded(self, address: str, name: str) -> None:
        """Reset the failures after a successful login."""
        self._failures.pop((address, name), None)

    def _left_s(self, key: Key, free: int, now_s: float) -> float:
        count, at_s = self._failures.get(key, (0, now_s))
        if count < free:
            return 0.0
        wait_s = min(FIRST_WAIT_S * 2.0 ** min(count - free, 20), LONGEST_WAIT_S)
        return max(0.0, at_s + wait_s - now_s)

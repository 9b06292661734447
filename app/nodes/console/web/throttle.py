"""Limit on password guesses."""

from collections import OrderedDict
from typing import Final, NamedTuple

FREE: Final = 5
"""Wrong passwords before the first wait."""
FIRST_WAIT_S: Final = 2.0
LONGEST_WAIT_S: Final = 300.0
FORGOTTEN_S: Final = 3600.0
MAX_KEYS: Final = 10_000

Key = tuple[str, str]


class Attempt(NamedTuple):
    """A login that was counted as a failure, until its password turns out to be right."""

    address: str
    name: str
    at_s: float
    before_s: float
    """Time of the failure of the same address before it."""


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

    def failed(self, address: str, name: str, now_s: float) -> Attempt:
        """Count a wrong password; return what takes it back."""
        before_s = self._failures.get((address, ""), (0, now_s))[1]
        for key in ((address, name), (address, "")):
            count, at_s = self._failures.pop(key, (0, now_s))
            count = 0 if now_s - at_s > FORGOTTEN_S else count
            self._failures[key] = (count + 1, now_s)
        while len(self._failures) > MAX_KEYS:
            self._failures.popitem(last=False)
        return Attempt(address, name, now_s, before_s)

    def succeeded(self, attempt: Attempt) -> None:
        """Reset the failures of a name after its login, and take back that of the address.

        Those of other attempts stay: an account does not let its owner guess others' passwords.
        """
        self._failures.pop((attempt.address, attempt.name), None)
        count, at_s = self._failures.pop((attempt.address, ""), (0, 0.0))
        if count > 1:
            # A failure that came meanwhile still counts from its own time.
            at_s = attempt.before_s if at_s == attempt.at_s else at_s
            self._failures[attempt.address, ""] = count - 1, at_s

    def _left_s(self, key: Key, free: int, now_s: float) -> float:
        count, at_s = self._failures.get(key, (0, now_s))
        if count < free:
            return 0.0
        wait_s = min(FIRST_WAIT_S * 2.0 ** min(count - free, 20), LONGEST_WAIT_S)
        return max(0.0, at_s + wait_s - now_s)

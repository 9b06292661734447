"""How late this machine runs what is due, so that a time limit can leave it out."""

import threading
import time
from collections.abc import Callable
from typing import Self

PERIOD_S = 0.01


class MachineLateness:
    """Notes how much later than it asked for a thread wakes, while it is entered.

    Args:
        clock: What the two ends of an interval are told in.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._late: list[tuple[float, float]] = []
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._watch, name="lateness", daemon=True)

    def __enter__(self) -> Self:
        """Begin to note."""
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Note the last time; only now are intervals complete."""
        self._over.set()
        self._thread.join()

    def net_s(self, began: float, ended: float) -> float:
        """Return how long an interval took, without the time that the machine was late in it."""
        late_s = sum(max(0.0, min(woke, ended) - max(due, began)) for due, woke in self._late)
        return ended - began - late_s

    def _watch(self) -> None:
        while not self._over.is_set():
            due = self._clock() + PERIOD_S
            time.sleep(PERIOD_S)
            self._late.append((due, self._clock()))

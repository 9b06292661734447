"""The deadline of a planning step.

Without a budget in seconds only the counts of work bound a step, and two runs with one seed are
identical. A budget bounds the seconds as well and needs a clock.
"""

import math
from collections.abc import Callable

Clock = Callable[[], float]
"""Returns monotonic seconds, like `time.monotonic`."""


class Deadline:
    """The end of a step, and whether work was postponed because of it."""

    def __init__(self, budget_s: float = math.inf, clock: Clock | None = None) -> None:
        """Start the clock.

        Args:
            budget_s: Seconds from now; infinite for no limit.
            clock: Read if the budget is finite.

        Raises:
            ValueError: There is a budget and no clock.
        """
        if budget_s < math.inf and clock is None:
            raise ValueError(
                f"a budget of {budget_s} s needs a clock to keep it by: pass clock=time.monotonic, "
                "or no budget, and the work is counted alone"
            )
        self._budget_s = budget_s
        self._clock = clock if budget_s < math.inf else None
        self._began_s = 0.0 if self._clock is None else self._clock()
        self._whole: Deadline | None = None
        self.cut_short = False
        """Whether work was postponed to another step."""

    def share(self, share: float) -> "Deadline":
        """Return a deadline after a share of the budget, counted from the same start."""
        part = Deadline()
        part._budget_s, part._clock = share * self._budget_s, self._clock
        part._began_s, part._whole = self._began_s, self
        return part

    def passed(self) -> bool:
        """Return whether the deadline has passed, so that pending work must wait for another step.

        Call this only with work pending: a passed deadline sets `cut_short`.
        """
        if self._clock is None or self._clock() - self._began_s < self._budget_s:
            return False
        self.cut_short = True
        if self._whole is not None:
            self._whole.cut_short = True
        return True


UNLIMITED = Deadline()
"""The deadline that never passes."""

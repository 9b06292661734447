"""How long a step may go on where a robot waits for it.

Without a budget in seconds the work of a step is counted alone, and two runs of one seed are the
same run. A budget bounds the seconds as well; whoever gives one brings the clock.
"""

import math
from collections.abc import Callable

Clock = Callable[[], float]
"""Returns seconds that only grow, as `time.monotonic` does."""


class Deadline:
    """When a step has to come to its end, and whether it had to leave work undone."""

    def __init__(self, budget_s: float = math.inf, clock: Clock | None = None) -> None:
        """Begin.

        Args:
            budget_s: Seconds from now on; infinite for as long as it takes.
            clock: Read where the budget is finite.

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
        """Something had to wait for another step."""

    def share(self, share: float) -> "Deadline":
        """Return the deadline of what may take a share of the time, counted from the same begin."""
        part = Deadline()
        part._budget_s, part._clock = share * self._budget_s, self._clock
        part._began_s, part._whole = self._began_s, self
        return part

    def passed(self) -> bool:
        """Tell whether a piece of work that is there to be done has to wait for another step.

        Ask only with such a piece at hand: a deadline that passed has cut it short.
        """
        if self._clock is None or self._clock() - self._began_s < self._budget_s:
            return False
        self.cut_short = True
        if self._whole is not None:
            self._whole.cut_short = True
        return True


UNLIMITED = Deadline()
"""Never passes."""

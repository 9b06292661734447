"""Key figures over time, for plots."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from app.messages.status import Status

_PERIOD_NS: Final = 500_000_000
_LIMIT: Final = 1200


class History:
    """Key figures over robot time; subsampled to a maximum length."""

    def __init__(self) -> None:
        self._rows: list[tuple[float, float, float, float, float, float]] = []
        self._period_ns = _PERIOD_NS
        self._start_ns: int | None = None
        self._last_ns = 0
        self.first_ns: int | None = None
        """Robot time of the earliest status, which `clear` keeps; None before the first."""

    def add(self, status: Status) -> None:
        """Add a status, unless the previous one is too recent."""
        if self.first_ns is None or status.stamp_ns < self.first_ns:
            self.first_ns = status.stamp_ns
        if self._start_ns is None:
            self._start_ns = status.stamp_ns
        elif status.stamp_ns < self._last_ns + self._period_ns:
            return
        self._last_ns = status.stamp_ns
        timings = status.timings
        self._rows.append(
            (
                (status.stamp_ns - self._start_ns) * 1e-9,
                status.best_ooi,
                status.explored_m2,
                status.path_length_m,
                timings.step_ms,
                timings.frame_age_ms,
            )
        )
        if len(self._rows) >= _LIMIT:
            self._rows = self._rows[::2]
            self._period_ns *= 2

    def clear(self) -> None:
        """Remove everything."""
        self._rows.clear()
        self._period_ns = _PERIOD_NS
        self._start_ns = None

    def columns(self) -> NDArray[np.float64]:
        """Return (6, N): seconds, best p(v in O), explored m2, path m, step ms, frame age ms."""
        return np.array(self._rows, dtype=np.float64).reshape(-1, 6).T

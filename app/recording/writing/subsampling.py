"""Which of the robot's large messages are kept."""

import struct
from typing import Final

from app.messages import keys

SUBSAMPLED: Final = frozenset({keys.DEPTH, keys.DEPTH_RAW, keys.HEATMAP})
"""Nine tenths of what a robot sends."""
_STAMP: Final = struct.Struct("<iI")
_STAMP_AT: Final = 4


class SensorSubsampling:
    """Keeps the first depth image and heatmap of each period of the robot's clock.

    The periods are those of the clock, so that what is kept of either belongs together. Whatever
    the page shows does not come from them: it is recorded whole.
    """

    def __init__(self, sensor_hz: float) -> None:
        """Keep so many a second; 0 keeps all."""
        self._period_ns = round(1e9 / sensor_hz) if sensor_hz > 0.0 else 0
        self._kept: dict[str, int] = {}

    def keeps(self, key: str, payload: bytes) -> bool:
        """Tell whether a message is written."""
        if self._period_ns == 0 or key not in SUBSAMPLED:
            return True
        if len(payload) < _STAMP_AT + _STAMP.size:
            return True
        seconds, nanoseconds = _STAMP.unpack_from(payload, _STAMP_AT)
        period = (seconds * 1_000_000_000 + nanoseconds) // self._period_ns
        if self._kept.get(key) == period:
            return False
        self._kept[key] = period
        return True

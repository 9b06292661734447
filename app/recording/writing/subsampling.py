"""Subsampling of depth images, heatmaps and detections in recordings."""

import struct
from typing import Final

from app.messages import keys
from ippon.frame import NANOSECONDS

SUBSAMPLED: Final = frozenset(
    {
        keys.DEPTH, keys.DEPTH_RAW, keys.HEATMAP, keys.BOXES, keys.MASKS, keys.MASKS_COMPRESSED,
    }
)  # fmt: skip
"""Topics that make up most of the data."""
_STAMP: Final = struct.Struct("<iI")
_STAMP_AT: Final = 4


class SensorSubsampling:
    """Keeps the first depth image and heatmap of each period of the robot's clock.

    Periods are aligned with the clock, so that the depth images and heatmaps kept belong to the
    same frames.
    """

    def __init__(self, sensor_hz: float) -> None:
        """Keep `sensor_hz` messages per second of each topic; 0 keeps all."""
        self._period_ns = round(NANOSECONDS / sensor_hz) if sensor_hz > 0.0 else 0
        self._kept: dict[str, int] = {}

    def keeps(self, key: str, payload: bytes) -> bool:
        """Return whether a message is written."""
        if self._period_ns == 0 or key not in SUBSAMPLED:
            return True
        if len(payload) < _STAMP_AT + _STAMP.size:
            return True
        seconds, nanoseconds = _STAMP.unpack_from(payload, _STAMP_AT)
        period = (seconds * NANOSECONDS + nanoseconds) // self._period_ns
        if self._kept.get(key) == period:
            return False
        self._kept[key] = period
        return True

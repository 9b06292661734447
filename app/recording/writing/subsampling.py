"""Subsampling of images, heatmaps, detections and whole maps in recordings."""

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
RESTING_S: Final = {**dict.fromkeys(SUBSAMPLED, 10.0), keys.COLOR: 1.0, keys.MAP_KEYFRAME: 60.0}
"""Least time between two messages of a robot that rests: it sees the same all the time."""
_STAMP: Final = struct.Struct("<iI")
_STAMP_AT: Final = 4


class SensorSubsampling:
    """Keeps the first depth image and heatmap of each period of the robot's clock.

    While the robot rests, the periods are longer, and colour images and whole maps have some, too.
    Periods are aligned with the clock, so that the depth images and heatmaps kept belong to the
    same frames.
    """

    def __init__(self, sensor_hz: float) -> None:
        """Keep `sensor_hz` messages per second of each topic; 0 keeps all."""
        self._period_ns = round(NANOSECONDS / sensor_hz) if sensor_hz > 0.0 else 0
        self._kept: dict[str, tuple[int, int]] = {}
        """Length and number of the period of each topic's last message."""

    def keeps(self, key: str, payload: bytes, *, is_resting: bool = False) -> bool:
        """Return whether a message is written.

        Args:
            key: Under the robot's prefix.
            payload: Encoded message.
            is_resting: See `app.recording.writing.rest`.
        """
        if self._period_ns == 0:
            return True
        period_ns = self._period_ns if key in SUBSAMPLED else 0
        if is_resting:
            period_ns = max(period_ns, round(RESTING_S.get(key, 0.0) * NANOSECONDS))
        if period_ns == 0:
            return True
        if len(payload) < _STAMP_AT + _STAMP.size:
            return True
        seconds, nanoseconds = _STAMP.unpack_from(payload, _STAMP_AT)
        period = (period_ns, (seconds * NANOSECONDS + nanoseconds) // period_ns)
        if self._kept.get(key) == period:
            return False
        self._kept[key] = period
        return True

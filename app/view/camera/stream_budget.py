"""Size, quality and rate of a camera stream that keeps within the bit rate of a link.

The rate falls when pictures arrive late, and rises again up to the limit while they arrive in time.
The size of the last picture selects the size and quality of the next one from a ladder.
"""

from dataclasses import dataclass
from typing import Final

BIT_S: Final = 1.8e6
"""Bit rate of one stream: 2 Mbit/s less the overhead of WebSocket, TCP and IP."""
LEAST_BIT_S: Final = 100e3
HZ: Final = 10.0
"""Most pictures per second."""
LATE_S: Final = 0.3
"""Time from sending a picture to its acknowledgement from which the link counts as too slow."""
IN_FLIGHT: Final = 2
"""Pictures that may be unacknowledged; more keep a fast, distant link busy and add latency."""
_SLOWER: Final = 0.8
_FASTER: Final = 1.05
_ROOM: Final = 0.7
"""Share of the bytes of a picture below which the next better rung is tried."""
_PATIENCE: Final = 5
"""Small pictures in a row before a better rung is tried."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Rung:
    """Longest side in pixels, and JPEG quality."""

    longest_px: int
    quality: int


LADDER: Final = tuple(
    Rung(longest_px=longest_px, quality=quality)
    for longest_px, quality in (
        (160, 30), (240, 35), (320, 40), (320, 55), (400, 60), (480, 60), (480, 70), (640, 65),
        (640, 78), (800, 78), (960, 80), (1280, 82),
    )
)  # fmt: skip
"""From the smallest picture to the best."""
_FIRST: Final = 7


class StreamBudget:
    """Decides when the next picture of one stream may be sent, and how large it may be."""

    def __init__(self, bit_s: float = BIT_S, hz: float = HZ) -> None:
        """Begin in the middle of the ladder.

        Args:
            bit_s: Bits per second that are never exceeded.
            hz: Most pictures per second.

        Raises:
            ValueError: A limit is not positive.
        """
        if not (bit_s >= LEAST_BIT_S and hz > 0.0):
            raise ValueError(
                f"a stream needs at least {LEAST_BIT_S:g} bit/s and a positive rate; got "
                f"{bit_s:g} bit/s and {hz:g} Hz"
            )
        self._limit_bit_s, self._hz = bit_s, hz
        self.allowed_bit_s = bit_s
        """Bit rate that the link has sustained."""
        self._rung = _FIRST
        self._small = 0
        self._next_s = 0.0
        self._last_bytes = 0

    @property
    def rung(self) -> Rung:
        """Size and quality of the next picture."""
        return LADDER[self._rung]

    @property
    def picture_bytes(self) -> float:
        """Bytes of a picture at which the full rate is kept."""
        return self.allowed_bit_s / 8.0 / self._hz

    def wait_s(self, now_s: float) -> float:
        """Return how long to wait before the next picture may be sent."""
        return max(0.0, self._next_s - now_s)

    def is_too_large(self, size: int) -> bool:
        """Return whether a picture should be encoded again by the next smaller rung.

        Call `sent` or this for each picture; this selects the smaller rung.
        """
        if size <= 1.5 * self.picture_bytes or self._rung == 0:
            return False
        self._rung -= 1
        self._small = 0
        return True

    def sent(self, now_s: float, size: int) -> None:
        """Account for a picture of `size` bytes that is sent at a time of any clock, seconds."""
        self._last_bytes = size
        # Unused time of up to one picture is kept, so that jitter does not lower the rate.
        start = max(self._next_s, now_s - 1.0 / self._hz)
        self._next_s = start + max(1.0 / self._hz, 8.0 * size / self.allowed_bit_s)
        if size > self.picture_bytes:
            self._rung = max(0, self._rung - 1)
            self._small = 0
            return
        self._small = self._small + 1 if size < _ROOM * self.picture_bytes else 0
        if self._small >= _PATIENCE and self._rung + 1 < len(LADDER):
            self._rung += 1
            self._small = 0

    def acknowledged(self, trip_s: float) -> None:
        """Account for the time from sending a picture to its acknowledgement."""
        if trip_s > LATE_S:
            self.allowed_bit_s = max(LEAST_BIT_S, self.allowed_bit_s * _SLOWER)
        elif self._last_bytes > 0.5 * self.picture_bytes:
            # Small pictures do not show that the link would carry more.
            self.allowed_bit_s = min(self._limit_bit_s, self.allowed_bit_s * _FASTER)

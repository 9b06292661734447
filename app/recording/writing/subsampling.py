"""Subsampling of images, heatmaps, detections and whole maps in recordings."""

import struct
from collections import deque
from collections.abc import Iterable
from typing import Final, NamedTuple

from app.messages import keys
from app.messages.images import PAIRED_S
from ippon.frame import NANOSECONDS

_DEPTHS: Final = (keys.DEPTH, keys.DEPTH_RAW)
_SEEN: Final = (keys.HEATMAP, keys.BOXES, keys.MASKS, keys.MASKS_COMPRESSED)
SUBSAMPLED: Final = frozenset((*_DEPTHS, *_SEEN))
"""Topics that make up most of the data."""
RESTING_S: Final = {**dict.fromkeys(SUBSAMPLED, 10.0), keys.COLOR: 1.0, keys.MAP_KEYFRAME: 60.0}
"""Least time between two messages of a robot that rests: it sees the same all the time."""
HELD_S: Final = 1.5
"""How long a depth image waits for what the network says of the image of its time."""
MOST_HELD_BYTES: Final = 64_000_000
"""Of depth images, and of colour images."""
_PAIRED_NS: Final = round(NANOSECONDS * PAIRED_S)
_REMEMBERED: Final = 16
_STAMP: Final = struct.Struct("<iI")
_STAMP_AT: Final = 4


class Arrived(NamedTuple):
    """A message, and when it came."""

    key: str
    payload: bytes
    wall_ns: int


class _Held(NamedTuple):
    stamp_ns: int
    message: Arrived


class SensorSubsampling:
    """Keeps a heatmap, and the depth image of its time, of each period of the robot's clock.

    A network is slower than the camera, and what it says of an image comes after later ones: depth
    images wait for it. Where nothing is said, the first depth image of a period is kept.
    """

    def __init__(self, sensor_hz: float) -> None:
        """Keep `sensor_hz` messages per second of each topic; 0 keeps all."""
        self._period_ns = round(NANOSECONDS / sensor_hz) if sensor_hz > 0.0 else 0
        self._kept: dict[str, int] = {}
        self._held: dict[str, deque[_Held]] = {key: deque() for key in _DEPTHS}
        self._held_bytes = 0
        self._wanted: deque[int] = deque(maxlen=_REMEMBERED)
        """Stamps of kept heatmaps whose depth image has not come."""
        self._written: dict[str, deque[int]] = {key: deque(maxlen=_REMEMBERED) for key in _DEPTHS}
        """Stamps of the last depth images that were kept."""

    def take(self, message: Arrived) -> list[Arrived]:
        """Take a message; return those to write now, with the time at which each came."""
        stamp_ns = _stamp_of(message)
        if self._period_ns == 0 or message.key not in SUBSAMPLED or stamp_ns is None:
            return [message]
        if message.key in _DEPTHS:
            return self._take_depth(message, stamp_ns)
        period = stamp_ns // self._period_ns
        if self._kept.get(message.key) == period:
            return []
        self._kept[message.key] = period
        return [*self._depth_of(stamp_ns), message]

    def overdue(self, wall_ns: int) -> list[Arrived]:
        """Return what has waited long enough at a time, also where no further image comes."""
        due_ns = wall_ns - round(HELD_S * NANOSECONDS)
        kept: list[Arrived] = []
        for key, held in self._held.items():
            while held and held[0].message.wall_ns < due_ns:
                kept += self._let_go(key, 1)
        return kept

    def drain(self) -> list[Arrived]:
        """Return what is to be written at the end."""
        return [one for key in _DEPTHS for one in self._let_go(key, len(self._held[key]))]

    def _take_depth(self, message: Arrived, stamp_ns: int) -> list[Arrived]:
        key, held = message.key, self._held[message.key]
        if any(abs(stamp_ns - wanted) <= _PAIRED_NS for wanted in self._wanted):
            self._wanted = deque(
                (one for one in self._wanted if abs(stamp_ns - one) > _PAIRED_NS), _REMEMBERED
            )
            self._written[key].append(stamp_ns)
            return [message]
        if held and stamp_ns < held[-1].stamp_ns - NANOSECONDS:
            before = self._let_go(key, len(held))  # The robot's clock was set back.
        else:
            before = []
        held.append(_Held(stamp_ns, message))
        self._held_bytes += len(message.payload)
        old = sum(stamp_ns - one.stamp_ns > HELD_S * NANOSECONDS for one in held)
        before += self._let_go(key, old)
        while self._held_bytes > MOST_HELD_BYTES and held:
            before += self._let_go(key, 1)
        return before

    def _depth_of(self, stamp_ns: int) -> list[Arrived]:
        """Return the held depth images of a stamp, and remember it where none is there."""
        found: list[Arrived] = []
        if self._has_depth(stamp_ns):
            return found
        for key, held in self._held.items():
            near = min(held, key=lambda one: abs(one.stamp_ns - stamp_ns), default=None)
            if near is not None and abs(near.stamp_ns - stamp_ns) <= _PAIRED_NS:
                held.remove(near)
                self._held_bytes -= len(near.message.payload)
                self._written[key].append(near.stamp_ns)
                found.append(near.message)
        if not found:
            self._wanted.append(stamp_ns)
        return found

    def _has_depth(self, stamp_ns: int) -> bool:
        """Tell whether the depth image of a stamp is kept already, as for the boxes of masks."""
        written = (one for of in self._written.values() for one in of)
        return any(abs(one - stamp_ns) <= _PAIRED_NS for one in written)

    def _let_go(self, key: str, count: int) -> list[Arrived]:
        """Take held depth images, oldest first; return those of periods without any."""
        kept: list[Arrived] = []
        for _ in range(count):
            one = self._held[key].popleft()
            self._held_bytes -= len(one.message.payload)
            period = one.stamp_ns // self._period_ns
            if all(written // self._period_ns != period for written in self._written[key]):
                self._written[key].append(one.stamp_ns)
                kept.append(one.message)
        return kept


class RestSubsampling:
    """Keeps fewer messages of a robot that rests, one of each period of its clock.

    A heatmap that is kept has its depth and colour image, which `SensorSubsampling` keeps together:
    colour images, which come before what the network says of them, wait here.
    """

    def __init__(self) -> None:
        self._kept: dict[str, int] = {}
        self._seen: deque[int] = deque(maxlen=_REMEMBERED)
        """Stamps of the last heatmaps that were kept."""
        self._colors: deque[_Held] = deque()
        """Colour images of the last `HELD_S` that were not kept."""

    def take(self, messages: list[Arrived]) -> list[Arrived]:
        """Return those of some messages of a robot that rests that are to be written now."""
        # What is said of an image decides for it, also where it comes after.
        seen = {id(one) for one in messages if one.key in _SEEN and self._keeps(one)}
        kept = [one for one in messages if id(one) in seen]
        self._seen.extend(stamp for one in kept if (stamp := _stamp_of(one)) is not None)
        return [
            *self.colors_of(kept),
            *(one for one in messages if id(one) in seen or self._keeps_other(one)),
        ]

    def colors_of(self, messages: list[Arrived]) -> list[Arrived]:
        """Return the colour images that wait for heatmaps among some messages."""
        stamps = [_stamp_of(one) for one in messages if one.key in _SEEN]
        found = [one for one in self._colors if _is_near(one.stamp_ns, stamps)]
        for one in found:
            self._colors.remove(one)
        return [one.message for one in found]

    def forget(self) -> None:
        """Keep the next message of each kind, such as the whole map after a gap."""
        self._kept.clear()

    def _keeps_other(self, message: Arrived) -> bool:
        if message.key in _SEEN:
            return False
        is_kept, stamp_ns = self._keeps(message), _stamp_of(message)
        if message.key not in (keys.COLOR, *_DEPTHS) or stamp_ns is None or is_kept:
            return is_kept
        if _is_near(stamp_ns, self._seen):
            return True
        if message.key == keys.COLOR:
            self._wait(_Held(stamp_ns, message))
        return False

    def _wait(self, color: _Held) -> None:
        waiting = self._colors
        waiting.append(color)
        while abs(color.stamp_ns - waiting[0].stamp_ns) > HELD_S * NANOSECONDS:
            waiting.popleft()
        while waiting and sum(len(one.message.payload) for one in waiting) > MOST_HELD_BYTES:
            waiting.popleft()

    def _keeps(self, message: Arrived) -> bool:
        stamp_ns, longest_s = _stamp_of(message), RESTING_S.get(message.key)
        if longest_s is None or stamp_ns is None:
            return True
        period = stamp_ns // round(longest_s * NANOSECONDS)
        last = self._kept.get(message.key)
        # A depth image that waited may be of the period before.
        if last is not None and last - 1 <= period <= last:
            return False
        self._kept[message.key] = period
        return True


def _is_near(stamp_ns: int, stamps: Iterable[int | None]) -> bool:
    return any(one is not None and abs(stamp_ns - one) <= _PAIRED_NS for one in stamps)


def _stamp_of(message: Arrived) -> int | None:
    if len(message.payload) < _STAMP_AT + _STAMP.size:
        return None
    seconds, nanoseconds = _STAMP.unpack_from(message.payload, _STAMP_AT)
    return seconds * NANOSECONDS + nanoseconds

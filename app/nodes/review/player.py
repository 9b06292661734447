"""Plays a recording: restores the state at a moment, then emits message by message."""

from bisect import bisect_right
from collections.abc import Callable
from typing import Final

import msgspec
import numpy as np

from app.messages import keys
from app.messages.cdr import MessageError
from app.messages.motion import StampedTransform, decode_transforms, encode_transforms
from app.messages.scene import VoxelCloud, encode_voxels
from app.messages.status import Status
from app.recording.channels import GAP_KEY
from app.recording.map_alignment import alignment_message
from app.recording.reading.recording import Recording
from app.recording.timeline import TIMELINE_KEYS, SessionTimeline, timeline_of
from app.view.model.seek_history import SEEK_HISTORY, SeekHistory

PLOT_POINTS: Final = 1000
TRAIL_POINTS: Final = 4000
SHOWN_EVENTS: Final = 500
TF_NS: Final = 1_000_000_000
"""Time before a moment in which every coordinate frame of a robot has a pose."""
_APART: Final = {
    keys.STATUS, keys.MAP_ALIGNMENT, keys.CONFIGURATION, keys.LABELS, keys.SEARCHES_SAVED,
}  # fmt: skip
"""Latched topics that are emitted before, or that a review does not show."""
LATEST: Final = (keys.CAMERA_INFO, *(key for key in keys.LATCHED if key not in _APART))
"""Topics whose last message is emitted after a jump."""
PLAYED: Final = (
    keys.COLOR, keys.STATUS, keys.EVENT, keys.MAP_VOXELS, keys.MAP_ALIGNMENT, keys.TF,
    keys.TF_STATIC, *LATEST,
)  # fmt: skip

Emit = Callable[[str, bytes], object]


class Player:
    """A position in one recording. Owned by one thread; time is an argument."""

    def __init__(
        self, recording: Recording, emit: Emit, timeline: SessionTimeline | None = None
    ) -> None:
        """Start at the beginning, and emit its state.

        Args:
            recording: An open recording.
            emit: Receives every message, like the console's inbox.
            timeline: Timeline of the recording; None builds it.
        """
        self.recording = recording
        self.timeline = timeline if timeline is not None else timeline_of(recording)
        self._emit = emit
        self._frames = recording.times_ns(keys.COLOR)
        self._whole = False
        """Whether a whole map was emitted and no change of it is missing since."""
        self._damaged = recording.damaged.total()
        statuses = recording.times_ns(keys.STATUS)
        # The first status gives the voxel size.
        self._first_ns = int(statuses[0]) if len(statuses) else recording.start_ns
        self.time_ns = self._first_ns
        self.seek(0.0)

    @property
    def position_s(self) -> float:
        """Position in seconds since the beginning of the recording."""
        return (self.time_ns - self.recording.start_ns) * 1e-9

    @property
    def ended(self) -> bool:
        """Whether the end is reached."""
        return self.time_ns >= self.recording.end_ns

    def refresh(self) -> bool:
        """Read what was recorded meanwhile; return whether there is anything new.

        Raises:
            RecordingError: The file can no longer be read.
        """
        before_ns = self.recording.end_ns
        if not self.recording.refresh():
            return False
        for message in self.recording.between(before_ns, self.recording.end_ns, TIMELINE_KEYS):
            self.timeline.take(message.key, message.payload, message.time_ns)
        self._frames = self.recording.times_ns(keys.COLOR)
        return True

    def seek(self, position_s: float) -> None:
        """Jump to a moment, and emit the state at that moment."""
        recording = self.recording
        # Limited as seconds: a page may ask for any number, and infinity has no nanoseconds.
        after_ns = round(min(max(position_s, 0.0), recording.duration_s) * 1e9)
        time_ns = recording.start_ns + after_ns
        self.time_ns = min(max(time_ns, self._first_ns), recording.end_ns)
        self._emit(SEEK_HISTORY, msgspec.json.encode(self._past()))
        # The image first, because a find is shown in the image of its time.
        for key in (keys.COLOR, keys.STATUS):
            last = recording.latest(key, self.time_ns)
            if last is not None:
                self._emit(key, last.payload)
        self._show_map()
        aligned = alignment_message(recording, self.time_ns)
        if aligned is not None:
            self._emit(aligned.key, aligned.payload)
        self._emit(
            keys.TF_STATIC, encode_transforms(self._last_of(keys.TF_STATIC, 0, self.time_ns))
        )
        self._emit(keys.TF, encode_transforms(self._poses()))
        for key in LATEST:
            last = recording.latest(key, self.time_ns)
            if last is not None:
                self._emit(key, last.payload)

    def advance(self, seconds: float) -> None:
        """Play for a time."""
        until_ns = min(self.time_ns + round(seconds * 1e9), self.recording.end_ns)
        # In a recording that began during a search, the map comes a little later, and after a gap
        # again: changes of it are missing. Other whole maps, which are large, are not read.
        damaged = self.recording.damaged.total()
        self._whole, self._damaged = self._whole and damaged == self._damaged, damaged
        needs_whole = not self._whole or self._has_gap(until_ns)
        wanted = (*PLAYED, GAP_KEY, keys.MAP_KEYFRAME) if needs_whole else PLAYED
        for message in self.recording.between(self.time_ns, until_ns, wanted):
            if message.key == GAP_KEY:
                self._whole = False
                continue
            if message.key == keys.MAP_KEYFRAME:
                if self._whole:
                    continue
                self._whole = True
            self._emit(message.key, message.payload)
        self.time_ns = until_ns

    def _has_gap(self, until_ns: int) -> bool:
        """Return whether messages are missing between now and a later time."""
        before, after = np.searchsorted(
            self.recording.times_ns(GAP_KEY), [self.time_ns, until_ns], "right"
        )
        return bool(after > before)

    def step(self, frames: int, *, jumps: bool = False) -> None:
        """Go to the next camera image, or back to the previous one.

        Args:
            frames: How many images; backward where it is negative.
            jumps: Do not play what is in between.
        """
        if not len(self._frames):
            return
        here = bisect_right(self._frames, self.time_ns) - 1
        there = int(self._frames[min(max(here + frames, 0), len(self._frames) - 1)])
        if there > self.time_ns and not jumps:
            self.advance((there - self.time_ns) * 1e-9)
        else:
            self.seek((there - self.recording.start_ns) * 1e-9)

    def _poses(self) -> list[StampedTransform]:
        """Return only the last pose of each frame, because earlier ones would extend the trail."""
        last = self.recording.latest(keys.TF, self.time_ns)
        # A silent robot is shown at its last pose.
        until_ns = last.time_ns if last is not None else self.time_ns
        return self._last_of(keys.TF, until_ns - TF_NS, until_ns)

    def _last_of(self, key: str, since_ns: int, until_ns: int) -> list[StampedTransform]:
        """Return the last transform to each frame; a driver may send the fixed ones again."""
        latest: dict[str, StampedTransform] = {}
        for message in self.recording.between(since_ns, until_ns, (key,)):
            try:
                latest |= {t.child: t for t in decode_transforms(message.payload)}
            except MessageError:
                # Counted when it is played.
                continue
        return list(latest.values())

    def _show_map(self) -> None:
        recording = self.recording
        keyframe = recording.latest(keys.MAP_KEYFRAME, self.time_ns)
        since_ns = recording.start_ns - 1
        gap = recording.latest(GAP_KEY, self.time_ns)
        self._whole = keyframe is not None and (gap is None or gap.time_ns < keyframe.time_ns)
        if keyframe is None:
            self._emit(keys.MAP_KEYFRAME, _no_voxels())
        else:
            self._emit(keys.MAP_KEYFRAME, keyframe.payload)
            since_ns = keyframe.time_ns
        for message in recording.between(since_ns, self.time_ns, (keys.MAP_VOXELS,)):
            self._emit(message.key, message.payload)

    def _past(self) -> SeekHistory:
        timeline, now = self.timeline, self.time_ns
        trail = timeline.trail[: bisect_right(timeline.trail, now, key=lambda p: p.time_ns)]
        statuses = timeline.statuses[
            : bisect_right(timeline.statuses, now, key=lambda s: s.time_ns)
        ]
        events = timeline.events[: bisect_right(timeline.events, now, key=lambda e: e.time_ns)]
        return SeekHistory(
            trail=[(p.x, p.y, p.z) for p in trail[:: 1 + len(trail) // TRAIL_POINTS]],
            statuses=[_plotted(s.status) for s in statuses[:: 1 + len(statuses) // PLOT_POINTS]],
            events=[e.event for e in events[-SHOWN_EVENTS:]],
        )


def _plotted(status: Status) -> Status:
    """Return a status with what plots show: goals and finds of a thousand are too long to read."""
    return msgspec.structs.replace(
        status, why="", goal=None, queue=[], history=[], find=None, streams=[], notes=[], tour=[],
        walk=None,
    )  # fmt: skip


def _no_voxels() -> bytes:
    none = np.empty(0, np.uint8)
    return encode_voxels(
        VoxelCloud(
            stamp_ns=0,
            centers_world=np.empty((0, 3), np.float32),
            color=np.empty((0, 3), np.uint8),
            ooi=none,
            proximity=none,
            level=none,
            label=none,
            confidence=none,
            removed=np.empty(0, np.bool_),
        )
    )

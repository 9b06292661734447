"""Timeline of a session: trajectory, statuses, events and marks.

The recorder attaches it to the file, so that a long recording opens without being read. For a file
without one it is built by reading the messages.
"""

import itertools
import math
from bisect import bisect_left
from dataclasses import dataclass
from functools import cached_property
from typing import Final, Literal

import msgspec
import numpy as np
import zstandard

from app.messages import keys
from app.messages.cdr import MessageError
from app.messages.control import decode
from app.messages.memory import MapAlignment
from app.messages.motion import StampedTransform, decode_transforms
from app.messages.recording import RecordingGap
from app.messages.status import Event, LevelTable, Status, is_next_run
from app.recording.base_pose import BasePose
from app.recording.channels import GAP_KEY
from app.recording.errors import RecordingError
from app.recording.reading.recording import Recording
from ippon.decompression import unpack_zstd
from ippon.geometry import Float64Array, transform_points
from ippon.vocabulary import in_words

TIMELINE_ATTACHMENT: Final = "ippon/digest.json.zst"
TIMELINE_KEYS: Final = (
    keys.STATUS, keys.EVENT, keys.TF, keys.TF_STATIC, keys.LEVELS, keys.MAP_ALIGNMENT,
    GAP_KEY,
)  # fmt: skip
STATUS_EVERY_NS: Final = 500_000_000
REST_EVERY_NS: Final = 10_000_000_000
"""The same while nothing is searched for and `_TOLD` stays as it is."""
_TOLD: Final = ("state", "goal", "find", "tour", "drive", "lease", "localization")
TRAIL_STEP_M: Final = 0.05
_MAX_BYTES: Final = 1 << 28
_FEW_STATUSES: Final = 1000
"""Fewer are not left out: something else is too long."""
_SAMPLE_NS: Final = 2_000_000_000
_MOST_SAMPLES: Final = 500
_POSES_NS: Final = 250_000_000
"""Time before a sample in which the transforms between world and base are read."""

MarkKind = Literal[
    "query", "levels", "detection", "found", "rejected", "confirmed", "takeover", "contact",
    "stopped", "lost", "exhausted", "cancelled", "error",
]  # fmt: skip
MARKS: Final[dict[str, MarkKind]] = {
    "goal_set": "query",
    "level_changed": "levels",
    "found": "found",
    "rejected": "rejected",
    "doubted": "rejected",
    "opinion": "detection",
    "reconsidered": "detection",
    "confirmed": "confirmed",
    "exhausted": "exhausted",
    "cancelled": "cancelled",
    "contact": "contact",
    "drive": "takeover",
    "stopped": "stopped",
    "stream_lost": "lost",
    "error": "error",
}
"""Kind of mark for each kind of event that is marked on the timeline."""


class TrailPoint(msgspec.Struct, frozen=True, array_like=True):
    """Position of the robot, world frame, metres."""

    time_ns: int
    x: float
    y: float
    z: float


class TimedStatus(msgspec.Struct, frozen=True, array_like=True):
    """A status, without streams, queue, history, notes and `why`."""

    time_ns: int
    status: Status


class EndedRun(msgspec.Struct, frozen=True, array_like=True):
    """A run of the navigator that another one followed in the same session."""

    last: Status
    """Its last status, whole."""
    n_statuses: int
    """Number of the timeline's statuses up to its end."""


class TimedEvent(msgspec.Struct, frozen=True, array_like=True):
    """An event and its time."""

    time_ns: int
    event: Event


class Mark(msgspec.Struct, frozen=True):
    """A mark on the timeline."""

    time_ns: int
    kind: MarkKind
    text: str


@dataclass(frozen=True, slots=True)
class Transforms:
    """A message of `tf` or `tf_static`."""

    transforms: tuple[StampedTransform, ...]
    are_fixed: bool


TimelineMessage = Status | Event | LevelTable | MapAlignment | RecordingGap | Transforms


def decoded(key: str, payload: bytes) -> TimelineMessage | None:
    """Return a message of `TIMELINE_KEYS`; None if it cannot be decoded."""
    try:
        if key == keys.STATUS:
            return decode(payload, Status)
        if key == keys.EVENT:
            return decode(payload, Event)
        if key in (keys.TF, keys.TF_STATIC):
            return Transforms(decode_transforms(payload), are_fixed=key == keys.TF_STATIC)
        if key == keys.MAP_ALIGNMENT:
            return decode(payload, MapAlignment)
        if key == GAP_KEY:
            return decode(payload, RecordingGap)
        return decode(payload, LevelTable) if key == keys.LEVELS else None
    except (MessageError, msgspec.DecodeError):
        # The reader of the file counts broken messages.
        return None


class SessionTimeline(msgspec.Struct, kw_only=True, dict=True):
    """Summary of a session over time; built by `take` of every message of `TIMELINE_KEYS`."""

    trail: list[TrailPoint] = []
    statuses: list[TimedStatus] = []
    events: list[TimedEvent] = []
    marks: list[Mark] = []
    last: Status | None = None
    """The last status of all."""
    ended: list[EndedRun] = []
    """The runs of the navigator before its last one."""
    found_ns: int | None = None
    """When the last find was announced."""
    levels_of: int | None = None
    """Goal of the last table of levels."""
    dropped: int = 0
    """Messages that arrived faster than they were written, and are missing."""

    @cached_property
    def _base(self) -> BasePose:
        """The pose of the base; not stored."""
        return BasePose()

    def take(self, key: str, payload: bytes, time_ns: int) -> None:
        """Add one message; ignore it if it cannot be decoded."""
        self.add(decoded(key, payload), time_ns)

    def add(self, message: TimelineMessage | None, time_ns: int) -> None:
        """Add one decoded message; None adds nothing."""
        if isinstance(message, Status):
            self._add_status(message, time_ns)
        elif isinstance(message, Event):
            self._add_event(message, time_ns)
        elif isinstance(message, Transforms):
            self._add_transforms(message, time_ns)
        elif isinstance(message, LevelTable):
            self._add_levels(message, time_ns)
        elif isinstance(message, MapAlignment):
            self._align(message.as_transform())
        elif isinstance(message, RecordingGap):
            self.dropped += message.dropped

    def driven_m(self) -> float:
        """Return the length of the way over the floor, metres."""
        points = [(p.x, p.y) for p in self.trail]
        return sum(math.dist(a, b) for a, b in itertools.pairwise(points))

    def lacks_runs(self) -> bool:
        """Return whether runs of the navigator are not told apart, as in older files."""
        pairs = itertools.pairwise(one.status for one in self.statuses)
        return not self.ended and any(is_next_run(before, now) for before, now in pairs)

    def problems(self) -> tuple[str, ...]:
        """Return what a user should know of the recording."""
        if not self.dropped:
            return ()
        return (f"messages are missing because the disk was too slow: {self.dropped}",)

    def _add_status(self, status: Status, time_ns: int) -> None:
        before = self.last
        self.last = status
        is_first = False
        if before is not None and is_next_run(before, status):
            is_first = True
            self.ended.append(EndedRun(before, len(self.statuses)))
        likely = status.best_ooi >= 0.5
        if likely and before is not None and before.best_ooi < 0.5 and status.goal is not None:
            name = in_words(status.goal.object)
            self.marks.append(Mark(time_ns, "detection", f"something looks like the {name}"))
        if self.statuses and not is_first:
            kept = self.statuses[-1]
            every_ns = REST_EVERY_NS if _rests(kept.status, status) else STATUS_EVERY_NS
            if time_ns < kept.time_ns + every_ns:
                return
        brief = msgspec.structs.replace(status, streams=[], queue=[], history=[], notes=[], why="")
        self.statuses.append(TimedStatus(time_ns, brief))

    def _add_event(self, event: Event, time_ns: int) -> None:
        self.events.append(TimedEvent(time_ns, event))
        kind = MARKS.get(event.kind)
        if kind is not None:
            self.marks.append(Mark(time_ns, kind, event.text))
        if event.kind == "found":
            self.found_ns = time_ns

    def _add_levels(self, table: LevelTable, time_ns: int) -> None:
        # The first table of a goal belongs to its query; later ones are edits or answers.
        if table.goal_id == self.levels_of:
            self.marks.append(Mark(time_ns, "levels", f"levels changed ({table.provider})"))
        self.levels_of = table.goal_id

    def _align(self, T_map_world: Float64Array) -> None:
        """Follow an alignment; the first one applies to what is before it (`MapAlignments`)."""
        if self._base.T_map_world is None and self.trail:
            points = np.array([(one.x, one.y, one.z) for one in self.trail])
            moved = zip(self.trail, transform_points(T_map_world, points).tolist(), strict=True)
            self.trail = [_trail_point(one.time_ns, *place) for one, place in moved]
        self._base.T_map_world = T_map_world

    def _add_transforms(self, message: Transforms, time_ns: int) -> None:
        self._base.take(message.transforms, fixed=message.are_fixed)
        T_world_base = self._base.pose()
        if T_world_base is None:
            return
        x, y, z = T_world_base[:3, 3].tolist()
        last = self.trail[-1] if self.trail else None
        if last is None or math.dist((last.x, last.y, last.z), (x, y, z)) >= TRAIL_STEP_M:
            self.trail.append(_trail_point(time_ns, x, y, z))


def _rests(before: Status, now: Status) -> bool:
    """Return whether nothing is searched for, and nothing changed but figures and the map."""
    goals = now.tour or [now.goal]
    if any(goal is not None and goal.outcome == "active" for goal in goals):
        return False
    stands = abs(now.path_length_m - before.path_length_m) < TRAIL_STEP_M
    return stands and all(getattr(before, name) == getattr(now, name) for name in _TOLD)


def _trail_point(time_ns: int, x: float, y: float, z: float) -> TrailPoint:
    return TrailPoint(time_ns, round(x, 3), round(y, 3), round(z, 3))


def pack_timeline(timeline: SessionTimeline) -> bytes:
    """Encode a timeline as an attachment, with fewer statuses if it is too long to be read."""
    encoded = msgspec.json.encode(timeline)
    while len(encoded) > _MAX_BYTES and len(timeline.statuses) > _FEW_STATUSES:
        timeline = _with_half_of_statuses(timeline)
        encoded = msgspec.json.encode(timeline)
    return zstandard.ZstdCompressor(level=3).compress(encoded)


def _with_half_of_statuses(timeline: SessionTimeline) -> SessionTimeline:
    """Return a timeline with every other status, and the first one of each run."""
    starts = {one.n_statuses for one in timeline.ended}
    kept = [k for k in range(len(timeline.statuses)) if k % 2 == 0 or k in starts]
    ended = [EndedRun(one.last, bisect_left(kept, one.n_statuses)) for one in timeline.ended]
    statuses = [timeline.statuses[k] for k in kept]
    return msgspec.structs.replace(timeline, statuses=statuses, ended=ended)


def unpack_timeline(packed: bytes) -> SessionTimeline:
    """Read `pack_timeline`.

    Raises:
        RecordingError: The data cannot be decoded, or are of another version.
    """
    try:
        return decode(unpack_zstd(packed, _MAX_BYTES), SessionTimeline)
    except (zstandard.ZstdError, msgspec.DecodeError) as error:
        raise RecordingError(f"the recording's timeline is not understood: {error}") from error


def timeline_of(recording: Recording) -> SessionTimeline:
    """Return the timeline attached to a file, or build it from the messages."""
    packed = recording.attachment(TIMELINE_ATTACHMENT)
    if packed is not None:
        try:
            timeline = unpack_timeline(packed)
            if not timeline.lacks_runs():
                return timeline
        except RecordingError as error:
            recording.index.problems.append(str(error))
    timeline = SessionTimeline()
    for message in recording.all_messages(TIMELINE_KEYS):
        timeline.take(message.key, message.payload, message.time_ns)
    return timeline


def sampled_timeline(recording: Recording) -> SessionTimeline:
    """Return statuses and trail of every other second, for a summary of a file that grows.

    Of a long session that are fewer, as a list of sessions is shown again and again.
    """
    timeline = SessionTimeline()
    step_ns = max(_SAMPLE_NS, (recording.end_ns - recording.start_ns) // _MOST_SAMPLES)
    for message in recording.all_messages((keys.TF_STATIC,)):
        timeline.take(message.key, message.payload, message.time_ns)
    before_ns = recording.start_ns - 1
    now_ns = min(recording.start_ns + _POSES_NS, recording.end_ns)
    while before_ns < recording.end_ns:
        for message in recording.between(before_ns, now_ns, (keys.MAP_ALIGNMENT, GAP_KEY)):
            timeline.take(message.key, message.payload, message.time_ns)
        for message in recording.between(now_ns - _POSES_NS, now_ns, (keys.TF,)):
            timeline.take(message.key, message.payload, message.time_ns)
        status = recording.latest(keys.STATUS, now_ns)
        if status is not None and status.time_ns > before_ns:
            timeline.take(status.key, status.payload, status.time_ns)
        before_ns, now_ns = now_ns, min(now_ns + step_ns, recording.end_ns)
    return timeline

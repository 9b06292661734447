"""Writing of a session: file, timeline, limits, name."""

import io
import json
import math
import platform
import re
import shutil
import time
from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Final

import msgspec
from PIL import Image

from app.messages import keys
from app.messages.cdr import MessageError
from app.messages.images import decode_color, decompress_color
from app.messages.scene import decode_found_objects, decode_tree
from app.recording.channels import GAP_KEY, MARKERS_KEY
from app.recording.session_goals import goals_of, outcome_of
from app.recording.timeline import (
    TIMELINE_ATTACHMENT,
    TIMELINE_KEYS,
    SessionTimeline,
    decoded,
    pack_timeline,
)
from app.recording.writing.limits import LimitCheck, RecordingLimits, check_limits
from app.recording.writing.markers import encode_markers
from app.recording.writing.rest import RestWatch
from app.recording.writing.subsampling import Arrived, RestSubsampling, SensorSubsampling
from app.recording.writing.writer import SessionWriter

THUMBNAIL: Final = "ippon/thumbnail.jpg"
SUMMARY: Final = "ippon/summary"
VERSIONS: Final = "ippon/versions"
CONFIGURATION: Final = "ippon/configuration.json"
MARKERS_EVERY_S: Final = 1.0
_THUMBNAIL_PX: Final = 320
_PACKAGES: Final = ("ippon", "numpy", "numba", "ompl", "eclipse-zenoh", "mcap")


def session_name(robot: str, wall_s: float) -> str:
    """Return the name of a new session's folder; sorting by name sorts by time."""
    when = time.strftime("%Y-%m-%d_%H-%M-%S", time.localtime(wall_s))
    return f"{when}_{re.sub(r'[^A-Za-z0-9.-]+', '_', robot)[:60]}"


class Session:
    """Records the messages of a robot; owned by one thread."""

    def __init__(
        self,
        root: Path,
        robot: str,
        limits: RecordingLimits,
        wall_ns: int,
        sensor_hz: float = 0.0,
    ) -> None:
        """Begin a session in a new folder under `root`.

        Args:
            root: Folder of the sessions.
            robot: Key prefix.
            limits: Limits of the recording.
            wall_ns: Present time, nanoseconds since 1970.
            sensor_hz: See `SensorSubsampling`.

        Raises:
            OSError: The folder cannot be written.
        """
        self.writer = SessionWriter(_unused(root / session_name(robot, wall_ns * 1e-9)), robot)
        self.timeline = SessionTimeline()
        self.start_ns = wall_ns
        self._limits = limits
        self._thinning = SensorSubsampling(sensor_hz)
        self._rest = RestWatch()
        self._resting = RestSubsampling() if sensor_hz > 0.0 else None
        self._image: bytes | None = None
        self._found_image: bytes | None = None
        self._tree: bytes | None = None
        self._finds: bytes | None = None
        self._marked_at = self._now_s = -math.inf
        self.writer.note_metadata(VERSIONS, {**_versions(robot), "sensor_hz": f"{sensor_hz:g}"})
        try:
            self.writer.flush()
        except OSError:
            self.writer.discard()
            raise

    def add(self, key: str, payload: bytes, wall_ns: int, now_s: float) -> None:
        """Write a message unchanged.

        Raises:
            OSError: The disk cannot be written.
        """
        if key == keys.COLOR:
            self._image = payload
        self._now_s = now_s
        kept = self._thinned(Arrived(key, payload, wall_ns), now_s)
        if not kept:
            return
        for one in kept:
            self.writer.add(one.key, one.payload, one.wall_ns, now_s)
        if key in TIMELINE_KEYS:
            had = self.timeline.found_ns
            message = decoded(key, payload)
            self.timeline.add(message, wall_ns)
            self._rest.note(message, now_s)
            if key == GAP_KEY and self._resting is not None:
                self._resting.forget()
            if self.timeline.found_ns != had:
                self._found_image = self._image
        elif key == keys.CONFIGURATION:
            self.writer.attach(CONFIGURATION, "application/json", payload, wall_ns)
        elif key == keys.PLAN_TREE:
            self._tree = payload
        elif key == keys.DETECTIONS:
            self._finds = payload
        if now_s - self._marked_at >= MARKERS_EVERY_S and self._tree is not None:
            self._marked_at = now_s
            self._add_markers(wall_ns, now_s)

    def check(self) -> LimitCheck:
        """Compare with the limits.

        Raises:
            OSError: The disk is not available.
        """
        free = shutil.disk_usage(self.writer.folder).free
        return check_limits(self._limits, self.writer.written_bytes, free)

    def close(self) -> None:
        """End the session: timeline, summary, picture, indexes."""
        end_ns = time.time_ns()
        writer = self.writer
        for one in self._thinning.drain():
            writer.add(one.key, one.payload, one.wall_ns, self._now_s)
        writer.attach(TIMELINE_ATTACHMENT, "application/zstd", pack_timeline(self.timeline), end_ns)
        picture = thumbnail(self._found_image or self._image)
        if picture is not None:
            writer.attach(THUMBNAIL, "image/jpeg", picture, end_ns)
        writer.note_metadata(SUMMARY, summary_of(self.timeline, writer.duration_s))
        writer.close()

    def _thinned(self, message: Arrived, now_s: float) -> list[Arrived]:
        """Return what is to be written now."""
        due = [*self._thinning.overdue(message.wall_ns), *self._thinning.take(message)]
        if self._resting is None:
            return due
        if self._rest.is_at_rest(now_s):
            return self._resting.take(due)
        return [*self._resting.colors_of(due), *due]

    def _add_markers(self, wall_ns: int, now_s: float) -> None:
        try:
            stamp_ns, tree = decode_tree(self._tree or b"")
            finds = decode_found_objects(self._finds)[1] if self._finds is not None else ()
        except MessageError:
            # Undecodable messages have no markers; their bytes are recorded.
            return
        self.writer.add(MARKERS_KEY, encode_markers(tree, finds, stamp_ns), wall_ns, now_s)


def summary_of(timeline: SessionTimeline, duration_s: float) -> dict[str, str]:
    """Return the entries of a session for a list, as text by name."""
    last = timeline.last
    summary = {"duration_s": f"{duration_s:.1f}", "dropped": f"{timeline.dropped}"}
    if last is None:
        return summary
    goals = goals_of(timeline)
    summary |= {
        "robot": last.robot,
        "path_length_m": f"{timeline.driven_m():.2f}",
        "explored_m2": f"{last.explored_m2:.1f}",
        "goals": json.dumps([msgspec.to_builtins(goal) for goal in goals]),
    }
    if goals:
        goal = goals[-1]
        summary |= {"object": goal.object, "context": goal.context, "outcome": outcome_of(goal)}
    return summary


def thumbnail(color: bytes | None) -> bytes | None:
    """Return a colour image's payload as a small JPEG, None if it cannot be decoded."""
    if color is None:
        return None
    try:
        pixels = decompress_color(decode_color(color).encoded)
    except MessageError:
        return None
    image = Image.fromarray(pixels)
    image.thumbnail((_THUMBNAIL_PX, _THUMBNAIL_PX))
    out = io.BytesIO()
    image.save(out, "JPEG", quality=80)
    return out.getvalue()


def _unused(folder: Path) -> Path:
    """Return the folder, with a number where another session began in the same second."""
    candidate, number = folder, 2
    while candidate.exists():
        candidate = folder.with_name(f"{folder.name}_{number}")
        number += 1
    return candidate


def _versions(robot: str) -> dict[str, str]:
    found: Mapping[str, str] = {name: _version(name) for name in _PACKAGES}
    return {"robot": robot, "python": platform.python_version(), **found}


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "not installed"

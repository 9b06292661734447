"""List of the sessions in a folder, cached so that long lists load quickly."""

import logging
import time
from collections.abc import Callable
from pathlib import Path
from typing import Final

import msgspec

from app.messages.control import decode
from app.messages.status import GoalStatus
from app.process.file_lock import is_held
from app.recording.errors import RecordingError
from app.recording.reading.bag_files import STORED, files_of, is_one_bag
from app.recording.reading.file_index import ByteRange
from app.recording.reading.recording import Recording
from app.recording.session_goals import SessionGoal, session_goal
from app.recording.timeline import sampled_timeline, timeline_of
from app.recording.writing.session import SUMMARY, THUMBNAIL, summary_of
from ippon.atomic_file import replace_file

logger = logging.getLogger(__name__)

CACHE_NAME: Final = ".ippon-sessions.json"
MAX_DEPTH: Final = 3
JPEG: Final = b"\xff\xd8"


class SessionEntry(msgspec.Struct, frozen=True, kw_only=True):
    """One session of a list."""

    id: str
    """Path below the folder."""
    size: int
    changed_ns: int
    picture_offset: int
    """Offset of the picture in the file, so that it is read without scanning the file."""
    picture_bytes: int
    """0 without a picture."""
    when: str = ""
    object: str = ""
    context: str = ""
    outcome: str = ""
    """Object, context and outcome of the last goal."""
    goals: list[SessionGoal]
    """All goals, in the order of their searches."""
    robot: str = ""
    duration_s: float = 0.0
    path_length_m: float = 0.0
    problem: str = ""


def list_sessions(
    folder: Path, progress: Callable[[int, int], None] | None = None
) -> list[SessionEntry]:
    """Return the sessions in a folder, newest first; unchanged files come from the cache.

    Raises:
        RecordingError: There is no such folder.
    """
    if not folder.is_dir():
        raise RecordingError(f"there is no folder {folder}")
    known = {entry.id: entry for entry in _read_cache(folder)}
    files = recordings_in(folder)
    entries: list[SessionEntry] = []
    fresh = 0
    for n, path in enumerate(files):
        name = _id(folder, path)
        entry = known.get(name)
        try:
            size, changed_ns = _state(path)
            if entry is None or (entry.size, entry.changed_ns) != (size, changed_ns):
                entry = _read(path, name, size, changed_ns)
                fresh += 1
            entries.append(entry)
        except (FileNotFoundError, RecordingError):
            # It was removed meanwhile, or is a link to a file that was.
            logger.info("%s is not there any more", path)
        if progress is not None:
            progress(n + 1, len(files))
    if fresh or len(known) != len(entries):
        _write_cache(folder, entries)
    return sorted(entries, key=lambda entry: entry.when, reverse=True)


def path_of(folder: Path, name: str, entries: list[SessionEntry]) -> Path | None:
    """Return the file of a listed session, or the folder of a bag; None for any other name."""
    if not any(entry.id == name for entry in entries):
        return None
    return folder / name


def picture_of(folder: Path, name: str, entries: list[SessionEntry]) -> bytes | None:
    """Return the thumbnail of a listed session, None if it has none or the file is gone."""
    entry = next((entry for entry in entries if entry.id == name), None)
    if entry is None:
        return None
    try:
        with (folder / name).open("rb") as file:
            file.seek(entry.picture_offset)
            picture = file.read(entry.picture_bytes)
    except OSError:
        return None
    return picture if picture.startswith(JPEG) else None


def is_folder_of_recordings(path: Path) -> bool:
    """Return whether a path is a folder to list, and not a file, or that of one session or bag."""
    return path.is_dir() and not is_one_bag(path)


def recordings_in(folder: Path) -> list[Path]:
    """Return the recordings in a folder and the folders below, in the order of their names.

    Returns:
        Files, and in place of those of one bag the folder that holds them, unless that is a single
        MCAP file.
    """
    files: dict[Path, list[Path]] = {}
    pattern = ""
    for _ in range(MAX_DEPTH):
        for path in folder.glob(f"{pattern}*"):
            if path.name.endswith(STORED) and not path.is_dir():
                files.setdefault(path.parent, []).append(path)
        pattern += "*/"
    found: list[Path] = []
    for parent, inside in files.items():
        is_alone = len(inside) == 1 and inside[0].suffix == ".mcap"
        is_bag = parent != folder and not is_alone and is_one_bag(parent)
        found += [parent] if is_bag else inside
    return sorted(found)


def _state(path: Path) -> tuple[int, int]:
    """Return the size of a recording, and when it was changed, nanoseconds since 1970.

    Raises:
        FileNotFoundError: It is not there.
        RecordingError: Its folder holds no bag any more.
    """
    if not path.is_dir():
        state = path.stat()
        return state.st_size, state.st_mtime_ns
    # A part that metadata.yaml names may be missing.
    states = [part.stat() for part in files_of(path) if part.exists()]
    return sum(s.st_size for s in states), max((s.st_mtime_ns for s in states), default=0)


def _id(folder: Path, path: Path) -> str:
    return path.relative_to(folder).as_posix()


def _read(path: Path, name: str, size: int, changed_ns: int) -> SessionEntry:
    try:
        recording = Recording(path)
    except RecordingError as error:
        return SessionEntry(
            id=name,
            size=size,
            changed_ns=changed_ns,
            picture_offset=0,
            picture_bytes=0,
            goals=[],
            problem=str(error),
        )
    try:
        summary = recording.index.metadata.get(SUMMARY)
        if summary is None:
            # What is being recorded changes until the list is shown again.
            is_growing = not (recording.index.complete or path.is_dir()) and is_held(path)
            timeline = sampled_timeline(recording) if is_growing else timeline_of(recording)
            summary = summary_of(timeline, recording.duration_s)
        picture = recording.index.attachments.get(THUMBNAIL, ByteRange(offset=0, length=0))
        start = time.localtime(recording.start_ns * 1e-9)
        return SessionEntry(
            id=name,
            size=size,
            changed_ns=changed_ns,
            picture_offset=picture.offset,
            picture_bytes=picture.length,
            when=time.strftime("%Y-%m-%d %H:%M:%S", start),
            object=summary.get("object", ""),
            context=summary.get("context", ""),
            outcome=summary.get("outcome", ""),
            goals=_goals(summary),
            robot=summary.get("robot", ""),
            # Recorders of earlier versions counted their wait for the robot in the summary.
            duration_s=recording.duration_s,
            path_length_m=_number(summary, "path_length_m"),
        )
    finally:
        recording.close()


def _goals(summary: dict[str, str]) -> list[SessionGoal]:
    try:
        goals = decode(summary.get("goals", "[]").encode(), list[GoalStatus])
    except msgspec.DecodeError:
        # A recording of another version has goals of another form.
        return []
    return [session_goal(goal) for goal in goals]


def _number(summary: dict[str, str], name: str) -> float:
    try:
        return float(summary.get(name, "0"))
    except ValueError:
        return 0.0


def _read_cache(folder: Path) -> list[SessionEntry]:
    try:
        return decode((folder / CACHE_NAME).read_bytes(), list[SessionEntry])
    except (OSError, msgspec.DecodeError):
        # Without a cache, or with one of another version, the files are read.
        return []


def _write_cache(folder: Path, entries: list[SessionEntry]) -> None:
    try:
        replace_file(folder / CACHE_NAME, msgspec.json.encode(entries))
    except OSError as error:
        logger.info("the list of sessions is not cached in %s: %s", folder, error.strerror)

"""Repair of recordings that were not ended: rewrites their messages with an index."""

import os
from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from mcap.writer import CompressionType, Writer

from app.messages import keys
from app.messages.cdr import MessageError
from app.messages.keys import BASE_FRAME
from app.process.file_lock import is_held
from app.recording.camera_topics import COLORS, DEPTHS, POSES, image_problems, mixed, topic_problem
from app.recording.channels import GAP_KEY, USUAL, Names, Topic, to_recorded, topic_of
from app.recording.depth_pairs import FEW, DepthPairs
from app.recording.errors import RecordingError
from app.recording.frame_tree import FrameTree
from app.recording.reading.bag_files import files_of
from app.recording.reading.recording import OtherTopic, Recording
from app.recording.timeline import (
    TIMELINE_ATTACHMENT,
    SessionTimeline,
    pack_timeline,
    timeline_of,
)
from app.recording.writing.bag_metadata import write_bag_metadata
from app.recording.writing.session import CONFIGURATION, SUMMARY, THUMBNAIL, summary_of, thumbnail
from app.recording.writing.writer import CHUNK_BYTES, PROFILE, register
from ippon.atomic_file import set_aside

_CAMERA: Final = (POSES, COLORS, DEPTHS, (keys.CAMERA_INFO,))
"""Topics that a map needs, each with the one that may stand for it."""
_SESSION: Final = ((keys.STATUS,), *_CAMERA, (keys.MAP_VOXELS,), (keys.MAP_KEYFRAME,))
"""Topics of a complete session of ours."""
MOST_CUT_BYTES: Final = 2 * CHUNK_BYTES
"""What a file that was cut off has at its end without being damaged: its last chunk."""

NOT_OURS: Final = (
    "it was not written by ippon and stays as it is: what there is of it is read, and "
    "`mcap recover` repairs an MCAP file for other programs"
)
STILL_WRITTEN: Final = "it is still being recorded, and stays as it is: check it again at its end"


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordingCheck:
    """Result of checking a recording."""

    messages: int
    duration_s: float
    complete: bool
    """Whether the file was ended properly."""
    ours: bool
    """Whether `ippon` has written it."""
    repaired: bool
    problems: tuple[str, ...]
    missing: tuple[str, ...]
    """Expected topics that it lacks."""
    others: tuple[OtherTopic, ...] = ()
    """Topics that are not used, by name; `messages` does not count theirs."""
    kept: str = ""
    """Name of the file as it was, where more of it was unreadable than the end of a cut one."""


def check(
    path: Path,
    *,
    repair: bool,
    names: Names = USUAL,
    mount: bool = False,
    clock_offset_s: float = 0.0,
    base: str = BASE_FRAME,
) -> RecordingCheck:
    """Check a recording, and rewrite it if it was not ended.

    The new file replaces the old one only when it is complete, so that a crash loses nothing. The
    old one is kept where parts of it are damaged: another program may read more. A file that is
    still being recorded, and one of another program, stays as it is.

    Args:
        path: The file, or a session's folder.
        repair: Whether to rewrite a file of ours.
        names: Topics of a robot that has names of its own.
        mount: A profile says where the camera is on the base.
        clock_offset_s: How far the camera's clock is behind that of the poses.
        base: Frame of the base, of a bag that has no frame `base_link`.

    Raises:
        RecordingError: It is not a recording, is empty, or the repaired file cannot be written.
    """
    before = _state(files_of(path)[0])
    recording = Recording(path, names=names)
    ours = "robot" in recording.index.metadata.get("ippon/versions", {})
    try:
        tree, pairs = FrameTree(clock_offset_s, base), DepthPairs()
        count = _take_all(recording, tree, pairs)
        problems = [*_problems(recording, tree, pairs, mount=mount)]
        if not ours:
            problems += _problems_of_others(recording, pairs)
        expected = _SESSION if ours else _CAMERA
        missing = tuple(some[0] for some in expected if not set(some) & set(recording.keys))
        live = not recording.index.complete and is_held(recording.path)
        if not ours and not recording.index.complete and not live:
            problems.append(NOT_OURS)
        mended, kept = False, None
        if repair and not recording.index.complete and not live and ours:
            mended, kept = _rewrite(recording, before)
            live = not mended
        if live:
            problems.append(STILL_WRITTEN)
        return RecordingCheck(
            messages=count,
            duration_s=recording.duration_s,
            complete=recording.index.complete,
            ours=ours,
            repaired=mended,
            problems=tuple(problems),
            missing=missing,
            others=recording.others(),
            kept="" if kept is None else kept.name,
        )
    finally:
        recording.close()


def _take_all(recording: Recording, tree: FrameTree, pairs: DepthPairs) -> int:
    """Read a recording into its frames and pairs of images; return the number of its messages."""
    count = 0
    for message in recording.all_messages():
        count += 1
        with suppress(MessageError):
            tree.add(message.key, message.payload)
        pairs.add(message.key, message.payload)
    return count


def _problems(
    recording: Recording, tree: FrameTree, pairs: DepthPairs, *, mount: bool
) -> Iterator[str]:
    yield from recording.index.problems
    yield from (f"{text} ({n} messages)" for text, n in recording.damaged.items())
    yield from _missing_messages(recording)
    if problem := _pose_problem(recording, tree, pairs.colors, mount=mount):
        yield problem


def _missing_messages(recording: Recording) -> tuple[str, ...]:
    timeline = SessionTimeline()
    for message in recording.all_messages((GAP_KEY,)):
        timeline.take(message.key, message.payload, message.time_ns)
    return timeline.problems()


def _problems_of_others(recording: Recording, pairs: DepthPairs) -> Iterator[str]:
    """Yield what a recording of another program lacks for a map."""
    # `ippon record` leaves out depth images on purpose.
    if problem := pairs.problem():
        yield problem
    yield from image_problems(recording)
    if problem := topic_problem(recording, poses=True):
        yield problem


def _pose_problem(recording: Recording, tree: FrameTree, colors: list[int], *, mount: bool) -> str:
    """Return why no image has a pose, or that many have none.

    Empty where they have, and for a recording without poses.
    """
    if not set(POSES) & set(recording.keys):
        return ""
    if tree.base != BASE_FRAME and BASE_FRAME in tree.names:
        return f"it has a frame {BASE_FRAME!r}, whose place {tree.base!r} cannot take"
    used, problem = tree.completed(mount=mount)
    if problem and used.lacks_base:
        problem += ", or --base-frame names the frame of the base"
    if problem and not mount:
        problem += tree.mount_hint
    if problem:
        return f"no image has a pose: {problem}"
    if used.by_odometry and (several := mixed(recording, (keys.ODOM,))):
        return several
    count = used.count_unposed(colors)
    if count <= FEW * len(colors):
        return ""
    return (
        f"{count} of {len(colors)} colour images are from before the first pose or after the last "
        "one: they are not mapped"
    )


def _state(path: Path) -> tuple[int, int]:
    """Return the size of a file and when it was changed; zeros for one that is missing."""
    try:
        state = path.stat()
    except OSError:
        return 0, 0
    return state.st_size, state.st_mtime_ns


def _rewrite(recording: Recording, before: tuple[int, int]) -> tuple[bool, Path | None]:
    """Replace a file, unless it is not what it was before it was read.

    Where a file system has no locks, a recorder is noticed by what it writes.

    Returns:
        Whether it was replaced, and the new name of the old one, None where it is gone.

    Raises:
        RecordingError: The new file cannot be written.
    """
    path, kept = recording.path, None
    versions = recording.index.metadata["ippon/versions"]
    partial = path.with_name(path.name + ".partial")
    try:
        counts = _copy(recording, partial, versions)
        if _state(path) != before:
            partial.unlink()
            return False, None
        if recording.damaged or path.stat().st_size - recording.index.end > MOST_CUT_BYTES:
            kept = set_aside(path)
        partial.replace(path)
        write_bag_metadata(path.parent, path.name, counts, recording.start_ns, recording.end_ns)
    except OSError as error:
        with suppress(OSError):
            partial.unlink(missing_ok=True)
        raise RecordingError(f"the repaired {path} cannot be written: {error.strerror}") from error
    return True, kept


def _copy(recording: Recording, target: Path, versions: dict[str, str]) -> Counter[Topic]:
    counts: Counter[Topic] = Counter()
    channels: dict[str, tuple[int, Topic]] = {}
    schemas: dict[str, int] = {}
    with target.open("wb") as file:
        mcap = Writer(file, compression=CompressionType.ZSTD)
        mcap.start(profile=PROFILE, library="ippon")
        for name, values in recording.index.metadata.items():
            mcap.add_metadata(name, values)
        for message in recording.all_messages():
            if message.key not in channels:
                topic = topic_of(versions["robot"], message.key)
                channels[message.key] = (register(mcap, topic, schemas), topic)
            channel, topic = channels[message.key]
            data = to_recorded(topic, message.payload)
            mcap.add_message(channel, message.time_ns, data, message.time_ns)
            counts[topic] += 1
        _attach(recording, mcap)
        mcap.finish()
        file.flush()
        os.fsync(file.fileno())
    return counts


def _attach(recording: Recording, mcap: Writer) -> None:
    timeline, end_ns = timeline_of(recording), recording.end_ns
    picture = recording.latest(keys.COLOR, timeline.found_ns or end_ns)
    files = {
        CONFIGURATION: ("application/json", recording.attachment(CONFIGURATION)),
        TIMELINE_ATTACHMENT: ("application/zstd", pack_timeline(timeline)),
        THUMBNAIL: ("image/jpeg", thumbnail(picture.payload if picture is not None else None)),
    }
    for name, (kind, data) in files.items():
        if data is not None:
            mcap.add_attachment(end_ns, end_ns, name, kind, data)
    if SUMMARY not in recording.index.metadata:
        mcap.add_metadata(SUMMARY, summary_of(timeline, recording.duration_s))

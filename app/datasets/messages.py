"""The messages of a robot, from a dataset or a bag, in order and with their times."""

import logging
from collections import Counter
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from app.datasets.bag_poses import BagPoses, poses_of
from app.datasets.dataset import Dataset, DatasetError, read_color, read_depth
from app.datasets.floor_alignment import base_below, camera_on_base
from app.messages import keys
from app.messages.cdr import MessageError
from app.messages.depth.depth_images import encode_depth
from app.messages.images import decode_color_raw, encode_camera, encode_color
from app.messages.keys import CAMERA_FRAME
from app.messages.motion import encode_transforms, robot_transforms
from app.recording.camera_topics import COLORS, DEPTHS, mixed, topic_problem
from app.recording.channels import USUAL, Names
from app.recording.depth_pairs import FEW
from app.recording.errors import RecordingError
from app.recording.frame_tree import TOPICS
from app.recording.reading.bag_files import METADATA, stored_in
from app.recording.reading.recording import Recording
from app.recording.writing.session import VERSIONS
from ippon.frame import NANOSECONDS
from ippon.geometry import Float64Array

logger = logging.getLogger(__name__)

FROM_CAMERA: Final = (
    keys.COLOR, keys.COLOR_RAW, keys.DEPTH, keys.DEPTH_RAW, keys.CAMERA_INFO, keys.CONTACT,
)  # fmt: skip
SENT_ONCE: Final = (keys.CAMERA_INFO, keys.LABEL_NAMES, keys.DETECTOR_NAME)
"""Some drivers send these at their start alone: the last ones before a later start count there."""
TF_ALONE: Final = BagPoses()
"""The poses of a bag whose tf begins at `map`."""


@dataclass(frozen=True, slots=True)
class RobotMessage:
    """One message of the robot."""

    at_s: float
    """Time since the first message."""
    key: str
    payload: bytes


@dataclass(slots=True)
class Unreadable:
    """Messages of a bag that are skipped."""

    counts: Counter[str] = field(default_factory=Counter[str])
    """Their number by key."""
    reasons: dict[str, str] = field(default_factory=dict[str, str])
    """What is wrong with the first one of each key."""

    def add(self, key: str, reason: str) -> None:
        """Count a message."""
        self.counts[key] += 1
        self.reasons.setdefault(key, reason)

    def texts(self) -> dict[str, str]:
        """Return by key how many there are, and why."""
        return {
            key: f"{key}: {count} skipped as unreadable; the first: {self.reasons[key]}"
            for key, count in self.counts.items()
        }


def dataset_messages(
    dataset: Dataset, start_s: float, first_stamp_ns: int, T_map_world: Float64Array | None
) -> Iterator[RobotMessage]:
    """Yield pose, intrinsics, depth and colour of every frame.

    Args:
        dataset: The frames.
        start_s: Earlier frames are skipped.
        first_stamp_ns: Stamp of time 0.
        T_map_world: From `align_to_floor`; None to send no poses.

    Raises:
        DatasetError: An image cannot be read.
    """
    for frame in dataset.frames:
        if frame.time_s < start_s:
            continue
        stamp, at = first_stamp_ns + round(NANOSECONDS * frame.time_s), frame.time_s - start_s
        depth = read_depth(frame.depth, dataset.depth_unit_m, dataset.camera)
        color = read_color(frame.color, dataset.camera)
        if T_map_world is not None:
            yield RobotMessage(
                at, keys.TF, _pose_message(T_map_world @ frame.T_world_camera, stamp)
            )
        yield RobotMessage(at, keys.CAMERA_INFO, encode_camera(dataset.camera, stamp, CAMERA_FRAME))
        yield RobotMessage(at, keys.DEPTH, encode_depth(depth, stamp, CAMERA_FRAME))
        yield RobotMessage(at, keys.COLOR, encode_color(color, stamp, CAMERA_FRAME))


def _pose_message(T_map_camera: Float64Array, stamp_ns: int) -> bytes:
    T_map_base = base_below(T_map_camera)
    T_base_camera = camera_on_base(T_map_base, T_map_camera)
    return encode_transforms(robot_transforms(stamp_ns, T_map_base, T_base_camera))


def is_bag(path: Path) -> bool:
    """Return whether a path is a bag or a recording, and not the folder of a dataset."""
    return path.is_file() or (path.is_dir() and bool(stored_in(path) or (path / METADATA).exists()))


def bag_poses(
    path: Path,
    names: Names = USUAL,
    T_base_camera: Float64Array | None = None,
    clock_offset_s: float = 0.0,
    base: str = keys.BASE_FRAME,
) -> BagPoses:
    """Return where the poses of a bag come from: tf, or odometry in place of it.

    Args:
        path: See `bag_messages`.
        names: See `bag_messages`.
        T_base_camera: Mount of the camera, for a bag whose tf does not say it.
        clock_offset_s: How far the camera's clock is behind that of the poses.
        base: Frame of the base.

    Raises:
        DatasetError: It is not a bag, lacks a topic that a frame needs, has those of two cameras,
            or its transforms do not lead to the camera, or are of another time than its images.
    """
    messages = _bag_messages(path, 0.0, TOPICS, names)
    told = ((one.key, one.payload) for one in messages)
    return poses_of(path, told, T_base_camera, clock_offset_s, base)


def bag_messages(
    path: Path,
    start_s: float,
    *,
    heatmaps: bool,
    poses: BagPoses | None = TF_ALONE,
    names: Names = USUAL,
    told: bool = True,
    unreadable: Unreadable | None = None,
) -> Iterator[RobotMessage]:
    """Yield the recorded messages of the robot of a bag.

    Raw colour and odometry that cannot be read are skipped.

    Args:
        path: An MCAP file, a session's folder, or a rosbag2 folder.
        start_s: Earlier messages are skipped, except fixed transforms and the last ones of
            `SENT_ONCE`.
        heatmaps: Whether to send recorded heatmaps and detections.
        poses: Which of them are sent (`bag_poses`); None for none, and a bag needs none.
        names: Topics of a robot that has names of its own.
        told: Whether to log what is wrong with its files, and how many images are not mapped.
        unreadable: Counts what is skipped; None logs it at the end.

    Raises:
        DatasetError: It is not a bag, lacks a topic of a frame, has those of two cameras or
            sources of poses, or none of its raw colour images can be read.
    """
    seen = keys.SEEN if heatmaps else ()
    wanted = [*FROM_CAMERA, *seen, *(poses.keys if poses is not None else ())]
    if poses is not None and (fixed := poses.fixed()) is not None:
        yield RobotMessage(0.0, keys.TF_STATIC, fixed)
    known, skipped = poses is not None, unreadable or Unreadable()
    messages = _bag_messages(
        path, start_s, wanted, names, poses=known, odometry=keys.ODOM in wanted, colors=True,
        told=told,
    )  # fmt: skip
    for message in messages:
        try:
            sent = _converted(message, poses)
        except MessageError as error:
            skipped.add(message.key, str(error))
            continue
        yield sent
    for text in skipped.texts().values() if unreadable is None else ():
        logger.warning("%s: %s", path, text)


def _converted(message: RobotMessage, poses: BagPoses | None) -> RobotMessage:
    """Return raw colour compressed, odometry as tf, and others as they are.

    Raises:
        MessageError: It cannot be read.
    """
    if message.key == keys.COLOR_RAW:
        color = encode_color(*decode_color_raw(message.payload))
        return RobotMessage(message.at_s, keys.COLOR, color)
    if message.key == keys.ODOM and poses is not None:
        return RobotMessage(message.at_s, keys.TF, poses.converted(message.payload))
    return message


def _bag_messages(
    path: Path,
    start_s: float,
    wanted: Sequence[str],
    names: Names,
    *,
    poses: bool = True,
    odometry: bool = False,
    colors: bool = False,
    told: bool = False,
) -> Iterator[RobotMessage]:
    try:
        recording = Recording(path, names=names)
    except RecordingError as error:
        raise DatasetError(str(error)) from error
    try:
        for problem in recording.index.problems if told else ():
            logger.warning("%s: %s; what can be read is used", path, problem)
        if problem := topic_problem(recording, poses=poses):
            raise DatasetError(f"{path}: {problem}")
        if odometry and (problem := mixed(recording, (keys.ODOM,))):
            raise DatasetError(f"{path}: {problem}")
        if colors and (problem := _color_problem(recording)):
            raise DatasetError(f"{path}: {problem}")
        if told and (note := _thinning_note(recording)):
            logger.warning("%s %s", path, note)
        before: dict[str, RobotMessage] = {}
        for message in recording.all_messages(_used(wanted, recording.keys)):
            at = (message.time_ns - recording.start_ns) * 1e-9 - start_s
            sent = RobotMessage(max(at, 0.0), message.key, message.payload)
            if at < 0.0 and message.key in SENT_ONCE:
                before[message.key] = sent
            elif at >= 0.0 or message.key == keys.TF_STATIC:
                if at >= 0.0:
                    yield from before.values()
                    before.clear()
                yield sent
        for problem, count in recording.damaged.items():
            logger.warning("%s: %s (%d messages)", path, problem, count)
    finally:
        recording.close()


def _thinning_note(recording: Recording) -> str:
    """Return how many colour images have no depth image; empty where they are few."""
    colors, depths = (
        max(len(recording.times_ns(key)) for key in several) for several in (COLORS, DEPTHS)
    )
    if colors - depths <= FEW * colors:
        return ""
    text = f"has {depths} depth images for {colors} colour images: the others are not mapped"
    left_out = recording.index.metadata.get(VERSIONS, {}).get("sensor_hz", "0")
    if left_out != "0":
        text += f" (recorded with --sensor-hz {left_out}; 0 keeps all depth images)"
    return text


def _color_problem(recording: Recording) -> str:
    """Return why no raw colour image can be read; empty where one can, or none is used."""
    problem = ""
    for message in recording.all_messages(_used((keys.COLOR_RAW,), recording.keys)):
        try:
            decode_color_raw(message.payload)
        except MessageError as error:
            problem = problem or str(error)
        else:
            return ""
    return problem and f"no message of {keys.COLOR_RAW} can be read: {problem}"


def _used(wanted: Sequence[str], found: Collection[str]) -> tuple[str, ...]:
    """Return the keys to read: raw colour only where there is no compressed one."""
    return tuple(key for key in wanted if key != keys.COLOR_RAW or keys.COLOR not in found)

"""What a robot sent in a few seconds of a bag, as `listen` returns it of a live one."""

from dataclasses import replace
from pathlib import Path
from typing import Final

from app.datasets.bag_poses import BagPoses
from app.datasets.bag_robot import BagRobot
from app.datasets.dataset import DatasetError
from app.datasets.messages import Unreadable, bag_messages, bag_poses
from app.doctor.finding import Finding
from app.doctor.robot.checkup import check_streams
from app.doctor.robot.samples import Samples
from app.messages import keys
from app.recording.camera_topics import COLORS, DEPTHS
from ippon.frame import NANOSECONDS
from ippon.robot import RobotProfile

SECONDS: Final = 10.0
"""Part of a bag that is checked, from its middle: at its ends robots stand and clocks start."""


def check_bag(
    path: Path, robot: BagRobot, profile: RobotProfile | None, duration_s: float
) -> list[Finding]:
    """Return a line for each stream of a bag and for its frames, as of a live robot.

    Args:
        path: The bag.
        robot: Its topics, frames and clock.
        profile: Compared with its camera; None for no comparison.
        duration_s: Of the bag.

    Returns:
        Empty for a recording without the topics of a camera, or without poses: `check` says so.
    """
    middle_s = max(0.0, 0.5 * (duration_s - SECONDS))
    try:
        poses = bag_poses(path, robot.names, robot.T_base_camera, robot.clock_offset_s, robot.base)
    except DatasetError:
        return []
    unreadable = Unreadable()
    try:
        samples = read_samples(path, robot, poses, middle_s, unreadable)
        if middle_s > 0.0 and not _has_images(samples):
            # The camera had paused.
            unreadable = Unreadable()
            samples = read_samples(path, robot, poses, 0.0, unreadable)
    except DatasetError as error:
        return [Finding(what="streams", verdict="failed", detail=str(error))]
    findings = check_streams(samples, profile, robot.clock_offset_s)
    findings += [
        Finding(what=key.rpartition("/")[2], verdict="warning", detail=text)
        for key, text in unreadable.texts().items()
    ]
    # A bag is replayed whatever its profile says of the body; a navigator relies on that.
    return [
        replace(one, verdict="warning") if (one.what, one.verdict) == ("profile", "failed") else one
        for one in findings
    ]


def read_samples(
    path: Path, robot: BagRobot, poses: BagPoses, start_s: float, unreadable: Unreadable
) -> Samples:
    """Return what a bag holds of `SECONDS`.

    Args:
        path: The bag.
        robot: Its topics, frames and clock.
        poses: Where its poses come from.
        start_s: Time in the bag.
        unreadable: Counts what is skipped.

    Raises:
        DatasetError: It lacks a topic, or none of its colour images can be read.
    """
    samples, info = Samples(seconds=SECONDS, is_mount_assumed=bool(poses.camera_frame)), None
    messages = bag_messages(
        path,
        0.0,
        heatmaps=False,
        poses=poses,
        names=robot.names,
        told=False,
        unreadable=unreadable,
    )
    for message in messages:
        at_s = message.at_s - start_s
        if at_s > SECONDS:
            break
        if at_s >= 0.0 or message.key == keys.TF_STATIC:
            samples.add(message.key, message.payload, round(NANOSECONDS * max(at_s, 0.0)))
        elif message.key == keys.CAMERA_INFO:
            info = message.payload
    if info is not None and keys.CAMERA_INFO not in samples.arrivals:
        # Some drivers send it once.
        samples.add(keys.CAMERA_INFO, info, 0)
    return samples


def _has_images(samples: Samples) -> bool:
    return bool(samples.of(*COLORS)[1] and samples.of(*DEPTHS)[1])

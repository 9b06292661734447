"""Publishes a dataset or a bag as a robot; commands have no effect."""

import logging
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import zenoh

from app.datasets.bag_poses import BagPoses
from app.datasets.dataset import Dataset, DatasetError, open_dataset
from app.datasets.floor_alignment import align_to_floor
from app.datasets.messages import (
    TF_ALONE,
    RobotMessage,
    bag_messages,
    bag_poses,
    dataset_messages,
    is_bag,
)
from app.links.network.session import open_client
from app.messages import keys
from app.process.stop_signal import ProcessStopSignal, StopSignal
from app.recording.channels import USUAL, Names
from app.ros2.ippon_ros2.zenoh_side import stream_publisher
from ippon.geometry import Float64Array

logger = logging.getLogger(__name__)

AlignedDataset = tuple[Dataset, Float64Array | None]
"""A dataset, and T_map_world from `align_to_floor`, None where its poses are not sent."""
PAUSE_S: Final = 1.5
"""Pause between two rounds of a loop."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ReplayConfig:
    """Path, rate and endpoint of a replay."""

    path: Path
    connect: str = "tcp/127.0.0.1:7447"
    robot: str = "ippon"
    rate: float = 1.0
    """Speed as a multiple of real time."""
    start_s: float = 0.0
    loop: bool = False
    heatmaps: bool = True
    """Send the heatmaps of a bag; switch it off where another segmentation runs."""
    poses: bool = True
    """Send the recorded poses; without, the navigator must track the camera."""
    floor_m: float | None = None
    """Height of a dataset's floor along up; None estimates it."""
    names: Names = field(default_factory=lambda: USUAL)
    """Topics of a bag of a robot that has names of its own."""
    T_base_camera: Float64Array | None = None
    """Mount of the camera, for a bag whose tf does not say it."""
    clock_offset_s: float = 0.0
    """How far the camera's clock is behind that of the poses of a bag; stamps stay as they are."""
    base: str = keys.BASE_FRAME
    """Frame of the base of a bag."""

    def __post_init__(self) -> None:
        """Refuse an invalid prefix, rate or start."""
        keys.check_prefix(self.robot)
        if not 0.01 <= self.rate <= 100.0:
            raise ValueError(f"the rate is 0.01 to 100 times real time; got {self.rate:g}")
        if not self.start_s >= 0.0:
            raise ValueError(f"the start is 0 s or later; got {self.start_s:g}")


def poses_sent(config: ReplayConfig) -> BagPoses | None:
    """Return which poses of a bag are sent; None for none.

    Raises:
        DatasetError: The path cannot be replayed, or no image of the bag can have a pose.
    """
    if not config.poses:
        return None
    if not is_bag(config.path):
        return TF_ALONE
    return bag_poses(
        config.path, config.names, config.T_base_camera, config.clock_offset_s, config.base
    )


def aligned_dataset(config: ReplayConfig) -> AlignedDataset | None:
    """Open a dataset and align it, which reads some of its images; None for a bag.

    Raises:
        DatasetError: The path cannot be replayed.
    """
    if not config.path.exists():
        raise DatasetError(f"there is no {config.path}")
    if is_bag(config.path):
        return None
    dataset = open_dataset(config.path, poses=config.poses)
    return dataset, align_to_floor(dataset, config.floor_m) if config.poses else None


def _left_out(config: ReplayConfig, dataset: Dataset) -> str:
    """Return which images of a dataset are not mapped; empty where none are left out."""
    images = dataset.left_out + len(dataset.frames)
    if dataset.left_out == 0:
        return ""
    return (
        f"{config.path}: {dataset.left_out} of {images} colour images are left out, for want of a "
        f"depth image of their time{' or a valid pose' if config.poses else ''}"
    )


def messages_of(
    config: ReplayConfig,
    first_stamp_ns: int,
    poses: BagPoses | None = TF_ALONE,
    *,
    aligned: AlignedDataset | None = None,
    told: bool = False,
) -> Iterator[RobotMessage]:
    """Yield the messages of one round.

    Args:
        config: What to replay.
        first_stamp_ns: Stamp of the first frame of a dataset.
        poses: Which poses of a bag are sent.
        aligned: The dataset, where it is open.
        told: Whether to log what is wrong with a bag, see `bag_messages`.

    Raises:
        DatasetError: The path cannot be replayed.
    """
    aligned = aligned or aligned_dataset(config)
    if aligned is None:
        return bag_messages(
            config.path,
            config.start_s,
            heatmaps=config.heatmaps,
            poses=poses if config.poses else None,
            names=config.names,
            told=told,
        )
    dataset, T_map_world = aligned
    return dataset_messages(dataset, config.start_s, first_stamp_ns, T_map_world)


def play(
    config: ReplayConfig,
    put: Callable[[str, bytes], None],
    stop: StopSignal,
    first_stamp_ns: int,
    poses: BagPoses | None = TF_ALONE,
    aligned: AlignedDataset | None = None,
) -> int:
    """Send one round at the recorded times; return the number of colour images sent.

    After the last one, unless it begins again, the end is announced.

    Raises:
        DatasetError: The path cannot be replayed.
    """
    began = time.monotonic()
    images = 0
    for sent in messages_of(config, first_stamp_ns, poses, aligned=aligned):
        late_s = time.monotonic() - began - sent.at_s / config.rate
        if late_s < 0.0:
            stop.wait(-late_s)
        if stop.is_set():
            break
        put(sent.key, sent.payload)
        images += sent.key == keys.COLOR
    if not config.loop and not stop.is_set():
        put(keys.ENDED, f"the replay of {config.path.name} has ended: {images} images".encode())
    return images


def run_replay(config: ReplayConfig) -> None:
    """Play until the end, or with `loop` until SIGINT or SIGTERM.

    Raises:
        DatasetError: The path cannot be replayed.
        LinkError: No navigator answers.
    """
    stop = ProcessStopSignal()
    # Before the network is opened, so that a wrong folder is reported immediately.
    aligned = aligned_dataset(config)
    next(messages_of(config, 0, aligned=aligned, told=True), None)
    poses = poses_sent(config)
    if poses is not None and (note := poses.note(config.path)):
        logger.warning("%s", note)
    if aligned is not None and (note := _left_out(config, aligned[0])):
        logger.warning("%s", note)
    session = open_client(config.connect)
    puts: dict[str, Callable[[bytes], Any]] = {}

    def put(key: str, payload: bytes) -> None:
        whole = f"{config.robot}/{key}"
        if key not in puts and key in keys.KEPT:
            puts[key] = stream_publisher(session, whole, kept=True)
        elif key not in puts:
            puts[key] = session.declare_publisher(
                whole, congestion_control=zenoh.CongestionControl.BLOCK
            ).put
        puts[key](payload)

    logger.info("%s: played as robot %s at %s", config.path, config.robot, config.connect)
    try:
        while not stop.is_set():
            images = play(config, put, stop, time.time_ns(), poses, aligned)
            logger.info("%s: %d images", config.path, images)
            if not config.loop or not images:
                break
            stop.wait(PAUSE_S)
    finally:
        session.close()  # pyright: ignore[reportUnknownMemberType]

"""The frames of a dataset or a bag, in order."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from app.datasets.bag_poses import BagPoses
from app.datasets.dataset import Dataset, DatasetError, open_dataset, read_color, read_depth
from app.datasets.floor_alignment import align_to_floor, base_below, camera_on_base
from app.datasets.messages import TF_ALONE, bag_messages, bag_poses, is_bag
from app.links.robot_streams.assembler import AssemblerConfig, FrameAssembler, assemble
from app.messages import keys
from app.messages.cdr import MessageError
from app.recording.channels import USUAL, Names
from ippon.errors import FrameRejectedError
from ippon.frame import NANOSECONDS, Frame
from ippon.geometry import Float64Array
from ippon.tracking.hand_held import HandHeldCamera
from ippon.tracking.start_pose import AssumedMount

HELD: Final = AssumedMount(height_m=1.3, tilt_rad=math.radians(-20.0))
"""How a recorded camera is held at first, to within half a metre and 35 degrees."""
FEW: Final = 0.1
"""Share of images that become no frame which is not worth a word."""


@dataclass(slots=True)
class Tally:
    """How many images of a recording were read, and how many of them became frames."""

    images: int = 0
    frames: int = 0

    @property
    def note(self) -> str:
        """What a user should know of the others; empty where they are few."""
        alone = self.images - self.frames
        if alone <= FEW * self.images:
            return ""
        return (
            f"{alone} of {self.images} colour images were not mapped, for want of a pose or a "
            "depth image of their time"
        )


@dataclass(frozen=True, slots=True)
class FrameSource:
    """A source of frames."""

    path: Path
    dataset: Dataset | None
    """The dataset; None for a bag."""
    T_map_world: Float64Array
    """Transform from the recording's world to the world of the frames: z up, floor at 0."""
    track: bool = False
    """Find the poses by the images; frames without one are left out."""
    poses: BagPoses = TF_ALONE
    """Where the poses of a bag come from."""
    names: Names = field(default_factory=lambda: USUAL)
    """Topics of a bag of a robot that has names of its own."""
    clock_offset_s: float = 0.0
    """How far the camera's clock is behind that of the poses of a bag."""
    tally: Tally = field(default_factory=Tally)
    """Counts the images while the frames are read."""

    @property
    def note(self) -> str:
        """What a user should know of its poses; empty for nothing."""
        return self.poses.note(self.path)

    def image_name(self, frame: Frame) -> str:
        """Return what a user finds the colour image of a frame by: its file, or its stamp."""
        if self.dataset is None:
            return f"stamp {frame.stamp_ns / NANOSECONDS:.2f} s"
        return next(
            one.color.name for one in self.dataset.frames if _stamp_ns(one.time_s) == frame.stamp_ns
        )

    @property
    def count(self) -> int | None:
        """Number of frames; None if unknown in advance."""
        return None if self.dataset is None else len(self.dataset.frames)

    def frames(self) -> Iterator[Frame]:
        """Yield the frames in order, without heatmaps.

        Raises:
            DatasetError: An image cannot be read, or no image of a bag becomes a frame.
        """
        self.tally.images = self.tally.frames = 0
        if self.dataset is None:
            return _bag_frames(self)
        if self.track:
            return _tracked_frames(self.dataset, self.tally)
        return _dataset_frames(self, self.dataset)


def open_source(
    path: Path,
    floor_m: float | None = None,
    *,
    track: bool = False,
    names: Names = USUAL,
    mount: Float64Array | None = None,
    clock_offset_s: float = 0.0,
    base: str = keys.BASE_FRAME,
) -> FrameSource:
    """Open a dataset's folder, a recording or a bag.

    Args:
        path: Path in one of the formats of `ippon replay`.
        floor_m: Height of a dataset's floor along its up direction; None estimates it.
        track: Find the poses of a dataset by its images; none are read.
        names: Topics of a bag of a robot that has names of its own.
        mount: T_base_camera, for a bag whose tf does not say it.
        clock_offset_s: How far the camera's clock is behind that of the poses of a bag.
        base: Frame of the base of a bag.

    Raises:
        DatasetError: The format is unknown, the data are damaged, or no image of a bag can have a
            pose.
    """
    if not path.exists():
        raise DatasetError(f"{path} does not exist")
    if is_bag(path):
        if track:
            raise DatasetError(
                f"{path} is a bag: only the poses of datasets can be tracked here; those of a bag "
                "with `ippon navigate --profile hand-held` and `ippon replay --no-poses`"
            )
        poses = bag_poses(path, names, mount, clock_offset_s, base)
        return FrameSource(
            path, None, np.eye(4), poses=poses, names=names, clock_offset_s=clock_offset_s
        )
    dataset = open_dataset(path, poses=not track)
    if track:
        return FrameSource(path, dataset, np.eye(4), track=True)
    return FrameSource(path, dataset, align_to_floor(dataset, floor_m))


def _dataset_frames(source: FrameSource, dataset: Dataset) -> Iterator[Frame]:
    tally = source.tally
    tally.images = dataset.left_out
    for one in dataset.frames:
        color = read_color(one.color, dataset.camera)
        depth = read_depth(one.depth, dataset.depth_unit_m, dataset.camera)
        tally.images += 1
        tally.frames += 1
        yield _frame(dataset, one.time_s, color, depth, source.T_map_world @ one.T_world_camera)


def _tracked_frames(dataset: Dataset, tally: Tally) -> Iterator[Frame]:
    held = HandHeldCamera(dataset.camera, HELD)
    for one in dataset.frames:
        color = read_color(one.color, dataset.camera)
        depth = read_depth(one.depth, dataset.depth_unit_m, dataset.camera)
        tracked = held.track(color, depth)
        tally.images += 1
        if tracked.T_world_camera is not None:
            tally.frames += 1
            yield _frame(dataset, one.time_s, color, depth, tracked.T_world_camera)
    if not tally.frames:
        raise DatasetError(f"{dataset.name}: no frame shows the floor, from which to begin")


def _stamp_ns(time_s: float) -> int:
    return round(NANOSECONDS * time_s)


def _frame(
    dataset: Dataset,
    time_s: float,
    color: NDArray[np.uint8],
    depth: NDArray[np.float32],
    T_map_camera: Float64Array,
) -> Frame:
    T_map_base = base_below(T_map_camera)
    T_base_camera = camera_on_base(T_map_base, T_map_camera)
    return Frame(
        stamp_ns=_stamp_ns(time_s),
        color=color,
        depth=depth,
        camera=dataset.camera,
        T_world_camera=T_map_camera,
        T_world_base=T_map_base,
        tilt_rad=math.asin(min(1.0, max(-1.0, float(T_base_camera[2, 2])))),
    )


def _bag_frames(source: FrameSource) -> Iterator[Frame]:
    assembler = FrameAssembler(AssemblerConfig(camera_clock_offset_s=source.clock_offset_s))
    path, tally, refused = source.path, source.tally, ""
    for message in bag_messages(path, 0.0, heatmaps=False, poses=source.poses, names=source.names):
        tally.images += message.key == keys.COLOR
        try:
            assemble(assembler, message.key, message.payload)
            frame = assembler.take()
        except (MessageError, FrameRejectedError) as error:
            refused = str(error)
            continue
        if frame is not None:
            tally.frames += 1
            yield frame
    if not tally.frames:
        lacks = assembler.missing() or "readable images"
        why = f". What was refused last: {refused}" if refused else ""
        raise DatasetError(f"{path}: no image can be mapped; the last one lacks {lacks}{why}")

"""The frames of a dataset or a bag, in order."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from app.links.robot_streams.assembler import FrameAssembler, assemble
from app.messages.cdr import MessageError
from app.nodes.replay.datasets import Dataset, DatasetError, open_dataset, read_color, read_depth
from app.nodes.replay.floor_alignment import align_to_floor, base_below, camera_on_base
from app.nodes.replay.messages import bag_messages
from ippon.errors import FrameRejectedError
from ippon.frame import NANOSECONDS, Frame
from ippon.geometry import Float64Array


@dataclass(frozen=True, slots=True)
class FrameSource:
    """A source of frames."""

    path: Path
    dataset: Dataset | None
    """The dataset; None for a bag."""
    T_map_world: Float64Array
    """Transform from the recording's world to the world of the frames: z up, floor at 0."""

    @property
    def count(self) -> int | None:
        """Number of frames; None if unknown in advance."""
        return None if self.dataset is None else len(self.dataset.frames)

    def frames(self) -> Iterator[Frame]:
        """Yield the frames in order, without heatmaps.

        Raises:
            DatasetError: An image cannot be read, or a bag lacks a topic.
        """
        if self.dataset is None:
            return _bag_frames(self.path)
        return _dataset_frames(self.dataset, self.T_map_world)


def open_source(path: Path, floor_m: float | None = None) -> FrameSource:
    """Open a dataset's folder, a recording or a bag.

    Args:
        path: Path in one of the formats of `ippon replay`.
        floor_m: Height of a dataset's floor along its up direction; None estimates it.

    Raises:
        DatasetError: The format is unknown, or the data are damaged.
    """
    if not path.exists():
        raise DatasetError(f"{path} does not exist")
    if path.is_file() or any(path.glob("*.mcap")) or (path / "metadata.yaml").exists():
        return FrameSource(path, None, np.eye(4))
    dataset = open_dataset(path)
    return FrameSource(path, dataset, align_to_floor(dataset, floor_m))


def _dataset_frames(dataset: Dataset, T_map_world: Float64Array) -> Iterator[Frame]:
    for one in dataset.frames:
        T_map_camera = T_map_world @ one.T_world_camera
        T_map_base = base_below(T_map_camera)
        T_base_camera = camera_on_base(T_map_base, T_map_camera)
        yield Frame(
            stamp_ns=round(NANOSECONDS * one.time_s),
            color=read_color(one.color, dataset.camera),
            depth=read_depth(one.depth, dataset.depth_unit_m),
            camera=dataset.camera,
            T_world_camera=T_map_camera,
            T_world_base=T_map_base,
            tilt_rad=math.asin(min(1.0, max(-1.0, float(T_base_camera[2, 2])))),
        )


def _bag_frames(path: Path) -> Iterator[Frame]:
    assembler = FrameAssembler()
    for message in bag_messages(path, 0.0, heatmaps=False):
        try:
            assemble(assembler, message.key, message.payload)
            frame = assembler.take()
        except (MessageError, FrameRejectedError):
            continue
        if frame is not None:
            yield frame

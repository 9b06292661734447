"""Measurement of a segmentation network's speed on this machine."""

import os
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from ippon.segmentation.config import SegmentationConfig
from ippon.segmentation.errors import CheckpointError
from ippon.segmentation.loading import load_segmenter
from ippon.vocabulary import MATTERPORT_40

if TYPE_CHECKING:
    from ippon.segmentation.segmenter import Segmenter

SIDE_PX: Final = 640
FEWEST: Final = 3
MOST: Final = 50
LONG_ENOUGH_S: Final = 5.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Speed:
    """A measured speed."""

    what: str
    """The network and its device."""
    image_s: float
    """Median seconds for one image of 640x640 with 41 labels."""
    labels_s: float
    """Additional seconds for the first image, for start-up and the embedding of labels."""

    def __str__(self) -> str:
        """Format the result on one line."""
        return (
            f"{1.0 / self.image_s:.2f} images/s ({1e3 * self.image_s:.0f} ms each), "
            f"{self.labels_s:.1f} s more for the first with its labels; {self.what}"
        )


def measure_network(config: SegmentationConfig, models: Path) -> Speed:
    """Time a network.

    Args:
        config: The network.
        models: Folder of the checkpoints; without a checkpoint there, SAN gets random weights.

    Raises:
        SegmentationError: The network cannot be loaded, or fails.
        ExtensionError: No installed package adds the network.
    """
    segmenter, source = _load(config, models)
    return measure(segmenter, f"{source} on {_where(config)}")


def measure(segmenter: "Segmenter", what: str) -> Speed:
    """Time a segmenter on an image of noise."""
    image = np.random.default_rng(0).integers(0, 256, (SIDE_PX, SIDE_PX, 3), dtype=np.uint8)
    first_s = _seconds(segmenter, image)
    times: list[float] = []
    while len(times) < FEWEST or (len(times) < MOST and sum(times) < LONG_ENOUGH_S):
        times.append(_seconds(segmenter, image))
    median = float(np.median(times))
    return Speed(what=what, image_s=median, labels_s=max(0.0, first_s - median))


def _seconds(segmenter: "Segmenter", image: np.ndarray) -> float:
    started = time.perf_counter()
    # The heatmap is in host memory, so the device has finished.
    segmenter.segment(image, MATTERPORT_40, "hat")
    return time.perf_counter() - started


def _load(config: SegmentationConfig, folder: Path) -> "tuple[Segmenter, str]":
    try:
        return load_segmenter(config, folder), config.model or config.backend
    except CheckpointError:
        from ippon.segmentation.backends.san.architecture import RELEASED

        name = config.model or "san_vit_b_16"
        if config.backend != "san" or name not in RELEASED:
            raise
        return random_san(name, config), f"{name} with random weights (its checkpoint is not here)"


def random_san(name: str, config: SegmentationConfig) -> "Segmenter":
    """Return a released architecture with random weights, which run at the same speed."""
    from ippon.segmentation.backends.san.architecture import RELEASED
    from ippon.segmentation.backends.san.random_weights import random_network
    from ippon.segmentation.backends.san.segmenter import SanSegmenter
    from ippon.segmentation.backends.san.tokenizer import ClipTokenizer
    from ippon.segmentation.crop_segmenter import CropSegmenter

    network = random_network(RELEASED[name], seed=0)
    san = SanSegmenter(network, ClipTokenizer([]), config)
    return CropSegmenter(san) if config.small_objects else san


def _where(config: SegmentationConfig) -> str:
    if config.backend == "detector":
        cores = config.threads or os.cpu_count()
        return f"{config.device}, {cores} CPU threads at most"
    if config.backend == "installed":
        # Of a package of its own, which may do without torch.
        return config.device
    import torch

    from ippon.segmentation.device import choose_device, choose_dtype

    device = choose_device(config.device)
    dtype = str(choose_dtype(config.precision, device)).removeprefix("torch.")
    name = (
        torch.cuda.get_device_name(device)
        if device.type == "cuda"
        else f"CPU, {torch.get_num_threads()} threads"
    )
    compiled = ", compiled" if config.compile else ""
    return f"{name}, {dtype}{compiled}, torch {torch.__version__}"

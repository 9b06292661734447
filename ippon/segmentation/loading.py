"""Makes the segmenter that a configuration asks for."""

import importlib
from pathlib import Path

from ippon.segmentation.config import SegmentationConfig
from ippon.segmentation.crop_segmenter import CropSegmenter
from ippon.segmentation.distractors import DistractorSegmenter
from ippon.segmentation.errors import INSTALL_HINT, WITHOUT_NETWORK, MissingPackageError
from ippon.segmentation.segmenter import Segmenter


def load_segmenter(config: SegmentationConfig, folder: Path) -> Segmenter:
    """Load the network and put the chosen second passes around it.

    Args:
        config: Which network, and how.
        folder: Where checkpoints lie that are given by name.

    Raises:
        MissingPackageError: torch or transformers is not installed.
        CheckpointError: The weights are missing, damaged or of another network.
        SegmentationError: There is no such device.
    """
    return with_second_passes(_network(config, folder), config)


def with_second_passes(segmenter: Segmenter, config: SegmentationConfig) -> Segmenter:
    """Put the chosen second passes around a segmenter."""
    if config.distractors:
        segmenter = DistractorSegmenter(segmenter)
    return CropSegmenter(segmenter) if config.small_objects else segmenter


def _network(config: SegmentationConfig, folder: Path) -> Segmenter:
    try:
        for package in ("torch", "regex", "safetensors", "transformers"):
            importlib.import_module(package)
    except ImportError as error:
        raise MissingPackageError(
            f"segmentation networks need {error.name or error}: {INSTALL_HINT}. {WITHOUT_NETWORK}"
        ) from error
    # Imported only now: the library does without them.
    match config.backend:
        case "san":
            from ippon.segmentation.backends.san import loading  # noqa: PLC0415

            return loading.load_san(config, folder)
        case "clipseg":
            from ippon.segmentation.backends.clipseg import ClipSegSegmenter  # noqa: PLC0415

            return ClipSegSegmenter(config, folder)
        case "owlv2":
            from ippon.segmentation.backends.owlv2 import Owlv2Segmenter  # noqa: PLC0415

            return Owlv2Segmenter(config, folder)

"""Makes the segmenter that a configuration asks for."""

import importlib
from pathlib import Path

from ippon.segmentation.config import SegmentationConfig
from ippon.segmentation.crop_segmenter import CropSegmenter
from ippon.segmentation.distractors import DistractorSegmenter
from ippon.segmentation.errors import INSTALL_HINT, WITHOUT_NETWORK, MissingPackageError
from ippon.segmentation.published import masks_model_of
from ippon.segmentation.segmenter import DenseSegmenter, Segmenter


def load_segmenter(config: SegmentationConfig, folder: Path) -> Segmenter:
    """Load the network; around one that judges every pixel, put the chosen second passes.

    Args:
        config: Which network, and how.
        folder: Where checkpoints lie that are given by name.

    Raises:
        MissingPackageError: What runs the network is not installed.
        CheckpointError: The weights are missing, damaged or of another network.
        SegmentationError: There is no such device.
    """
    # Imported only now: the library does without them.
    if config.backend == "detector":
        from ippon.segmentation.detectors.detector import Detector  # noqa: PLC0415

        detector = Detector(config, folder)
        if masks_model_of(config) is None:
            return detector
        _check_packages()
        from ippon.segmentation.backends.finders import outlined_detector  # noqa: PLC0415

        return outlined_detector(detector, config, folder)
    _check_packages()
    match config.backend:
        case "owlv2" | "sam3" | "sam3-lite" | "grounding-dino":
            from ippon.segmentation.backends.finders import load_finder  # noqa: PLC0415

            return load_finder(config.backend, config, folder)
        case "san" | "clipseg":
            return with_second_passes(_network(config, folder), config)


def with_second_passes(segmenter: DenseSegmenter, config: SegmentationConfig) -> DenseSegmenter:
    """Put the chosen second passes around a segmenter."""
    if config.distractors:
        segmenter = DistractorSegmenter(segmenter)
    return CropSegmenter(segmenter) if config.small_objects else segmenter


def _check_packages() -> None:
    try:
        for package in ("torch", "regex", "safetensors", "transformers"):
            importlib.import_module(package)
    except ImportError as error:
        raise MissingPackageError(
            f"segmentation networks need {error.name or error}: {INSTALL_HINT}. {WITHOUT_NETWORK}"
        ) from error


def _network(config: SegmentationConfig, folder: Path) -> DenseSegmenter:
    if config.backend == "clipseg":
        from ippon.segmentation.backends.clipseg import ClipSegSegmenter  # noqa: PLC0415

        return ClipSegSegmenter(config, folder)
    from ippon.segmentation.backends.san import loading  # noqa: PLC0415

    return loading.load_san(config, folder)

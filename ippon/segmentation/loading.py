"""Loading of the configured segmenter."""

import importlib
from pathlib import Path

from ippon import extensions
from ippon.segmentation.config import SegmentationConfig
from ippon.segmentation.crop_segmenter import CropSegmenter
from ippon.segmentation.errors import INSTALL_HINT, WITHOUT_NETWORK, MissingPackageError
from ippon.segmentation.model_registry import masks_model_of
from ippon.segmentation.segmenter import DenseSegmenter, Segmenter


def load_segmenter(config: SegmentationConfig, folder: Path) -> Segmenter:
    """Load a network; one that scores every pixel may get a second pass over a crop.

    Args:
        config: Network and options.
        folder: Folder of checkpoints that are given by name.

    Raises:
        MissingPackageError: A required library is not installed.
        CheckpointError: The weights are missing, damaged or of another network.
        SegmentationError: The device does not exist.
        ExtensionError: No installed package adds the network.
    """
    if config.backend == "installed":
        return extensions.load(extensions.SEGMENTATION, config.model)(config, folder)
    # Imported here, because these packages are optional.
    if config.backend == "detector":
        from ippon.segmentation.detectors.detector import Detector  # noqa: PLC0415

        detector = Detector(config, folder)
        if masks_model_of(config) is None:
            return detector
        _check_packages()
        from ippon.segmentation.backends.open_vocabulary_detectors import outlined_detector  # noqa: PLC0415

        return outlined_detector(detector, config, folder)
    _check_packages()
    match config.backend:
        case "owlv2" | "sam3" | "sam3-lite" | "grounding-dino":
            from ippon.segmentation.backends import open_vocabulary_detectors  # noqa: PLC0415

            return open_vocabulary_detectors.load_open_vocabulary_detector(
                config.backend, config, folder
            )
        case "san" | "clipseg":
            network = _network(config, folder)
            return CropSegmenter(network) if config.small_objects else network


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

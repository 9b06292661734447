"""Loads networks that find instances of any words, with the network for masks behind them."""

from pathlib import Path
from typing import Literal

from ippon.segmentation.backends.box_masks import BoxMasks, BoxSegmenter, OutlinedSegmenter
from ippon.segmentation.backends.grounding_dino import GroundingDinoSegmenter
from ippon.segmentation.backends.owlv2 import Owlv2Segmenter
from ippon.segmentation.backends.sam3 import Sam3Segmenter
from ippon.segmentation.config import SegmentationConfig
from ippon.segmentation.detectors.detector import Detector
from ippon.segmentation.detectors.vocabulary import ClosedVocabulary
from ippon.segmentation.published import masks_model_of

Finder = Literal["owlv2", "sam3", "sam3-lite", "grounding-dino"]


def load_finder(backend: Finder, config: SegmentationConfig, folder: Path) -> BoxSegmenter:
    """Load a network that finds instances of any words, and the one that outlines them.

    Args:
        backend: Which.
        config: How; `model` and `masks_model` name both.
        folder: Where models lie that are given by name.

    Raises:
        CheckpointError: One is not on this machine, damaged, or another model.
        MissingPackageError: A package that the model needs is not installed.
        SegmentationError: There is no such device.
    """
    match backend:
        case "owlv2":
            return with_masks(Owlv2Segmenter(config, folder), config, folder)
        case "grounding-dino":
            return with_masks(GroundingDinoSegmenter(config, folder), config, folder)
        case "sam3" | "sam3-lite":
            return Sam3Segmenter(config, folder)


def with_masks(segmenter: BoxSegmenter, config: SegmentationConfig, folder: Path) -> BoxSegmenter:
    """Put the network for masks behind one that finds boxes, where there is to be one."""
    model = masks_model_of(config)
    if model is None:
        return segmenter
    return OutlinedSegmenter(segmenter, BoxMasks(model, config, folder), config.longest_side_px)


class OutlinedDetector(OutlinedSegmenter):
    """A detector with a fixed list of kinds of thing, whose boxes get masks."""

    def __init__(self, detector: Detector, masks: BoxMasks, longest_side_px: int) -> None:
        super().__init__(detector, masks, longest_side_px)
        self.vocabulary: ClosedVocabulary = detector.vocabulary
        """The kinds of thing that it finds."""


def outlined_detector(
    detector: Detector, config: SegmentationConfig, folder: Path
) -> OutlinedDetector:
    """Put the network for masks that is configured behind a detector.

    Raises:
        ValueError: None is configured.
        CheckpointError: It is not on this machine, damaged, or another model.
    """
    model = masks_model_of(config)
    if model is None:
        raise ValueError("no network for masks is named; masks_model names one")
    return OutlinedDetector(detector, BoxMasks(model, config, folder), config.longest_side_px)

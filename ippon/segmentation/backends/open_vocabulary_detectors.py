"""Loading of open-vocabulary detectors and of the network that adds masks to their boxes."""

from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ippon.observation import Detections
from ippon.segmentation.backends.box_masks import BoxMasks, BoxSegmenter, OutlinedSegmenter
from ippon.segmentation.backends.grounding_dino import GroundingDinoSegmenter
from ippon.segmentation.backends.owlv2 import Owlv2Segmenter
from ippon.segmentation.backends.sam3 import Sam3Segmenter
from ippon.segmentation.config import SegmentationConfig
from ippon.segmentation.detectors.detector import Detector
from ippon.segmentation.detectors.vocabulary import ClosedVocabulary
from ippon.segmentation.model_registry import masks_model_of

OpenVocabularyBackend = Literal["owlv2", "sam3", "sam3-lite", "grounding-dino"]


def load_open_vocabulary_detector(
    backend: OpenVocabularyBackend, config: SegmentationConfig, folder: Path
) -> BoxSegmenter:
    """Load an open-vocabulary detector and its network for masks.

    Args:
        backend: The detector.
        config: `model` and `masks_model` name the two networks.
        folder: Folder of models that are given by name.

    Raises:
        CheckpointError: A model is not on this machine, damaged, or of another type.
        MissingPackageError: A package that the model needs is not installed.
        SegmentationError: The device does not exist.
    """
    match backend:
        case "owlv2":
            return with_masks(Owlv2Segmenter(config, folder), config, folder)
        case "grounding-dino":
            return with_masks(GroundingDinoSegmenter(config, folder), config, folder)
        case "sam3" | "sam3-lite":
            return Sam3Segmenter(config, folder)


def with_masks(segmenter: BoxSegmenter, config: SegmentationConfig, folder: Path) -> BoxSegmenter:
    """Return a box detector with the configured network for masks, if there is one."""
    model = masks_model_of(config)
    if model is None:
        return segmenter
    return OutlinedSegmenter(segmenter, BoxMasks(model, config, folder), config.longest_side_px)


class OutlinedDetector(OutlinedSegmenter):
    """A closed-vocabulary detector whose boxes get masks."""

    def __init__(self, detector: Detector, masks: BoxMasks, longest_side_px: int) -> None:
        super().__init__(detector, masks, longest_side_px)
        self._detector = detector
        self.vocabulary: ClosedVocabulary = detector.vocabulary
        """Its classes."""

    def segment_tour(
        self, color: NDArray[np.uint8], labels: Sequence[str], goals: Sequence[str]
    ) -> Detections:
        """Find the instances of each label, with masks; see `segment_tour`."""
        return self.outlined(color, self._detector.segment_tour(color, labels, goals))


def outlined_detector(
    detector: Detector, config: SegmentationConfig, folder: Path
) -> OutlinedDetector:
    """Return a detector with the configured network for masks.

    Raises:
        ValueError: No network for masks is configured.
        CheckpointError: The network is not on this machine, damaged, or of another type.
    """
    model = masks_model_of(config)
    if model is None:
        raise ValueError("no network for masks is configured; set masks_model")
    return OutlinedDetector(detector, BoxMasks(model, config, folder), config.longest_side_px)

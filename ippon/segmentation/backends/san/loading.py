"""Loading of a SAN by name or file."""

from pathlib import Path

from ippon.segmentation.backends.san.checkpoint import find_checkpoint, find_tokenizer, load_network
from ippon.segmentation.backends.san.segmenter import SanSegmenter
from ippon.segmentation.config import SegmentationConfig


def load_san(config: SegmentationConfig, folder: Path) -> SanSegmenter:
    """Load a released SAN.

    Raises:
        CheckpointError: Weights or list of merges are missing, damaged or of another network.
    """
    path = find_checkpoint(config.model, folder)
    tokenizer = find_tokenizer(path)
    return SanSegmenter(load_network(path), tokenizer, config)

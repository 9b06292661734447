"""A segmentation: what is red is sought.

`ippon segment --segmentation.backend installed --segmentation.model red` runs it.
"""

from pathlib import Path

import numpy as np

from ippon.observation import Heatmap
from ippon.segmentation.config import SegmentationConfig
from ippon.segmentation.segmenter import checked_channels

EVERY = 8


class RedIsTheObject:
    """Gives each pixel to the object of interest as far as it is red, and else to all labels."""

    def segment(self, color, labels, ooi):
        """Return a distribution over the labels at every eighth pixel."""
        channels = checked_channels(color, labels, ooi)
        small = color[::EVERY, ::EVERY].astype(np.float32)
        red = np.clip(small[..., 0] - small[..., 1:].max(axis=2), 0.0, 100.0) / 100.0
        p = np.repeat(((1.0 - red) / len(channels))[..., None], len(channels), axis=2)
        if ooi is not None:
            p[..., channels.index(ooi)] += red
        return Heatmap(
            labels=tuple(labels),
            ooi=ooi,
            probabilities=np.round(255.0 * p / p.sum(axis=2, keepdims=True)).astype(np.uint8),
            source="red",
        )


def load(config: SegmentationConfig, folder: Path) -> RedIsTheObject:
    """Return the network; `folder` is where checkpoints lie."""
    return RedIsTheObject()

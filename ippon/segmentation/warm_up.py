"""Compilation of the kernel that a detector's first box needs."""

import numpy as np

from ippon.observation import Detections, Instance
from ippon.segmentation.instance_heatmap import heatmap_of_instances


def warm_up_instances() -> None:
    """Paint a box of a part of an image, and one of all of it, whose pixels lie side by side."""
    boxes = ((2.0, 2.0, 6.0, 6.0), (0.0, 0.0, 8.0, 8.0))
    instances = tuple(Instance(label="hat", score=0.5, box_px=box) for box in boxes)
    seen = Detections(
        source="", labels=("wall", "hat"), ooi="hat", image_size=(8, 8), instances=instances
    )
    heatmap_of_instances(seen, np.ones((8, 8), np.float32))

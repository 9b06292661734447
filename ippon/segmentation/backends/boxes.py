"""Duplicate suppression and labels of a network's boxes."""

from typing import Final

import numpy as np
import torch
from torch import Tensor

from ippon.observation import Detections
from ippon.segmentation.errors import NOT_NUMBERS, SegmentationError
from ippon.segmentation.instances import MAX_INSTANCES, make_detections

SAME_OVERLAP: Final = 0.7
"""Intersection over union above which two boxes are one object; smaller merges more."""


def labelled_boxes(
    boxes_px: Tensor,
    fits: Tensor,
    least: float,
    *,
    source: str,
    channels: tuple[str, ...],
    ooi: str | None,
    image_size: tuple[int, int],
) -> Detections:
    """Return the distinct objects in boxes, each with its best label.

    Args:
        boxes_px: (N, 4) left, top, right, bottom in pixels.
        fits: (N, C) how well each label fits, 0 to 1.
        least: Boxes with a lower best score are left out.
        source: Name of the network.
        channels: One label per column, including the object of interest.
        ooi: Object of interest, or None.
        image_size: (H, W) pixels.

    Raises:
        SegmentationError: A score is not a number.
    """
    best, numbers = fits.max(dim=1)
    # First, because it rejects scores that are not numbers.
    kept = distinct_boxes(boxes_px, best)
    kept = kept[best[kept] > least]
    return make_detections(
        boxes_px[kept].cpu().numpy(),
        best[kept].cpu().numpy(),
        [channels[k] for k in numbers[kept].tolist()],
        source=source,
        labels=channels,
        ooi=ooi,
        image_size=image_size,
    )


def distinct_boxes(boxes: Tensor, scores: Tensor) -> Tensor:
    """Return the rows of distinct boxes, best first.

    An object with several labels is one instance, with the best label.

    Args:
        boxes: (N, 4) left, top, right, bottom; only the best `MAX_INSTANCES` are considered.
        scores: (N,).

    Returns:
        (K,) int64 rows.

    Raises:
        SegmentationError: A score is not a number, for example after overflow of half precision.
    """
    if not torch.isfinite(scores).all():
        raise SegmentationError(NOT_NUMBERS.format("values"))
    order = scores.argsort(descending=True, stable=True)[:MAX_INSTANCES]
    same = (_overlaps(boxes[order].float()) >= SAME_OVERLAP).cpu().numpy()
    left = np.ones(len(order), np.bool_)
    kept: list[int] = []
    for k in range(len(order)):
        if left[k]:
            kept.append(k)
            left &= ~same[k]
    return order[kept]


def _overlaps(boxes: Tensor) -> Tensor:
    """Return (N, N) the intersection over union of each pair of (N, 4) boxes."""
    low = torch.maximum(boxes[:, None, :2], boxes[None, :, :2])
    high = torch.minimum(boxes[:, None, 2:], boxes[None, :, 2:])
    shared = (high - low).clamp(min=0.0).prod(dim=-1)
    areas = (boxes[:, 2:] - boxes[:, :2]).clamp(min=0.0).prod(dim=-1)
    return shared / (areas[:, None] + areas[None, :] - shared).clamp(min=1e-9)

"""The DETR family: a fixed number of boxes, each with scores of its own."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ippon.segmentation.detectors.decoding.candidates import (
    Candidates,
    from_centres,
    probabilities,
)
from ippon.segmentation.detectors.decoding.outlines import outlined
from ippon.segmentation.detectors.decoding.yolo import one_hot
from ippon.segmentation.detectors.image_input import Placement


def decode_queries(
    logits: NDArray[np.float32],
    boxes: NDArray[np.float32],
    masks: NDArray[np.float32] | None,
    input_size: tuple[int, int],
    *,
    softmax: bool,
) -> Candidates:
    """Decode logits and boxes as RT-DETR, D-FINE and RF-DETR have them, or the first DETR.

    Args:
        logits: (Q, C), with a column for no class at the end where `softmax`.
        boxes: (Q, 4) centre x, y, width, height as shares of the input.
        masks: (Q, h, w) logits over the input; or None.
        input_size: (H, W) of the network's input.
        softmax: Classes exclude each other (DETR); else each has its own probability.
    """
    height, width = input_size
    pixels = from_centres(boxes.astype(np.float64)) * [width, height, width, height]
    if softmax:
        weights = np.exp(logits.astype(np.float64) - logits.max(axis=1, keepdims=True))
        scores = weights[:, :-1] / weights.sum(axis=1, keepdims=True)
    else:
        scores = probabilities(logits)
    if masks is None:
        return Candidates(boxes=pixels, scores=scores, distinct=True)
    outlines = masks

    def outline(rows: Sequence[int], place: Placement) -> list[NDArray[np.bool_]]:
        return [outlined(probabilities(outlines[row]), place) for row in rows]

    return Candidates(boxes=pixels, scores=scores, distinct=True, masks=outline)


def decode_labelled(
    labels: NDArray[np.integer],
    boxes: NDArray[np.float32],
    scores: NDArray[np.float32],
    classes: int,
) -> Candidates:
    """Decode what RT-DETR's and D-FINE's own exports give, in pixels of the size they are told.

    Args:
        labels: (N,) numbers of classes.
        boxes: (N, 4) left, top, right, bottom in pixels of the input.
        scores: (N,) 0 to 1.
        classes: Number of classes; rows of other numbers have no score.
    """
    return Candidates(
        boxes=boxes.astype(np.float64), scores=one_hot(scores, labels, classes), distinct=True
    )

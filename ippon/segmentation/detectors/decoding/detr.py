"""The DETR family: a fixed number of queries, each with a box and scores."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ippon.segmentation.detectors.decoding.candidates import (
    Candidates,
    from_centres,
    probabilities,
)
from ippon.segmentation.detectors.decoding.outlines import mask_in_image
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
    """Decode logits and boxes of RT-DETR, D-FINE, RF-DETR or the first DETR.

    Args:
        logits: (Q, C), with a last column for no class if `softmax`.
        boxes: (Q, 4) centre x, y, width, height as shares of the input.
        masks: (Q, h, w) logits over the input; or None.
        input_size: (H, W) of the network's input.
        softmax: Whether classes exclude each other (DETR), or have separate probabilities.
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
        return [mask_in_image(outlines[row], place) for row in rows]

    return Candidates(boxes=pixels, scores=scores, distinct=True, masks=outline)


def decode_labelled(
    labels: NDArray[np.integer],
    boxes: NDArray[np.float32],
    scores: NDArray[np.float32],
    classes: int,
) -> Candidates:
    """Decode the outputs of RT-DETR's and D-FINE's own exports.

    Args:
        labels: (N,) numbers of classes.
        boxes: (N, 4) left, top, right, bottom in pixels of the input.
        scores: (N,) 0 to 1.
        classes: Number of classes; rows with other class numbers get score 0.
    """
    return Candidates(
        boxes=boxes.astype(np.float64), scores=one_hot(scores, labels, classes), distinct=True
    )

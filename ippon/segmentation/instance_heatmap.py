"""Any observation as probabilities, where scores and instances cannot be sent as they are."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ippon.observation import Detections, Heatmap, Instance, Observation
from ippon.observation_model import LEAST_SCORE
from ippon.segmentation.segmenter import heatmap_size, quantise


def distribution_of(seen: Observation, labels: Sequence[str], longest_px: int = 160) -> Heatmap:
    """Return how probable each label is at each pixel.

    Instances that overlap add up as independent evidence. What the scores lack to 1 goes to all
    labels alike, so that a pixel without an instance teaches a Bayes filter nothing. An instance
    without a mask covers its box, its corners included: with depth, `painting.paint` is better.

    Args:
        seen: Of an image.
        labels: Common labels for instances; those that were not looked for have no evidence.
        longest_px: Longer side of the heatmap.

    Returns:
        A heatmap of kind `distribution`.
    """
    if isinstance(seen, Detections):
        return _of_instances(seen, labels, longest_px)
    if seen.kind == "distribution":
        return seen
    p = seen.probabilities.transpose(2, 0, 1)
    scores = np.where(p >= LEAST_SCORE, p / np.float32(255.0), np.float32(0.0))
    return Heatmap(
        labels=seen.labels, ooi=seen.ooi, probabilities=_divided(scores), source=seen.source
    )


def _of_instances(detections: Detections, labels: Sequence[str], longest_px: int) -> Heatmap:
    h, w = heatmap_size(detections.image_size, longest_px)
    ooi = detections.ooi
    channels = tuple(labels) if ooi is None or ooi in labels else (*labels, ooi)
    missed = np.ones((len(channels), h, w), np.float32)
    for one in detections.instances:
        if one.label in channels:
            inside = _pixels(one, (h, w), detections.image_size)
            missed[channels.index(one.label)][inside] *= 1.0 - one.score
    return Heatmap(
        labels=tuple(labels),
        ooi=ooi,
        probabilities=_divided(1.0 - missed),
        source=detections.source,
    )


def _divided(scores: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Turn (C, h, w) scores into (h, w, C) probabilities in units of 1/255."""
    scores = scores + np.maximum(0.0, 1.0 - scores.sum(axis=0)) / len(scores)
    return quantise(scores / scores.sum(axis=0))


def _pixels(one: Instance, size: tuple[int, int], image: tuple[int, int]) -> NDArray[np.bool_]:
    """Return (h, w) which pixels of the heatmap an instance covers."""
    v, u = ((np.arange(n) + 0.5) / n for n in size)
    if one.mask is not None:
        rows, columns = one.mask.shape
        return one.mask[np.ix_((v * rows).astype(int), (u * columns).astype(int))]
    left, top, right, bottom = one.box_px
    inside_v = (v * image[0] >= top) & (v * image[0] < bottom)
    inside_u = (u * image[1] >= left) & (u * image[1] < right)
    return np.logical_and.outer(inside_v, inside_u)

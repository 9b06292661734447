"""Validation of a detector's boxes."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ippon.observation import Detections, Instance

MAX_INSTANCES = 300
"""Most instances per image; the best scores are kept."""
SMALLEST_PX = 1.0
"""Least width and height of a box."""


def make_detections(
    boxes_px: NDArray[np.floating],
    scores: NDArray[np.floating],
    names: Sequence[str],
    *,
    source: str,
    labels: Sequence[str],
    ooi: str | None,
    image_size: tuple[int, int],
    masks: Sequence[NDArray[np.bool_] | None] | None = None,
) -> Detections:
    """Return the valid instances among a detector's boxes, best scores first.

    Boxes are clipped to the image. Boxes outside it, inverted, empty or not finite, with a score
    outside 0 to 1, or beyond `MAX_INSTANCES` are dropped and counted. Instances of labels that were
    not searched for are ignored.

    Args:
        boxes_px: (N, 4) left, top, right, bottom in pixels of the image.
        scores: (N,) 0 to 1.
        names: (N) canonical labels.
        source: Name of the network.
        labels: Labels that were searched for and that the detector knows.
        ooi: Object of interest, one of `labels`; or None.
        image_size: (H, W) in pixels.
        masks: (N) masks over the whole image, or None for all.

    Raises:
        ValueError: The arguments differ in length.
    """
    count = len(names)
    shapes = boxes_px.shape, scores.shape, count if masks is None else len(masks)
    if shapes != ((count, 4), (count,), count):
        raise ValueError(f"boxes, scores, masks and {count} names differ: {shapes}")
    inside, good = _inside(np.asarray(boxes_px, np.float64), image_size)
    good &= (scores >= 0.0) & (scores <= 1.0)
    looked_for = set(labels)
    asked = np.array([name in looked_for for name in names], np.bool_)
    rows = np.flatnonzero(good & asked)
    rows = rows[np.argsort(-np.asarray(scores)[rows], kind="stable")]
    instances = tuple(
        Instance(
            label=str(names[int(row)]),
            score=float(scores[row]),
            box_px=_box(inside[row]),
            mask=None if masks is None else masks[int(row)],
        )
        for row in rows[:MAX_INSTANCES]
    )
    dropped = int(np.count_nonzero(asked & ~good)) + max(0, len(rows) - MAX_INSTANCES)
    return Detections(
        source=source,
        labels=tuple(labels),
        ooi=ooi,
        image_size=image_size,
        instances=instances,
        dropped=dropped,
    )


def _inside(
    boxes: NDArray[np.float64], image_size: tuple[int, int]
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Return (N, 4) boxes clipped to the image, and (N,) whether each is valid."""
    height, width = image_size
    finite = np.asarray(np.isfinite(boxes).all(axis=1), np.bool_)
    inside = np.where(finite[:, None], boxes, 0.0).clip(0, [width, height, width, height])
    extent = inside[:, 2:] - inside[:, :2]
    large = np.asarray((extent >= SMALLEST_PX).all(axis=1), np.bool_)
    return inside, finite & large


def _box(row: NDArray[np.float64]) -> tuple[float, float, float, float]:
    left, top, right, bottom = (float(x) for x in row)
    return left, top, right, bottom

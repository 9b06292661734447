"""Keeps one box of those that stand for the same thing."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

MOST_CANDIDATES: Final = 10_000
"""Boxes that are compared, those of the best scores: with more, an image takes seconds."""


def suppressed(
    boxes: NDArray[np.float64],
    scores: NDArray[np.float64],
    classes: NDArray[np.int64],
    overlap: float,
    most: int,
) -> NDArray[np.int64]:
    """Choose boxes, best first, without those that a better one of the same class covers.

    Args:
        boxes: (N, 4) left, top, right, bottom, finite.
        scores: (N,).
        classes: (N,).
        overlap: Intersection over union above which two boxes of a class are one thing.
        most: Boxes that are kept at most.

    Returns:
        (K,) rows, best score first.
    """
    order = np.argsort(-scores, kind="stable")[:MOST_CANDIDATES]
    kept: list[int] = []
    while len(order) and len(kept) < most:
        best = order[0]
        kept.append(int(best))
        rest = order[1:]
        covered = (classes[rest] == classes[best]) & (overlaps(boxes[best], boxes[rest]) > overlap)
        order = rest[~covered]
    return np.array(kept, np.int64)


def overlaps(box: NDArray[np.float64], others: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (K,) the intersection of a (4,) box with each of (K, 4), over their union."""
    low, high = np.maximum(box[:2], others[:, :2]), np.minimum(box[2:], others[:, 2:])
    shared = (high - low).clip(min=0.0).prod(axis=1)
    areas = (others[:, 2:] - others[:, :2]).clip(min=0.0).prod(axis=1)
    union = (box[2:] - box[:2]).clip(min=0.0).prod() + areas - shared
    return shared / np.maximum(union, 1e-9)

"""Non-maximum suppression."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

MOST_CANDIDATES: Final = 10_000
"""Most boxes that are compared, best scores first; more take seconds per image."""

_FARTHEST_PX: Final = 1e6
"""Bound of box coordinates; larger ones are noise, and their areas overflow."""


def non_maximum_suppression(
    boxes: NDArray[np.float64],
    scores: NDArray[np.float64],
    classes: NDArray[np.int64],
    overlap: float,
    most: int,
) -> NDArray[np.int64]:
    """Return boxes, best first, without those that a better box of the same class covers.

    Args:
        boxes: (N, 4) left, top, right, bottom, finite.
        scores: (N,).
        classes: (N,).
        overlap: Intersection over union above which two boxes of a class are one object.
        most: Most boxes to keep.

    Returns:
        (K,) rows, best score first.
    """
    order = np.argsort(-scores, kind="stable")[:MOST_CANDIDATES]
    if not len(order):
        return order
    chosen = boxes[order].clip(-_FARTHEST_PX, _FARTHEST_PX)
    # Boxes of different classes are shifted apart, so that they do not overlap.
    apart = (np.ptp(chosen) + 1.0) * classes[order]
    left, top, right, bottom = (chosen + apart[:, None]).T.copy()
    areas = (right - left).clip(min=0.0) * (bottom - top).clip(min=0.0)
    kept: list[int] = []
    while len(order) and len(kept) < most:
        kept.append(int(order[0]))
        across = np.minimum(right, right[0]) - np.maximum(left, left[0])
        down = np.minimum(bottom, bottom[0]) - np.maximum(top, top[0])
        shared = np.maximum(across, 0.0) * np.maximum(down, 0.0)
        stays = shared <= overlap * (areas + areas[0] - shared)
        stays[0] = False
        if not stays.all():
            order, areas = order[stays], areas[stays]
            left, top, right, bottom = left[stays], top[stays], right[stays], bottom[stays]
    return np.array(kept, np.int64)

"""YOLOX, YOLOv5 to YOLO11 and similar: one row or column per cell of three grids."""

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ippon.segmentation.detectors.decoding.candidates import (
    Candidates,
    from_centres,
    grid_cells,
)
from ippon.segmentation.detectors.decoding.outlines import mask_in_image
from ippon.segmentation.detectors.image_input import Placement

STRIDES: Final = (8, 16, 32)
OBJECTNESS: Final = 4
"""Column after those of the box."""
_BOX: Final = 4
_ON_GRID: Final = 0.9
"""Correlation of box centres with their cells from which boxes are already in pixels."""


def decode_yolox(output: NDArray[np.float32], input_size: tuple[int, int]) -> Candidates:
    """Decode YOLOX (Ge et al., 2021), with or without its grid applied, YOLOv5 or YOLOv6.

    Without, centres are offsets from their cells in strides, and extents logarithms of strides.
    Centres in pixels correlate with their cells, which decides between the two.

    Args:
        output: (A, 5 + C): centre x, y, width, height, objectness 0 to 1, class scores 0 to 1.
        input_size: (H, W) of the network's input.
    """
    rows = output.astype(np.float64)
    boxes = rows[:, :_BOX]
    cells = grid_cells(input_size, STRIDES)
    if len(cells) == len(rows) and not on_grid(boxes, cells):
        stride = cells[:, 2:]
        # Clamp extents before they overflow; no object is e^10 strides wide.
        extents = np.exp(np.minimum(boxes[:, 2:], 10.0)) * stride
        boxes = np.concatenate([(boxes[:, :2] + cells[:, :2]) * stride, extents], axis=1)
    scores = rows[:, OBJECTNESS, None] * rows[:, OBJECTNESS + 1 :]
    return Candidates(boxes=from_centres(boxes), scores=scores)


def on_grid(boxes: NDArray[np.float64], cells: NDArray[np.float64]) -> bool:
    """Tell whether (A, 4) boxes are in pixels: their centres correlate with their cells."""
    middles = (cells[:, :2] + 0.5) * cells[:, 2:]
    for axis in (0, 1):
        place, centre = middles[:, axis], boxes[:, axis]
        spread = float(place.std() * centre.std())
        shared = float(((place - place.mean()) * (centre - centre.mean())).mean())
        if not shared > _ON_GRID * spread:
            return False
    return True


def decode_yolov8(outputs: Sequence[NDArray[np.float32]], classes: int) -> Candidates:
    """Decode the output of YOLOv8, YOLO11 and similar, with masks if there are prototypes.

    Args:
        outputs: (4 + C + M, A): centre x, y, width, height in pixels of the input, class scores 0
            to 1, then M coefficients of masks; then (M, h, w) prototypes if M > 0.
        classes: C.
    """
    columns = outputs[0].astype(np.float64).T
    boxes = from_centres(columns[:, :_BOX])
    scores = columns[:, _BOX : _BOX + classes]
    if len(outputs) == 1:
        return Candidates(boxes=boxes, scores=scores)
    # Of float16 numpy multiplies slowly.
    coefficients = outputs[0].T[:, _BOX + classes :].astype(np.float32)
    prototypes = outputs[1].astype(np.float32)

    def masks(rows: Sequence[int], place: Placement) -> list[NDArray[np.bool_]]:
        return [
            mask_in_image(np.tensordot(coefficients[row], prototypes, axes=1), place, boxes[row])
            for row in rows
        ]

    return Candidates(boxes=boxes, scores=scores, masks=masks)


def decode_rows(output: NDArray[np.float32], classes: int) -> Candidates:
    """Decode the output of networks with built-in suppression, such as YOLOv10 and YOLO26.

    Args:
        output: (N, 6): left, top, right, bottom in pixels of the input, score, number of the class.
        classes: Number of classes; rows with other class numbers get score 0.
    """
    rows = output.astype(np.float64)
    scores = one_hot(rows[:, 4], rows[:, 5], classes)
    return Candidates(boxes=rows[:, :_BOX], scores=scores, distinct=True)


def one_hot(
    scores: NDArray[np.floating], numbers: NDArray[np.generic], classes: int
) -> NDArray[np.float64]:
    """Return (N, C) scores, each in the column of its class; zeros for classes outside 0 to C."""
    spread = np.zeros((len(scores), classes))
    finite = np.asarray(numbers, np.float64)
    rows = np.flatnonzero((finite >= 0) & (finite < classes))
    spread[rows, finite[rows].astype(np.int64)] = scores[rows]
    return spread

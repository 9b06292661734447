"""Decoded boxes and scores, in the same form for every family."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ippon.segmentation.detectors.image_input import Placement

Masks = Callable[[Sequence[int], Placement], list[NDArray[np.bool_]]]
"""Returns the masks of some rows, each (h, w) over the image in its proportions."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Candidates:
    """Boxes with class scores, before suppression."""

    boxes: NDArray[np.float64]
    """(N, 4) left, top, right, bottom in pixels of the network's input."""
    scores: NDArray[np.float64]
    """(N, C) 0 to 1, one column per class."""
    distinct: bool = False
    """Whether the network itself suppresses duplicates."""
    masks: Masks | None = None
    """Masks of the objects, if the network provides them."""


def from_corner_distances(
    centres: NDArray[np.float64], distances: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return (N, 4) boxes from (N, 2) points and distances to left, top, right, bottom."""
    return np.concatenate([centres - distances[:, :2], centres + distances[:, 2:]], axis=1)


def from_centres(boxes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (N, 4) left, top, right, bottom from (N, 4) centre x, centre y, width, height."""
    half = boxes[:, 2:] / 2
    return np.concatenate([boxes[:, :2] - half, boxes[:, :2] + half], axis=1)


def grid_cells(size: tuple[int, int], strides: Sequence[int]) -> NDArray[np.float64]:
    """Return the cells of grids with some strides over an (H, W) input, row by row.

    Returns:
        (A, 3) column, row and stride of each cell; a grid covers the whole input.
    """
    grids: list[NDArray[np.float64]] = []
    for stride in strides:
        rows, columns = -(-size[0] // stride), -(-size[1] // stride)
        v, u = np.divmod(np.arange(rows * columns), columns)
        grids.append(np.stack([u, v, np.full(rows * columns, stride)], axis=1).astype(np.float64))
    return np.concatenate(grids)


def probabilities(logits: NDArray[np.floating]) -> NDArray[np.float64]:
    """Return the logistic function of each element."""
    x = np.asarray(logits, np.float64)
    return 0.5 * (1.0 + np.tanh(0.5 * x))

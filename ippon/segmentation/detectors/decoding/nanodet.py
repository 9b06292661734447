"""NanoDet-Plus: class scores, and distributions of the distances to the sides of a box."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from ippon.segmentation.detectors.decoding.candidates import (
    Candidates,
    from_corner_distances,
    grid_cells,
)
from ippon.segmentation.detectors.errors import OutputError

STRIDES: Final = (8, 16, 32, 64)


def decode_nanodet(
    output: NDArray[np.float32], classes: int, input_size: tuple[int, int]
) -> Candidates:
    """Decode the output of NanoDet-Plus (generalised focal loss, Li et al., NeurIPS 2020).

    Args:
        output: (A, C + 4 B): C class scores, 0 to 1, then for left, up, right and down B bins,
            whose softmax is the distribution of the distance in strides.
        classes: C.
        input_size: (H, W) of the network's input.

    Raises:
        OutputError: The output has another shape.
    """
    cells = grid_cells(input_size, STRIDES)
    bins, rest = divmod(output.shape[-1] - classes, 4)
    if output.ndim != 2 or len(output) != len(cells) or rest or bins < 2:
        raise OutputError(
            f"NanoDet-Plus with {classes} classes gives ({len(cells)}, {classes} + 4 x bins) for an"
            f" input of {input_size[1]}x{input_size[0]}; this network gives {output.shape}. Another"
            " number of classes needs --segmentation.labels-file"
        )
    raw = output[:, classes:].reshape(len(cells), 4, bins).astype(np.float64)
    weights = np.exp(raw - raw.max(axis=2, keepdims=True))
    weights /= weights.sum(axis=2, keepdims=True)
    distances = (weights @ np.arange(bins)) * cells[:, 2:]
    return Candidates(
        boxes=from_corner_distances(cells[:, :2] * cells[:, 2:], distances),
        scores=output[:, :classes].astype(np.float64),
    )

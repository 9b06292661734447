"""Whether depth is registered to colour: edges of depth lie on edges of colour."""

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

_ndimage: Any = ndimage
"""Untyped, because the return types of its functions depend on arguments."""
REACH_SHARE: Final = 0.04
"""Largest shift that is tried, as a share of the width of the image."""
JUMP_SHARE: Final = 0.08
"""Difference of neighbouring depths, as a share of them, from which there is an edge."""
LEAST_EDGES: Final = 200
"""Pixels of depth edges below which nothing can be said."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EdgeScore:
    """Agreement of the edges of two images."""

    score: float
    """Mean colour gradient on depth edges over that of the whole image; 1 is chance."""
    best: float
    """The same for the best shift."""
    shift_px: tuple[int, int]
    """That shift of depth to the right and down, pixels."""
    pixels: int
    """Depth edges that were compared."""


def edge_score(
    pairs: list[tuple[NDArray[np.uint8], NDArray[np.float32]]],
) -> EdgeScore | None:
    """Compare colour and depth of the same moments.

    Args:
        pairs: (H, W, 3) RGB and (H, W) depth in metres, 0 for no return; all of one size.

    Returns:
        None where the scene has too few edges of depth.
    """
    if not pairs:
        return None
    width = pairs[0][1].shape[1]
    reach = max(2, round(REACH_SHARE * width))
    step = max(1, reach // 8)
    offsets = [k * step for k in range(-(reach // step), reach // step + 1)]
    sums = np.zeros((len(offsets), len(offsets)))
    weight, mean = 0, 0.0
    for color, depth in pairs:
        gradient = _gradient(color)
        rows, columns = np.nonzero(_depth_edges(depth, reach))
        weight += len(rows)
        mean += len(rows) * float(gradient.mean())
        for a, dv in enumerate(offsets):
            for b, du in enumerate(offsets):
                sums[a, b] += gradient[rows + dv, columns + du].sum()
    if weight < LEAST_EDGES or mean == 0.0:
        return None
    ratios = sums / mean
    a, b = np.unravel_index(int(np.argmax(ratios)), ratios.shape)
    middle = len(offsets) // 2
    return EdgeScore(
        score=float(ratios[middle, middle]),
        best=float(ratios[a, b]),
        shift_px=(offsets[int(b)], offsets[int(a)]),
        pixels=weight,
    )


def _gradient(color: NDArray[np.uint8]) -> NDArray[np.float32]:
    grey = color.astype(np.float32).mean(axis=2)
    grey = _ndimage.gaussian_filter(grey, 1.0)
    down, right = np.gradient(grey)
    return np.minimum(np.hypot(down, right), 40.0).astype(np.float32)


def _depth_edges(depth: NDArray[np.float32], margin: int) -> NDArray[np.bool_]:
    """Return the (H, W) pixels at jumps of depth, at least a margin from the border."""
    edges = np.zeros(depth.shape, dtype=bool)
    for a, b in (
        (np.s_[:, 1:], np.s_[:, :-1]),
        (np.s_[1:, :], np.s_[:-1, :]),
    ):
        near, far = np.minimum(depth[a], depth[b]), np.maximum(depth[a], depth[b])
        edges[a] |= (near > 0.0) & (far - near > JUMP_SHARE * far)
    edges[:margin] = edges[-margin:] = False
    edges[:, :margin] = edges[:, -margin:] = False
    return edges

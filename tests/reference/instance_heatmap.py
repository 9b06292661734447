"""Painting of one instance the slow way."""

import numpy as np
from numpy.typing import NDArray

from ippon.observation_model import LEAST_SCORE, NOTHING_SAID
from ippon.segmentation.instance_heatmap import WINS_FROM


def painted(
    block: NDArray[np.uint8],
    inside: NDArray[np.bool_],
    value: int,
    mine: int,
    is_apart: NDArray[np.bool_],
) -> NDArray[np.uint8]:
    """Return (h, w, C) a window of a heatmap with an instance painted over it."""
    out = block.copy()
    loses = (block >= LEAST_SCORE) & (WINS_FROM * block <= value) & inside[..., None]
    loses &= ~(is_apart[mine] & is_apart)
    out[loses] = NOTHING_SAID
    out[..., mine] = np.where(inside, np.maximum(block[..., mine], value), block[..., mine])
    return out

"""Copying between arrays with different origins."""

import numpy as np
from numpy.typing import NDArray


def copy_overlap(source: NDArray, offset: NDArray[np.int64], target: NDArray) -> None:
    """Copy the part of `source` that overlaps `target`; its first element goes to `offset`."""
    low = np.maximum(offset, 0)
    high = np.minimum(offset + source.shape, target.shape)
    if (high > low).all():
        to = tuple(slice(a, b) for a, b in zip(low, high, strict=True))
        back = tuple(slice(a - o, b - o) for a, b, o in zip(low, high, offset, strict=True))
        target[to] = source[back]

"""Boxes round instances the slow way."""

import numpy as np
from numpy.typing import NDArray


def boxes(
    instance: NDArray[np.int32], depth: NDArray[np.float32]
) -> dict[int, tuple[tuple[int, int, int, int], float]]:
    """Return left, top, right, bottom and the mean depth of each instance with depth."""
    out: dict[int, tuple[tuple[int, int, int, int], float]] = {}
    for k in range(int(instance.max(initial=-1)) + 1):
        v, u = np.nonzero((instance == k) & (depth > 0.0))
        if len(v):
            box = (int(u.min()), int(v.min()), int(u.max()) + 1, int(v.max()) + 1)
            out[k] = box, float(depth[v, u].mean(dtype=np.float64))
    return out

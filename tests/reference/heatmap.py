"""Blending of probability vectors the slow way."""

import numpy as np
from numpy.typing import NDArray


def stretched(grid: NDArray[np.float32], i: int, j: int, h: int, w: int) -> float:
    """Read a grid stretched over an (h, w) image at one pixel, bilinearly."""
    y, x = i * (grid.shape[0] - 1) / h, j * (grid.shape[1] - 1) / w
    y0, x0 = int(y), int(x)
    cell = grid[y0 : y0 + 2, x0 : x0 + 2].astype(float)
    rows = cell[0] * (1 - (y - y0)) + cell[1] * (y - y0)
    return float(rows[0] * (1 - (x - x0)) + rows[1] * (x - x0))


def blended(
    samples: NDArray[np.int32],
    good: NDArray[np.float32],
    bad: NDArray[np.float32],
    field: NDArray[np.float32],
) -> NDArray[np.float64]:
    """Return (h, w, C) the mixed probabilities, before they become bytes."""
    h, w, _ = samples.shape
    weights = np.array([0.5, 0.125, 0.125, 0.125, 0.125])
    out = np.empty((h, w, good.shape[1]))
    for i in range(h):
        for j in range(w):
            share = np.clip(0.5 + 0.5 * stretched(field, i, j, h, w), 0.0, 1.0)
            rows = samples[i, j]
            out[i, j] = share * (weights @ good[rows]) + (1.0 - share) * (weights @ bad[rows])
    return out

"""The z-buffer the slow way: every ray against every triangle."""

import numpy as np
from numpy.typing import NDArray


def first_hits(
    rays: NDArray[np.float64], origin: NDArray[np.float64], corners: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return distance in units of the ray (inf for none) and triangle (-1) of (N, 3) rays.

    Moeller and Trumbore, two-sided, edges included.
    """
    best = np.full(len(rays), np.inf)
    face = np.full(len(rays), -1)
    for f, (a, b, c) in enumerate(corners):
        p = np.cross(rays, c - a)
        det = p @ (b - a)
        with np.errstate(divide="ignore", invalid="ignore"):
            s = (p @ (origin - a)) / det
            q = np.cross(origin - a, b - a)
            t = (rays @ q) / det
            distance = ((c - a) @ q) / det
        hit = (s >= 0) & (t >= 0) & (s + t <= 1) & (distance > 0) & (distance < best)
        best[hit] = distance[hit]
        face[hit] = f
    return best, face

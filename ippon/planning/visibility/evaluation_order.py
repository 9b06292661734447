"""Which viewpoints to evaluate first."""

import numpy as np
from numpy.typing import NDArray

from ippon.geometry import Float64Array
from ippon.planning.visibility.viewpoints import Viewpoints

_UNKNOWN = 100.0
"""Guess for the very first viewpoints, which have no neighbours to go by."""
_ALIKE_M = 2.0
_BESIDE_M = 1.0


def promise(
    nodes: NDArray[np.int64],
    alive: NDArray[np.int64],
    xy: Float64Array,
    views: Viewpoints,
    voxels: Float64Array,
    *,
    target: int | None,
) -> Float64Array:
    """Guess what evaluating each viewpoint could bring to light.

    The target comes first, then what lies beside an object; a viewpoint that was never evaluated
    is taken for as good as its best neighbour.

    Args:
        nodes: (N,) viewpoints to rate.
        alive: (A,) all viewpoints that exist.
        xy: (capacity, 2) positions, metres.
        views: What is known of them.
        voxels: (M, 3) centres of OOI voxels, metres.
        target: Viewpoint that the robot is on its way to, None for none.

    Returns:
        (N,) expected object voxels, far more for what comes first.
    """
    out = views.gain[nodes].astype(np.float64) + 0.2 * views.potential[nodes]
    fresh = views.evaluated[nodes] < 0
    known = alive[views.evaluated[alive] >= 0]
    if fresh.any():
        guess = np.full(int(fresh.sum()), _UNKNOWN)
        if len(known):
            apart = np.linalg.norm(xy[nodes[fresh], None] - xy[None, known], axis=2)
            guess = 1.0 + np.where(apart < _ALIKE_M, views.potential[known], 0.0).max(axis=1)
        out[fresh] = guess
    if len(voxels):
        apart = np.linalg.norm(xy[nodes, None] - voxels[None, :, :2], axis=2)
        out[apart.min(axis=1) <= _BESIDE_M] += 1e6
    if target is not None:
        out[nodes == target] += 1e7
    return out


def waits(nodes: NDArray[np.int64], views: Viewpoints, min_potential: float) -> bool:
    """Tell whether any of (N,) stale viewpoints might be worth going to."""
    unseen = views.evaluated[nodes] < 0
    return bool((unseen | (views.potential[nodes] >= min_potential)).any())

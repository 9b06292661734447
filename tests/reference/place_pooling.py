"""The filter by places of one voxel, an image at a time."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ippon.mapping.objects.posterior_arithmetic import LOG_ODDS_MAX
from ippon.mapping.objects.surface_voxels import ENERGY_MAX, STEPS_PER_NAT


def place_filter(
    places: Sequence[int], ratios: NDArray[np.float64], prior_log_odds: float
) -> tuple[NDArray[np.float64], float]:
    """Return (N,) q of the common labels, which sums to 1, and L of the object of interest.

    No label is rarer than the most probable one by more than `ENERGY_MAX`, so that it can recover.

    Args:
        places: (K,) where each image was taken from.
        ratios: (K, N + 1) likelihood ratio of each label in each image, the object's last.
        prior_log_odds: L before any image.
    """
    n = ratios.shape[1] - 1
    q, log_odds = np.full(n, 1.0 / n), prior_log_odds
    left: set[int] = set()
    here, images = -1, np.zeros((0, n + 1))
    for place, ratio in zip(places, ratios, strict=True):
        if place != here:
            if place in left:
                continue  # It says nothing new, and the present place stays open.
            left.add(place)
            here, images, before = place, np.zeros((0, n + 1)), (q, log_odds)
        images = np.vstack([images, ratio])
        pooled = images.mean(axis=0)
        q = before[0] * pooled[:n]
        q = np.maximum(q, q.max() * np.exp(-ENERGY_MAX / STEPS_PER_NAT))
        q = q / q.sum()
        log_odds = before[1] + float(np.log(pooled[n]))
        log_odds = min(max(log_odds, -LOG_ODDS_MAX), LOG_ODDS_MAX)
    return q, log_odds

"""The joint Bayes filter over common objects and the object of interest, written plainly."""

import numpy as np
from numpy.typing import NDArray


def joint_filter(likelihoods: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the posterior of (K, M) likelihoods of K images over M labels, equal priors."""
    log_posterior = np.log(likelihoods).sum(axis=0)
    p = np.exp(log_posterior - log_posterior.max())
    return p / p.sum()


def two_part_filter(
    common: NDArray[np.float64], ooi: NDArray[np.float64]
) -> tuple[NDArray[np.float64], float]:
    """Run the two-part form image by image; returns (q, L).

    Args:
        common: (K, N) likelihoods of the common objects.
        ooi: (K,) of the object of interest.
    """
    n = common.shape[1]
    q = np.full(n, 1.0 / n)
    log_odds = -np.log(n)
    for h, h_ooi in zip(common, ooi, strict=True):
        mean = (q * h).sum()
        log_odds += np.log(h_ooi) - np.log(mean)
        q = q * h / mean
    return q, log_odds

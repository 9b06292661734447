"""Confidence intervals and tests for searches that are clustered by home."""

import itertools
import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import bdtr

_RESAMPLES: Final = 10_000
_NORMAL_97_5: Final = 1.959963984540054
"""97.5th percentile of the normal distribution."""
_EXACT_CLUSTERS: Final = 12
"""Number of homes up to which all sign patterns are tested; beyond, 10,000 random ones."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PairedDifference:
    """Difference of two methods on the same episodes."""

    pairs: int
    mean: float
    ci95: tuple[float, float] | None
    """Bootstrap over homes; None for a single pair."""
    standard_error: float | None
    """Standard deviation of the resampled means of that bootstrap; None for a single pair."""
    p: float
    """Two-sided, by flipping the signs of each home's differences together."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Ratio:
    """Ratio of the means of two methods on the same episodes."""

    value: float
    ci95: tuple[float, float] | None
    """Bootstrap over homes; None for a single pair, and without an upper limit: where a resample
    has nothing but zeros below the line."""


def mean_interval(
    values: ArrayLike, clusters: ArrayLike, *, seed: int = 0
) -> tuple[float, float] | None:
    """Return the 95 % bootstrap interval of a mean over episodes clustered by home.

    Episodes of one home are correlated, so homes are resampled with all their episodes; with a
    single home, episodes are resampled.

    Args:
        values: (N,) N of at least 1.
        clusters: (N,) identifier of each home.
        seed: Seed of the resampling.

    Returns:
        Percentiles 2.5 and 97.5 of the resampled means; None for a single episode.
    """
    return _interval(_resampled_ratios(*_by_cluster(values, clusters), seed))


def share_interval(hits: ArrayLike, clusters: ArrayLike) -> tuple[float, float]:
    """Return the 95 % interval of a share by Wilson's formula (JASA 1927).

    Unlike a bootstrap, it has a width where all or none succeed. Where episodes of one home are
    alike, they count as fewer: as many as have the variance of the share between homes (Kish's
    design effect).

    Args:
        hits: (N,) whether each episode succeeded, N of at least 1.
        clusters: (N,) identifier of each home.
    """
    sums, counts = _by_cluster(hits, clusters)
    total = float(counts.sum())
    p = float(sums.sum()) / total
    alone = p * (1.0 - p) * total
    together = float(np.square(sums - p * counts).sum())
    effective = total / max(1.0, together / alone) if alone > 0.0 else total
    z2 = _NORMAL_97_5**2 / effective
    middle = (p + 0.5 * z2) / (1.0 + z2)
    half = math.sqrt(z2 * (p * (1.0 - p) + 0.25 * z2)) / (1.0 + z2)
    return max(0.0, middle - half), min(1.0, middle + half)


def paired_difference(
    one: ArrayLike, other: ArrayLike, clusters: ArrayLike, *, seed: int = 0
) -> PairedDifference:
    """Compare two methods on the same episodes.

    Args:
        one: (N,) values of the first method, N of at least 1.
        other: (N,) values of the second on the same episodes, in the same order.
        clusters: (N,) the home of each.
        seed: Seed of resampling and sign flips.
    """
    difference = np.asarray(one, np.float64) - np.asarray(other, np.float64)
    sums, counts = _by_cluster(difference, clusters)
    means = _resampled_ratios(sums, counts, seed)
    return PairedDifference(
        pairs=len(difference),
        mean=float(difference.mean()),
        ci95=_interval(means),
        standard_error=None if means is None else float(means.std()),
        p=_sign_flip_p(sums, seed),
    )


def paired_ratio(
    one: ArrayLike, other: ArrayLike, clusters: ArrayLike, *, seed: int = 0
) -> Ratio | None:
    """Return the ratio of the means of two methods on the same episodes; None over 0.

    Args:
        one: (N,) values above the line, N of at least 1.
        other: (N,) values below it on the same episodes, in the same order, not negative.
        clusters: (N,) the home of each.
        seed: Seed of the resampling.
    """
    above, _ = _by_cluster(one, clusters)
    below, _ = _by_cluster(other, clusters)
    if not below.any():
        return None
    return Ratio(
        value=float(above.sum() / below.sum()),
        ci95=_interval(_resampled_ratios(above, below, seed)),
    )


def mcnemar_p(wins: int, losses: int) -> float:
    """Return the exact two-sided p of McNemar's test.

    Args:
        wins: Episodes that only the first method solved.
        losses: Episodes that only the second solved.
    """
    # The binomial distribution itself: importing scipy.stats takes most of a second.
    return min(1.0, 2.0 * float(bdtr(min(wins, losses), wins + losses, 0.5)))


def _by_cluster(
    values: ArrayLike, clusters: ArrayLike
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return sums and counts of each cluster; of each value when there is only one cluster."""
    x = np.asarray(values, np.float64)
    if x.ndim != 1 or len(x) == 0:
        raise ValueError(f"statistics need at least one value in a row; got shape {x.shape}")
    names, index = np.unique(np.asarray(clusters).astype(str), return_inverse=True)
    if len(index) != len(x):
        raise ValueError(f"{len(x)} values come with {len(index)} clusters")
    if len(names) == 1:
        return x, np.ones(len(x))
    sums = np.bincount(index, weights=x).astype(np.float64)
    return sums, np.bincount(index).astype(np.float64)


def _resampled_ratios(
    above: NDArray[np.float64], below: NDArray[np.float64], seed: int
) -> NDArray[np.float64] | None:
    """Return the ratios of the sums of clusters drawn with replacement.

    None for a single cluster, and where the sum below the line is 0 in one of the draws.
    """
    if len(above) == 1:
        return None
    rng = np.random.Generator(np.random.PCG64(seed))
    drawn = rng.integers(0, len(above), size=(_RESAMPLES, len(above)))
    divisors = below[drawn].sum(axis=1)
    return above[drawn].sum(axis=1) / divisors if divisors.all() else None


def _interval(resampled: NDArray[np.float64] | None) -> tuple[float, float] | None:
    if resampled is None:
        return None
    low, high = np.percentile(resampled, [2.5, 97.5])
    return float(low), float(high)


def _sign_flip_p(sums: NDArray[np.float64], seed: int) -> float:
    observed = abs(float(sums.sum())) - 1e-12
    if len(sums) <= _EXACT_CLUSTERS:
        signs = np.array(list(itertools.product((1.0, -1.0), repeat=len(sums))))
        return float((np.abs(signs @ sums) >= observed).mean())
    rng = np.random.Generator(np.random.PCG64(seed))
    signs = rng.choice((1.0, -1.0), size=(_RESAMPLES, len(sums)))
    hits = int((np.abs(signs @ sums) >= observed).sum())
    return (1.0 + hits) / (1.0 + _RESAMPLES)

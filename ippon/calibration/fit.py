"""Fit of a score table: maximum a posteriori of the truth under the map's filter.

A voxel's posterior under a table is that of the fusion by places (`ippon.mapping.objects`). Its log
loss is minimised over the table's nats, which rise with the score, from "not recognised" on. A
Gaussian prior of width `SPREAD_NATS` around an earlier table limits the change for few objects
(Bishop, Pattern Recognition and Machine Learning, 2006, 1.2.5). Each known object has weight 1,
whatever its size, and so has other surface of an object's average size.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from ippon.calibration.evidence import Evidence
from ippon.geometry import Float64Array
from ippon.observation_model import (
    MOST_NATS,
    NOT_RECOGNISED,
    NOTHING_SAID,
    ScoreTable,
)

KNOTS: Final = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8)
"""Scores of the knots of a fitted table."""
SPREAD_NATS: Final = 2.0
"""Prior standard deviation of the difference between the nats of two networks."""
_NOT_RECOGNISED_SPREAD: Final = 0.5
_LEAST_NOT_RECOGNISED: Final = -1.0
_MOST_FIRST: Final = 2.0
"""Upper bound of the nats of the first knot above those of "not recognised"."""
BELIEVED: Final = 0.5
"""Probability from which a voxel counts as the object, as in `ippon recognise`."""
BELIEVED_SHARE: Final = 0.25
"""Share of its voxels from which an object counts as found."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Score:
    """Fit of a table to evidence."""

    log_loss: float
    """Sum over objects and over other surface in units of an object's size; lower is better."""
    objects: int
    believed: int
    """Number of objects that are found."""
    wrong_voxels: int
    """Voxels that count as an object and are not."""


def fit_table(
    evidence: Sequence[Evidence], before: ScoreTable, prior_log_odds: float
) -> ScoreTable:
    """Return the maximum a posteriori table for some evidence.

    Args:
        evidence: Of one or several labels, from any number of recordings.
        before: Mean of the prior.
        prior_log_odds: Log-odds of an object at a voxel before any image.
    """
    data = _Data(evidence, prior_log_odds)
    known = before.log_ratios("scores")
    towards = np.array([*(known[round(255 * knot)] for knot in KNOTS), before.not_recognised])
    spread = np.array([SPREAD_NATS] * len(KNOTS) + [_NOT_RECOGNISED_SPREAD])
    # Parameters: nats of "not recognised", increment from there to the first knot, increments
    # between knots. A weak score never tells more against an object than none.
    n = len(KNOTS)
    to_nats = np.vstack([np.tril(np.ones((n, n + 1)), 1), np.eye(1, n + 1)])

    def cost(x: Float64Array) -> tuple[float, Float64Array]:
        nats = to_nats @ x
        loss, slope = data.loss(nats)
        off = (nats - towards) / spread
        return loss + 0.5 * float(off @ off), to_nats.T @ (slope + off / spread)

    start = np.array([towards[n], *np.maximum(np.diff([towards[n], *towards[:n]]), 0.0)])
    bounds = [(_LEAST_NOT_RECOGNISED, 0.0), (0.0, _MOST_FIRST), *[(0.0, MOST_NATS)] * (n - 1)]
    start = np.clip(start, *np.array(bounds).T)
    found = minimize(cost, start, jac=True, method="L-BFGS-B", bounds=bounds)
    nats = np.clip(to_nats @ found.x, -MOST_NATS, MOST_NATS)
    return ScoreTable(
        scores=KNOTS,
        nats=tuple(round(float(x), 3) for x in nats[:n]),
        not_recognised=round(min(float(nats[n]), 0.0), 3),
    )


def score_of(evidence: Sequence[Evidence], table: ScoreTable, prior_log_odds: float) -> Score:
    """Return the fit of a table to any evidence."""
    data = _Data(evidence, prior_log_odds)
    log_odds = data.log_odds(table.log_ratios("scores").astype(np.float64))
    objects = believed = wrong = 0
    loss = 0.0
    for part, odds in zip(evidence, np.split(log_odds, data.ends[:-1]), strict=True):
        sure = odds > np.log(BELIEVED / (1.0 - BELIEVED))
        wrong += int(np.count_nonzero(sure & (part.of_object < 0)))
        for n in range(part.objects):
            objects += 1
            believed += int(sure[part.of_object == n].mean() >= BELIEVED_SHARE)
    loss = float(data.weight @ np.logaddexp(0.0, -data.sign * log_odds))
    return Score(log_loss=loss, objects=objects, believed=believed, wrong_voxels=wrong)


class _Data:
    """Evidence of several labels, concatenated over voxels."""

    def __init__(self, evidence: Sequence[Evidence], prior_log_odds: float) -> None:
        self._parts = evidence
        self._prior = prior_log_odds
        self.ends = np.cumsum([len(one.first) for one in evidence])
        is_object = [one.of_object >= 0 for one in evidence]
        self.sign = np.where(np.concatenate(is_object), 1.0, -1.0)
        sizes = [np.bincount(one.of_object[one.of_object >= 0]) for one in evidence]
        every = np.concatenate(sizes)
        average = float(every.mean()) if len(every) else 1.0
        weights: list[Float64Array] = []
        for one, inside, size in zip(evidence, is_object, sizes, strict=True):
            weight = np.full(len(one.first), 1.0 / average)
            weight[inside] = 1.0 / size[one.of_object[inside]]
            weights.append(weight)
        self.weight = np.concatenate(weights)
        self._reading = _reading()

    def log_odds(self, ratios: Float64Array) -> Float64Array:
        """Return (V,) the log-odds of each voxel, given (256,) nats of the heatmap values."""
        likelihood = np.exp(ratios)
        sums = [np.add.reduceat(np.log(one.values @ likelihood), one.first) for one in self._parts]
        return self._prior + np.concatenate(sums)

    def loss(self, nats: Float64Array) -> tuple[float, Float64Array]:
        """Return the log loss and its gradient, given nats of the knots and of "not recognised".

        Args:
            nats: (K + 1,).
        """
        likelihood = np.exp(self._reading @ nats)
        total, slope = 0.0, np.zeros(256)
        begin = 0
        for one, end in zip(self._parts, self.ends, strict=True):
            mean = one.values @ likelihood
            log_odds = self._prior + np.add.reduceat(np.log(mean), one.first)
            sign, weight = self.sign[begin:end], self.weight[begin:end]
            total += float(weight @ np.logaddexp(0.0, -sign * log_odds))
            pull = -weight * sign / (1.0 + np.exp(np.minimum(sign * log_odds, 500.0)))
            rows = np.diff(np.append(one.first, len(mean)))
            slope += one.values.T @ (np.repeat(pull, rows) / mean)
            begin = int(end)
        return total, self._reading.T @ (slope * likelihood)


def _reading() -> NDArray[np.float64]:
    """Return (256, K + 1) the weights of the knots for each heatmap value."""
    reading = np.zeros((256, len(KNOTS) + 1))
    values = np.arange(256) / 255.0
    for k in range(len(KNOTS)):
        reading[:, k] = np.interp(values, KNOTS, np.eye(len(KNOTS))[k])
    reading[NOT_RECOGNISED], reading[NOTHING_SAID] = 0.0, 0.0
    reading[NOT_RECOGNISED, -1] = 1.0
    return reading

"""A fitted table: monotone, near the truth with many objects, near the one before with few."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import check_grad
from scipy.sparse import csr_matrix

from ippon.calibration.evidence import Evidence
from ippon.calibration.fit import KNOTS, _Data, fit_table, score_of
from ippon.observation_model import (
    LEAST_SCORE,
    NOT_RECOGNISED,
    NOTHING_SAID,
    ScoreTable,
    shipped_models,
)

BEFORE = next(one.table for one in shipped_models() if one.kind == "scores")
PRIOR = -np.log(40.0)


def drawn(seed, *, objects, others, places=3, mean=(0.55, 0.25)):
    """Surface whose scores are drawn from one normal law for objects, another for the rest."""
    rng = np.random.default_rng(seed)
    is_object = np.arange(objects + others) < objects
    scores = rng.normal(np.where(is_object, *mean)[:, None], 0.1, (len(is_object), places))
    columns = np.clip(np.round(255 * scores), 2, 255).astype(int).ravel()
    rows = np.arange(columns.size)
    return Evidence(
        label="cup",
        values=csr_matrix((np.ones(len(rows), np.float32), (rows, columns)), (len(rows), 256)),
        place=np.tile(np.arange(places, dtype=np.uint8), len(is_object)),
        images=np.ones(len(rows), int),
        first=np.arange(0, len(rows), places),
        of_object=np.where(is_object, np.arange(len(is_object)), -1),
        objects=objects,
    )


@pytest.mark.parametrize("seed", range(4))
def test_a_table_is_monotone_and_generalises(seed):
    table = fit_table([drawn(seed, objects=60, others=600)], BEFORE, PRIOR)
    assert list(table.nats) == sorted(table.nats)
    test = [drawn(seed + 100, objects=60, others=600)]
    assert score_of(test, table, PRIOR).log_loss < score_of(test, BEFORE, PRIOR).log_loss
    assert score_of(test, table, PRIOR).believed >= 50


def with_misses(seed):
    """Surface of which labels are missed, too, more or less often for objects than for the rest."""
    rng = np.random.default_rng(seed)
    places = int(rng.integers(1, 5))
    whole = drawn(
        seed, objects=int(rng.integers(1, 40)), others=int(rng.integers(0, 300)), places=places,
        mean=rng.uniform(0.05, 0.9, 2),
    )  # fmt: skip
    misses = np.where(np.repeat(whole.of_object >= 0, places), *rng.random(2))
    columns = whole.values.indices.copy()
    is_missed = rng.random(len(columns)) < misses
    columns[is_missed] = rng.integers(NOT_RECOGNISED, NOTHING_SAID + 1, is_missed.sum())
    parts = (whole.values.data, columns, whole.values.indptr)
    return replace(whole, values=csr_matrix(parts, whole.values.shape))


@pytest.mark.parametrize("seed", range(20))
def test_no_score_tells_more_against_an_object_than_not_being_recognised(seed):
    table = fit_table([with_misses(seed)], BEFORE, PRIOR)
    ratios = table.log_ratios("scores")
    rising = np.concatenate([ratios[:1], ratios[LEAST_SCORE:]])
    assert (np.diff(rising) >= 0.0).all()
    assert table.not_recognised <= table.nats[0]
    assert list(table.nats) == sorted(table.nats)


def test_uninformative_scores_get_no_evidence():
    table = fit_table([drawn(0, objects=100, others=4000, mean=(0.4, 0.4))], BEFORE, PRIOR)
    fitted = np.interp([0.3, 0.4, 0.5], table.scores, table.nats)
    assert np.abs(fitted).max() < 1.0


def test_a_single_object_moves_the_table_little():
    table = fit_table([drawn(0, objects=1, others=1)], BEFORE, PRIOR)
    before = np.interp(KNOTS, BEFORE.scores, BEFORE.nats)
    assert np.abs(np.array(table.nats) - before).max() < 1.0


def test_the_slope_is_that_of_the_loss():
    data = _Data([drawn(1, objects=5, others=50), drawn(2, objects=0, others=20)], PRIOR)
    at = np.linspace(-1.0, 3.0, len(KNOTS) + 1)
    error = check_grad(lambda x: data.loss(x)[0], lambda x: data.loss(x)[1], at)
    assert error < 1e-4


def test_a_large_object_weighs_as_much_as_a_small_one():
    small = drawn(3, objects=2, others=0, places=1)
    large = Evidence(
        label="cup", values=small.values[[0, 0, 0, 0, 1]], place=np.zeros(5, np.uint8),
        images=np.ones(5, int), first=np.arange(5),
        of_object=np.array([0, 0, 0, 0, 1]), objects=2,
    )  # fmt: skip
    table = ScoreTable(scores=(0.1, 0.9), nats=(-1.0, 3.0))
    assert score_of([large], table, PRIOR).log_loss == pytest.approx(
        score_of([small], table, PRIOR).log_loss
    )

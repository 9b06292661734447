import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ippon.evaluation.statistics import (
    mcnemar_p,
    mean_interval,
    paired_difference,
    paired_ratio,
    share_interval,
)
from tests import later

stats = later.module("scipy.stats")


def test_the_interval_of_equal_values_is_that_value():
    assert mean_interval([0.25] * 8, list("aabbccdd")) == (0.25, 0.25)


def test_homes_are_drawn_whole():
    # Two homes, all 0 and all 1: their resampled means are 0, 1/2 and 1, each side a quarter.
    assert mean_interval([0, 0, 0, 1, 1, 1], list("aaabbb")) == (0.0, 1.0)


def test_larger_homes_weigh_more():
    low, high = mean_interval([0.0, 1.0, 1.0, 1.0], list("abbb"))
    assert (low, high) == (0.0, 1.0)
    rng = np.random.default_rng(1)
    homes = np.repeat(np.arange(40), 5)
    values = rng.random(200)
    low, high = mean_interval(values, homes)
    assert low < values.mean() < high


def test_a_single_home_is_resampled_by_episode():
    low, high = mean_interval([0.0] * 50 + [1.0] * 50, ["a"] * 100)
    # The normal approximation: 0.5 ± 1.96 * 0.05.
    assert low == pytest.approx(0.40, abs=0.02)
    assert high == pytest.approx(0.60, abs=0.02)


def test_a_single_search_has_no_interval():
    assert mean_interval([0.9], ["a"]) is None
    single = paired_difference([0.9], [0.5], ["a"])
    assert (single.ci95, single.standard_error) == (None, None)
    assert paired_ratio([0.9], [0.5], ["a"]).ci95 is None


def test_the_interval_repeats_for_a_seed():
    values, homes, zero = np.random.default_rng(2).random(20), range(20), np.zeros(20)
    assert mean_interval(values, homes, seed=3) == mean_interval(values, homes, seed=3)
    assert mean_interval(values, homes) == mean_interval(values, homes, seed=0)
    assert mean_interval(values, homes, seed=3) != mean_interval(values, homes, seed=0)
    assert paired_difference(values, zero, homes) == paired_difference(values, zero, homes, seed=0)


@pytest.mark.parametrize(("ones", "n"), [(3, 6), (4, 8), (1, 3), (2, 3)])
def test_the_interval_of_a_share_is_the_binomial_one(ones, n):
    # Resampled ones of n episodes of one home follow the binomial distribution exactly.
    values = [1.0] * ones + [0.0] * (n - ones)
    expected = stats.binom(n, ones / n).ppf([0.025, 0.975]) / n
    assert mean_interval(values, ["a"] * n) == pytest.approx(tuple(expected))


@given(
    values=st.lists(st.floats(-5.0, 5.0), min_size=2, max_size=6),
    shift=st.floats(-3.0, 3.0),
    scale=st.floats(0.1, 3.0),
)
@settings(max_examples=10, deadline=None)
def test_the_interval_moves_and_scales_with_the_values(values, shift, scale):
    homes = range(len(values))
    low, high = mean_interval(values, homes)
    moved = mean_interval(shift + scale * np.array(values), homes)
    assert min(values) - 1e-9 <= low <= high <= max(values) + 1e-9
    assert moved == pytest.approx((shift + scale * low, shift + scale * high), abs=1e-9)


def test_the_standard_error_is_that_of_a_mean_over_homes():
    values = np.random.default_rng(4).normal(0.0, 0.1, 100)
    alone = paired_difference(values, np.zeros(100), np.arange(100)).standard_error
    assert alone == pytest.approx(values.std() / 10.0, rel=0.03)
    # Five searches that are alike say no more than one.
    together = paired_difference(np.repeat(values, 5), np.zeros(500), np.repeat(range(100), 5))
    assert together.standard_error == pytest.approx(alone)


def test_the_interval_of_a_ratio_holds_the_true_one_about_as_often_as_it_says():
    rng, hits = np.random.default_rng(8), 0
    for _ in range(100):
        below = rng.uniform(0.2, 0.8, 40)
        above = 1.3 * below * rng.uniform(0.5, 1.5, 40)
        low, high = paired_ratio(above, below, np.arange(40)).ci95
        hits += low <= 1.3 <= high
    # Of 100 binomial draws at 0.95 (0.93 for so few homes) 99 % lie here.
    assert 86 <= hits <= 99


def test_a_ratio_over_zeros_has_no_value_and_one_over_some_zeros_may_have_no_limit():
    assert paired_ratio([0.5, 0.6], [0.0, 0.0], ["a", "b"]) is None
    some = paired_ratio([0.5, 0.6, 0.4], [0.0, 0.0, 0.5], ["a", "b", "c"])
    assert some.value == pytest.approx(3.0)
    assert some.ci95 is None
    assert paired_ratio([0.0, 0.0], [0.5, 0.5], ["a", "b"]).ci95 == (0.0, 0.0)


@given(
    differences=st.lists(st.integers(-8, 8), min_size=1, max_size=8),
    scale=st.sampled_from((0.25, 2.0)),
)
@settings(max_examples=20, deadline=None)
def test_p_is_the_same_for_both_methods_and_every_unit(differences, scale):
    zero, homes = np.zeros(len(differences)), np.arange(len(differences))
    p = paired_difference(differences, zero, homes).p
    assert 0.0 < p <= 1.0
    assert paired_difference(zero, differences, homes).p == p
    assert paired_difference(scale * np.array(differences), zero, homes).p == p


@pytest.mark.parametrize(("homes", "p"), [(3, 0.25), (5, 0.0625), (12, 2 / 4096)])
def test_the_paired_test_is_exact_for_few_homes(homes, p):
    # All homes differ alike: only the two patterns of equal signs are as extreme.
    result = paired_difference(np.full(homes, 0.7), np.full(homes, 0.2), np.arange(homes))
    assert result.p == pytest.approx(p)
    assert result.mean == pytest.approx(0.5)
    assert result.ci95 == pytest.approx((0.5, 0.5))
    assert result.pairs == homes


def test_equal_methods_do_not_differ():
    values = np.random.default_rng(0).random(30)
    result = paired_difference(values, values, np.arange(30))
    assert (result.mean, result.p) == (0.0, 1.0)


def test_many_homes_are_tested_by_random_signs():
    rng = np.random.default_rng(5)
    noise = rng.normal(0.0, 0.1, 60)
    clear = paired_difference(0.2 + noise, np.zeros(60), np.arange(60))
    none = paired_difference(noise - noise.mean(), np.zeros(60), np.arange(60))
    assert clear.p == pytest.approx(1.0 / 10_001.0, rel=1e-6), "none of 10,000 is as extreme"
    assert none.p > 0.9
    assert clear.ci95[0] > 0.0


def test_p_of_many_homes_is_about_that_of_the_normal_distribution():
    values = np.random.default_rng(6).normal(0.0, 0.1, 80)
    z = values.sum() / np.sqrt((values**2).sum())
    p = paired_difference(values, np.zeros(80), np.arange(80)).p
    assert p == pytest.approx(2.0 * stats.norm.sf(abs(z)), abs=0.02)
    assert 0.05 < p < 0.8


def test_from_13_homes_on_signs_are_drawn():
    drawn = 10_001 * paired_difference(np.full(13, 0.1), np.zeros(13), np.arange(13)).p
    assert drawn == pytest.approx(round(drawn))
    assert 1 <= drawn <= 10, "2 of 8192 patterns are as extreme"


def test_episodes_of_one_home_are_no_independent_evidence():
    values = np.full(40, 0.3)
    by_home = paired_difference(values, np.zeros(40), np.repeat([0, 1], 20))
    assert by_home.p == pytest.approx(0.5)


@pytest.mark.parametrize(("count", "of"), [(0, 1), (20, 20), (188, 200), (11, 14), (1, 3)])
def test_the_interval_of_a_success_rate_is_wilson_s(count, of):
    expected = stats.binomtest(count, of).proportion_ci(method="wilson")
    hits = [1.0] * count + [0.0] * (of - count)
    for homes in (["a"] * of, range(of)):
        assert share_interval(hits, homes) == pytest.approx((expected.low, expected.high))


def test_episodes_of_a_home_that_are_all_alike_count_as_one():
    homes = [1.0, 0.0, 1.0, 1.0, 0.0, 1.0] * 20
    once = share_interval(homes, range(120))
    assert share_interval(np.repeat(homes, 5), np.repeat(range(120), 5)) == pytest.approx(once)


def test_mcnemar_is_the_binomial_test():
    for wins, losses in ((1, 0), (4, 9), (30, 12), (700, 640), (3_000, 1_000)):
        expected = stats.binomtest(wins, wins + losses, 0.5).pvalue
        assert mcnemar_p(wins, losses) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize(
    ("wins", "losses", "p"),
    [(0, 0, 1.0), (5, 1, 14 / 64), (3, 3, 1.0), (6, 0, 2 / 64), (0, 6, 2 / 64)],
)
def test_mcnemar_by_hand(wins, losses, p):
    assert mcnemar_p(wins, losses) == pytest.approx(p)


def test_nothing_has_no_mean():
    with pytest.raises(ValueError, match="at least one value"):
        mean_interval([], [])
    with pytest.raises(ValueError, match="3 values come with 2 clusters"):
        mean_interval([1, 2, 3], ["a", "b"])

"""Scores of viewpoints and the selection by them, eq. (5)."""

import dataclasses
import math

import numpy as np
import pytest

from ippon.planning.roadmap.shortest_tree import ShortestTree
from ippon.planning.selection.node_selection import (
    SelectionConfig,
    holding_termination_min,
    max_gain_per_s,
    score_nodes,
    select,
)

CONFIG = SelectionConfig(
    passing_weight=1.0, look_s=1.0, stay_factor=1.3, stay_power=0.0, cost_power=1.0
)


def chain(costs: list[float]) -> ShortestTree:
    """Nodes one after another along +x."""
    n = len(costs)
    return ShortestTree(
        cost=np.array(costs, dtype=float),
        parent=np.arange(-1, n - 1),
        via=np.zeros(n, dtype=np.int64),
        heading=np.zeros(n),
        order=np.flatnonzero(np.isfinite(costs)),
    )


def score(
    tree, gain, *, termination=None, yaw=None, t_min=5.0, eligible=None, config=CONFIG, current=None
):
    n = len(gain)
    by_heading = np.repeat(np.array(gain, dtype=np.float32)[:, None], 8, axis=1)
    return score_nodes(
        config,
        tree,
        gain=np.array(gain, dtype=np.float32),
        by_heading=by_heading,
        termination=np.array(termination or [0.0] * n, dtype=np.float32),
        yaw=np.array(yaw or [0.0] * n),
        eligible=np.ones(n, dtype=bool) if eligible is None else np.array(eligible),
        termination_min=t_min,
        turn_rate=1.2,
        current=current,
    )


def test_gain_adds_up_along_the_path_and_cost_includes_the_last_turn():
    scores = score(chain([2.0, 4.0, 6.0]), [10.0, 20.0, 5.0], yaw=[0.0, math.pi / 2, 0.0])
    np.testing.assert_allclose(scores.path_gain, [10.0, 30.0, 35.0])
    np.testing.assert_allclose(scores.path_cost, [2.0, 4.0 + math.pi / 2 / 1.2, 6.0])
    np.testing.assert_allclose(scores.ratio, scores.path_gain / (scores.path_cost + 1.0))


def test_passing_gain_is_weighed():
    half = SelectionConfig(passing_weight=0.5)
    scores = score(chain([2.0, 4.0]), [10.0, 20.0], config=half)
    np.testing.assert_allclose(scores.path_gain, [10.0, 25.0])


def test_the_best_ratio_wins():
    scores = score(chain([2.0, 4.0, 40.0]), [3.0, 90.0, 95.0])
    assert select(scores, None) == 1


def test_a_power_of_the_cost_finishes_near_regions_first():
    tree, gain = chain([2.0, 14.0]), [10.0, 60.0]
    apart = tree._replace(parent=np.array([-1, -1]))
    assert select(score(apart, gain), None) == 1
    near_first = dataclasses.replace(CONFIG, cost_power=1.6)
    scores = score(apart, gain, config=near_first)
    np.testing.assert_allclose(scores.ratio, np.array(gain) / np.array([3.0, 15.0]) ** 1.6)
    assert select(scores, None) == 0
    ends = score(apart, gain, termination=[6.0, 7.0], config=near_first)
    np.testing.assert_allclose(ends.ratio, np.array([6.0, 7.0]) / np.array([3.0, 15.0]))


def test_terminating_nodes_come_first_by_voxels_over_cost():
    papers = SelectionConfig(framing_cap=math.inf)
    gain, termination = [900.0, 1.0, 1.0], [5.0, 6.0, 30.0]
    scores = score(chain([2.0, 4.0, 6.0]), gain, termination=termination, config=papers)
    assert scores.terminating.tolist() == [False, True, True], "T must exceed T_min"
    assert select(scores, None) == 2
    assert select(scores, 0) == 2, "whatever the robot was on its way to"


def test_the_nearest_of_views_that_are_full_enough_is_selected():
    scores = score(chain([2.0, 4.0, 6.0]), [1.0] * 3, termination=[6.0, 8.0, 30.0])
    assert select(scores, None) == 0


def test_a_terminating_target_is_held_while_voxels_appear_and_disappear():
    tree, gain = chain([2.0, 4.0]), [900.0, 1.0]
    assert score(tree, gain, termination=[0.0, 4.0], current=1).terminating.tolist()[1]
    assert not score(tree, gain, termination=[0.0, 4.0], current=0).terminating.any()
    assert not score(tree, gain, termination=[0.0, 2.0], current=1).terminating.any()


def test_nodes_that_are_unreachable_or_not_eligible_are_not_selected():
    scores = score(chain([2.0, math.inf]), [1.0, 50.0], eligible=[False, True])
    assert select(scores, None) is None
    assert select(scores, 1) is None


def test_weights_without_meaning_are_refused():
    with pytest.raises(ValueError, match="stay_factor"):
        SelectionConfig(stay_factor=0.5)
    with pytest.raises(ValueError, match="max_reevaluations must be at least 1"):
        SelectionConfig(max_reevaluations=0)
    with pytest.raises(ValueError, match="passing_weight"):
        SelectionConfig(passing_weight=2.0)
    for name, wrong in (
        ("cost_power", 0.0),
        ("cost_power", math.inf),
        ("stay_power", -0.1),
        ("fade_power", -1.0),
    ):
        with pytest.raises(ValueError, match=name):
            SelectionConfig(**{name: wrong})


def test_one_voxel_never_ends_a_search():
    assert holding_termination_min(CONFIG, 1.0) == 1.0
    assert holding_termination_min(CONFIG, 10.0) == pytest.approx(6.0)


def test_the_highest_gain_per_second_is_that_of_an_exploring_path():
    def highest(gain, **more):
        return max_gain_per_s(CONFIG, score(chain([2.0, 6.0]), gain, **more))

    assert highest([12.0, 0.0]) == pytest.approx(12.0 / (2.0 + CONFIG.look_s))
    assert highest([12.0, 60.0]) == pytest.approx(72.0 / (6.0 + CONFIG.look_s))
    assert highest([12.0, 60.0], eligible=[True, False]) == highest([12.0, 0.0])
    assert highest([12.0, 60.0], eligible=[False, False]) == 0.0
    assert highest([12.0, 60.0], termination=[9.0, 9.0]) == 0.0, "those end the search"

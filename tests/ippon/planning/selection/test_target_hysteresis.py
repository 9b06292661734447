"""Hysteresis of the target."""

import dataclasses
import math

import numpy as np
import pytest

from ippon.planning.roadmap.shortest_tree import ShortestTree
from ippon.planning.selection.node_selection import Scores, SelectionConfig, select
from ippon.planning.selection.target_hysteresis import (
    ReturnCounter,
    credit_passed_gain,
    retention_of,
    update_target_progress,
)
from tests.ippon.planning.selection.test_node_selection import CONFIG, chain, score


def chosen_by(config, scores, target, *, returns=0, remaining=1.0):
    """Select with the hysteresis of a target."""
    if target is None:
        return select(scores, None)
    kept = retention_of(config, scores, target, returns=returns, remaining=remaining)
    return select(scores, target, kept.factor)


def test_retention_is_the_product_of_its_factors():
    firm = dataclasses.replace(CONFIG, stay_power=1.0)
    scores = score(chain([9.0, 9.0]), [1.0, 1.0], config=firm)
    kept = retention_of(firm, scores, 0, returns=2, remaining=1.0)
    assert kept == pytest.approx((1.3, 1.2**2, 10.0))
    assert kept.factor == pytest.approx(1.3 * 1.44 * 10.0)
    ends = score(chain([9.0, 9.0]), [1.0, 1.0], termination=[9.0, 9.0], config=firm)
    assert retention_of(firm, ends, 0, returns=0, remaining=1.0).progress == 1.0


def test_a_target_is_kept_unless_another_is_clearly_better():
    tree = chain([3.0, 3.0])
    scores = score(tree, [10.0, 11.0], config=SelectionConfig(passing_weight=0.0))
    assert chosen_by(CONFIG, scores, 0) == 0
    assert chosen_by(CONFIG, scores, None) == 1
    clearly = score(tree, [10.0, 20.0], config=SelectionConfig(passing_weight=0.0))
    assert chosen_by(CONFIG, clearly, 0) == 1


def test_a_long_path_is_seldom_left_half_way():
    firm = dataclasses.replace(CONFIG, stay_power=1.0)

    def chosen(seconds, better):
        tree = chain([seconds, seconds])._replace(parent=np.array([-1, -1]))
        return chosen_by(firm, score(tree, [10.0, 10.0 * better], config=firm), 0)

    assert (chosen(1.0, 2.5), chosen(1.0, 2.7)) == (0, 1)
    assert (chosen(9.0, 12.5), chosen(9.0, 13.5)) == (0, 1)
    ends = score(chain([9.0, 9.0]), [1.0, 1.0], termination=[6.0, 8.1], t_min=5.0, config=firm)
    worth = ends.ratio[1] / ends.ratio[0]
    assert worth > CONFIG.stay_factor - 0.1
    assert chosen_by(firm, ends._replace(ratio=ends.ratio * np.array([1.0, 1.3])), 0) == 1


def test_a_path_whose_gain_was_seen_is_left_like_a_short_one():
    firm = dataclasses.replace(CONFIG, stay_power=1.0, fade_power=2.0)

    def chosen(better, left):
        tree = chain([9.0, 9.0])._replace(parent=np.array([-1, -1]))
        return chosen_by(firm, score(tree, [10.0, 10.0 * better], config=firm), 0, remaining=left)

    assert (chosen(12.5, 1.0), chosen(13.5, 1.0)) == (0, 1)
    at_half = CONFIG.stay_factor * 10.0**0.25
    assert (chosen(0.95 * at_half, 0.5), chosen(1.05 * at_half, 0.5)) == (0, 1)
    assert (chosen(1.25, 0.0), chosen(1.35, 0.0)) == (0, 1)


def test_progress_keeps_the_highest_gain_since_the_target_was_selected():
    def scored(gain):
        return score(chain([2.0, 4.0]), gain), np.array(gain, dtype=np.float32)

    first, gain = scored([10.0, 20.0])
    chosen = update_target_progress(first, gain, 1, None)
    assert (chosen.max_gain, chosen.remaining(first)) == (30.0, 1.0)
    more, gain = scored([10.0, 40.0])
    chosen = update_target_progress(more, gain, 1, chosen)
    assert (chosen.max_gain, chosen.passing) == (50.0, 10.0), "more came into view"
    less, gain = scored([0.0, 5.0])
    assert update_target_progress(less, gain, 1, chosen) is chosen
    assert chosen.remaining(less) == pytest.approx(0.1), "seen from half way"
    assert update_target_progress(less, gain, 0, chosen).max_gain == 0.0, (
        "another target, another promise"
    )
    assert update_target_progress(less, gain, 0, chosen).remaining(less) == 0.0


class Alternating:
    """Two ways whose estimates are off: whichever is taken turns out dearer than the other."""

    def __init__(self, config, step_m=0.0):
        self.config, self.step_m = config, step_m
        self.returns, self.target, self.switches, self.x = ReturnCounter(config), None, 0, 0.0

    def choose(self, worse=2.0):
        ratio = np.array([5.0, 5.0])
        if self.target is not None:
            ratio[self.target] /= worse
        gains = np.array([5.0, 5.0])
        scores = Scores(gains, gains / ratio, ratio, np.zeros(2, bool))
        chosen = chosen_by(self.config, scores, self.target, returns=self.returns.count)
        self.returns.note(self.target, chosen, (self.x, 0.0))
        self.switches += self.target is not None and chosen != self.target
        self.target = chosen
        self.x += self.step_m


def test_two_targets_do_not_alternate_for_ever():
    robot, for_ever = Alternating(CONFIG), Alternating(dataclasses.replace(CONFIG, patience=1.0))
    for _ in range(100):
        robot.choose()
        for_ever.choose()
    assert 0 < robot.switches < 6
    assert for_ever.switches == 99


def test_returns_are_counted_from_0_after_the_robot_has_moved_on():
    robot = Alternating(CONFIG, step_m=1.1 * CONFIG.moved_on_m)
    for _ in range(30):
        robot.choose()
    assert robot.switches == 29


def test_a_new_node_with_the_number_of_a_removed_one_is_no_return():
    returns = ReturnCounter(CONFIG)
    returns.note(3, 4, (0.0, 0.0))
    returns.forget(3)
    returns.note(4, 3, (0.0, 0.0))
    assert returns.count == 0


def test_new_targets_are_no_returns():
    returns = ReturnCounter(CONFIG)
    for node in range(30):
        returns.note(node, node + 1, (0.0, 0.0))
    assert returns.count == 0


def test_a_target_keeps_the_gain_of_the_viewpoints_on_its_first_path():
    gain = np.array([10.0, 20.0, 24.0], dtype=np.float32)
    chosen = update_target_progress(
        score(chain([2.0, 4.0, math.inf]), [10.0, 20.0, 24.0]), gain, 1, None
    )
    assert chosen is not None
    assert (chosen.node, chosen.passing, chosen.cost) == (1, 10.0, 4.0)
    # Now the robot's own way leads to it, past no node, and another one looks better for it.
    own = ShortestTree(
        cost=np.array([2.0, 4.0, 4.0]),
        parent=np.full(3, -1),
        via=np.zeros(3, dtype=np.int64),
        heading=np.zeros(3),
        order=np.arange(3),
    )
    bare = SelectionConfig(stay_factor=1.0, stay_power=0.0, look_s=1.0)
    scores = score(own, gain.tolist(), config=bare)
    assert chosen_by(bare, scores, 1) == 2
    kept = credit_passed_gain(bare, scores, gain, chosen)
    assert kept.path_gain[1] == 30.0
    assert chosen_by(bare, kept, 1) == 1
    assert kept.ratio[1] == pytest.approx(30.0 / 5.0**bare.cost_power), "compared like the others"
    # Half way there half of what was to be passed is left.
    near = score(own._replace(cost=np.array([1.0, 2.0, 2.0])), gain.tolist(), config=bare)
    assert credit_passed_gain(bare, near, gain, chosen).path_gain[1] == 25.0
    assert update_target_progress(scores, gain, 1, chosen) is chosen
    assert update_target_progress(scores, gain, None, chosen) is None

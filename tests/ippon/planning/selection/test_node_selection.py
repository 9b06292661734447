"""Which viewpoint wins, eq. (5)."""

import dataclasses
import math

import numpy as np
import pytest

from ippon.planning.roadmap.shortest_tree import ShortestTree
from ippon.planning.selection.node_selection import (
    MOVED_ON_M,
    Patience,
    Scores,
    SelectionConfig,
    commit,
    held,
    promised_per_s,
    score_nodes,
    select,
    with_passing,
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
    assert select(CONFIG, scores, None) == 1


def test_a_power_of_the_cost_finishes_what_is_near_first():
    tree, gain = chain([2.0, 14.0]), [10.0, 60.0]
    apart = tree._replace(parent=np.array([-1, -1]))
    assert select(CONFIG, score(apart, gain), None) == 1
    near_first = dataclasses.replace(CONFIG, cost_power=1.6)
    scores = score(apart, gain, config=near_first)
    np.testing.assert_allclose(scores.ratio, np.array(gain) / np.array([3.0, 15.0]) ** 1.6)
    assert select(near_first, scores, None) == 0
    ends = score(apart, gain, termination=[6.0, 7.0], config=near_first)
    np.testing.assert_allclose(ends.ratio, np.array([6.0, 7.0]) / np.array([3.0, 15.0]))


def test_terminating_nodes_come_first_by_voxels_over_cost():
    papers = SelectionConfig(framing_cap=math.inf)
    gain, termination = [900.0, 1.0, 1.0], [5.0, 6.0, 30.0]
    scores = score(chain([2.0, 4.0, 6.0]), gain, termination=termination, config=papers)
    assert scores.terminating.tolist() == [False, True, True], "T must exceed T_min"
    assert select(CONFIG, scores, None) == 2
    assert select(CONFIG, scores, 0) == 2, "whatever the robot was on its way to"


def test_of_views_that_are_full_enough_the_nearest_is_chosen():
    scores = score(chain([2.0, 4.0, 6.0]), [1.0] * 3, termination=[6.0, 8.0, 30.0])
    assert select(CONFIG, scores, None) == 0


def test_a_terminating_target_outlives_voxels_that_come_and_go():
    tree, gain = chain([2.0, 4.0]), [900.0, 1.0]
    assert score(tree, gain, termination=[0.0, 4.0], current=1).terminating.tolist()[1]
    assert not score(tree, gain, termination=[0.0, 4.0], current=0).terminating.any()
    assert not score(tree, gain, termination=[0.0, 2.0], current=1).terminating.any()


def test_a_target_is_kept_unless_another_is_clearly_better():
    tree = chain([3.0, 3.0])
    scores = score(tree, [10.0, 11.0], config=SelectionConfig(passing_weight=0.0))
    assert select(CONFIG, scores, 0) == 0
    assert select(CONFIG, scores, None) == 1
    clearly = score(tree, [10.0, 20.0], config=SelectionConfig(passing_weight=0.0))
    assert select(CONFIG, clearly, 0) == 1


def test_a_long_way_is_seldom_left_half_way():
    firm = dataclasses.replace(CONFIG, stay_power=1.0)

    def chosen(seconds, better):
        tree = chain([seconds, seconds])._replace(parent=np.array([-1, -1]))
        return select(firm, score(tree, [10.0, 10.0 * better], config=firm), 0)

    assert (chosen(1.0, 2.5), chosen(1.0, 2.7)) == (0, 1)
    assert (chosen(9.0, 12.5), chosen(9.0, 13.5)) == (0, 1)
    ends = score(chain([9.0, 9.0]), [1.0, 1.0], termination=[6.0, 8.1], t_min=5.0, config=firm)
    worth = ends.ratio[1] / ends.ratio[0]
    assert worth > CONFIG.stay_factor - 0.1
    assert select(firm, ends._replace(ratio=ends.ratio * np.array([1.0, 1.3])), 0) == 1


def test_a_way_whose_promise_is_gone_is_left_like_a_short_one():
    firm = dataclasses.replace(CONFIG, stay_power=1.0, fade_power=2.0)

    def chosen(better, left):
        tree = chain([9.0, 9.0])._replace(parent=np.array([-1, -1]))
        return select(firm, score(tree, [10.0, 10.0 * better], config=firm), 0, None, left)

    assert (chosen(12.5, 1.0), chosen(13.5, 1.0)) == (0, 1)
    at_half = CONFIG.stay_factor * 10.0**0.25
    assert (chosen(0.95 * at_half, 0.5), chosen(1.05 * at_half, 0.5)) == (0, 1)
    assert (chosen(1.25, 0.0), chosen(1.35, 0.0)) == (0, 1)


def test_what_a_way_promised_is_the_most_that_it_ever_had_since_it_was_chosen():
    def promising(gain):
        return score(chain([2.0, 4.0]), gain), np.array(gain, dtype=np.float32)

    first, gain = promising([10.0, 20.0])
    chosen = commit(first, gain, 1, None)
    assert (chosen.promised, chosen.left(first)) == (30.0, 1.0)
    more, gain = promising([10.0, 40.0])
    chosen = commit(more, gain, 1, chosen)
    assert (chosen.promised, chosen.passing) == (50.0, 10.0), "more came into view"
    less, gain = promising([0.0, 5.0])
    assert commit(less, gain, 1, chosen) is chosen
    assert chosen.left(less) == pytest.approx(0.1), "seen from half way"
    assert commit(less, gain, 0, chosen).promised == 0.0, "another target, another promise"
    assert commit(less, gain, 0, chosen).left(less) == 0.0


class Dithering:
    """Two ways whose estimates are off: whichever is taken turns out dearer than the other."""

    def __init__(self, config, step_m=0.0):
        self.config, self.step_m = config, step_m
        self.patience, self.target, self.switches, self.x = Patience(), None, 0, 0.0

    def choose(self, worse=2.0):
        ratio = np.array([5.0, 5.0])
        if self.target is not None:
            ratio[self.target] /= worse
        gains = np.array([5.0, 5.0])
        scores = Scores(gains, gains / ratio, ratio, np.zeros(2, bool))
        stay = self.patience.stay_factor(self.config)
        chosen = select(self.config, scores, self.target, stay)
        self.patience.note(self.target, chosen, (self.x, 0.0))
        self.switches += self.target is not None and chosen != self.target
        self.target = chosen
        self.x += self.step_m


def test_two_targets_do_not_take_turns_for_ever():
    robot, for_ever = Dithering(CONFIG), Dithering(dataclasses.replace(CONFIG, patience=1.0))
    for _ in range(100):
        robot.choose()
        for_ever.choose()
    assert 0 < robot.switches < 6
    assert for_ever.switches == 99


def test_a_robot_that_moves_on_may_change_its_mind_again():
    robot = Dithering(CONFIG, step_m=1.1 * MOVED_ON_M)
    for _ in range(30):
        robot.choose()
    assert robot.switches == 29


def test_to_take_one_target_after_another_is_no_dithering():
    patience = Patience()
    for node in range(30):
        patience.note(node, node + 1, (0.0, 0.0))
    assert patience.stay_factor(CONFIG) == CONFIG.stay_factor


def test_nobody_is_chosen_who_cannot_be_reached_or_is_not_eligible():
    scores = score(chain([2.0, math.inf]), [1.0, 50.0], eligible=[False, True])
    assert select(CONFIG, scores, None) is None
    assert select(CONFIG, scores, 1) is None


def test_weights_without_meaning_are_refused():
    with pytest.raises(ValueError, match="stay_factor"):
        SelectionConfig(stay_factor=0.5)
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


def test_a_target_keeps_the_gain_of_what_it_was_chosen_to_pass():
    gain = np.array([10.0, 20.0, 24.0], dtype=np.float32)
    chosen = commit(score(chain([2.0, 4.0, math.inf]), [10.0, 20.0, 24.0]), gain, 1, None)
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
    assert select(bare, scores, 1) == 2
    kept = with_passing(bare, scores, gain, chosen)
    assert kept.path_gain[1] == 30.0
    assert select(bare, kept, 1) == 1
    assert kept.ratio[1] == pytest.approx(30.0 / 5.0**bare.cost_power), "compared like the others"
    # Half way there half of what was to be passed is left.
    near = score(own._replace(cost=np.array([1.0, 2.0, 2.0])), gain.tolist(), config=bare)
    assert with_passing(bare, near, gain, chosen).path_gain[1] == 25.0
    assert commit(scores, gain, 1, chosen) is chosen
    assert commit(scores, gain, None, chosen) is None


def test_one_voxel_never_ends_a_search():
    assert held(CONFIG, 1.0) == 1.0
    assert held(CONFIG, 10.0) == pytest.approx(6.0)


def test_of_ways_to_explore_the_one_with_most_gain_a_second_counts():
    def promised(gain, **more):
        return promised_per_s(CONFIG, score(chain([2.0, 6.0]), gain, **more))

    assert promised([12.0, 0.0]) == pytest.approx(12.0 / (2.0 + CONFIG.look_s))
    assert promised([12.0, 60.0]) == pytest.approx(72.0 / (6.0 + CONFIG.look_s))
    assert promised([12.0, 60.0], eligible=[True, False]) == promised([12.0, 0.0])
    assert promised([12.0, 60.0], eligible=[False, False]) == 0.0
    assert promised([12.0, 60.0], termination=[9.0, 9.0]) == 0.0, "those end the search"

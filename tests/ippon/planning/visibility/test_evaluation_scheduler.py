"""Which viewpoints are evaluated in a step."""

from types import SimpleNamespace

import numpy as np
import pytest

from ippon.planning.deadline import UNLIMITED, Deadline
from ippon.planning.visibility.evaluation_scheduler import (
    EvaluationScheduler,
    ViewpointEvaluationConfig,
)
from tests.ippon.planning.joined import late

ARRAYS = SimpleNamespace(voxel_size=0.1)
NOTHING = np.zeros((0, 3))


class Views:
    """Viewpoints in a row, 3 m apart, of which some are to be evaluated."""

    def __init__(self, count=8, due=None):
        self.due = np.ones(count, dtype=np.bool_) if due is None else np.isin(range(count), due)
        self.gain = np.arange(float(count))
        self.potential = np.zeros(count)
        self.evaluated = np.arange(count)[::-1].copy()
        self.for_other_goal = np.zeros(count, dtype=np.bool_)
        self.done: list[int] = []

    def stale(self, nodes, xy, voxel_size):
        return self.due[nodes]

    def evaluate(self, node, at, arrays):
        np.testing.assert_array_equal(at, [3.0 * node, 0.0])
        self.done.append(node)
        self.evaluated[node] = 100


def evaluations(viewpoints: Views, most=4):
    count = len(viewpoints.due)
    roadmap = SimpleNamespace(
        nodes=np.arange(count), xy=np.column_stack([3.0 * np.arange(count), np.zeros(count)])
    )
    tree = SimpleNamespace(order=np.arange(count), cost=np.zeros(count))
    made = EvaluationScheduler(ViewpointEvaluationConfig(per_step=most), roadmap, viewpoints)

    def step(deadline: Deadline = UNLIMITED, target=None, *, standing=False):
        viewpoints.done.clear()
        count = made.step(ARRAYS, tree, NOTHING, deadline, target=target, standing=standing)
        assert count == len(viewpoints.done)
        return list(viewpoints.done)

    return made, tree, step


def test_the_highest_priorities_come_first_and_the_oldest_evaluation_last():
    viewpoints = Views()
    viewpoints.evaluated[:] = [5, 4, 3, 0, 6, 7, 8, 9]
    assert evaluations(viewpoints)[2]() == [7, 6, 5, 3]


def test_the_target_comes_before_all_others():
    assert evaluations(Views())[2](target=2)[0] == 2


def test_only_a_target_that_was_reached_is_stale_without_a_change():
    *_, step = evaluations(Views(due=()))
    assert step() == step(target=2) == []
    assert step(target=2, standing=True) == [2]


def test_one_is_evaluated_after_the_deadline_and_the_oldest_is_next():
    viewpoints = Views()
    *_, step = evaluations(viewpoints)
    viewpoints.evaluated[0] = -5
    viewpoints.gain[0] = -1e9
    assert step(late()) == [7]
    assert step(late()) == [0]
    assert step(late()) == [7]


@pytest.mark.parametrize(("potential", "left"), [(2.0, True), (1.0, False)])
def test_a_stale_viewpoint_with_little_potential_is_not_worth_evaluating(potential, left):
    viewpoints = Views(due=(3,))
    viewpoints.potential[3] = potential
    viewpoints.potential[4] = 9.0
    made, tree, _ = evaluations(viewpoints)
    assert made.any_worth_evaluating(ARRAYS, tree, 1.5) is left
    viewpoints.evaluated[3] = -1
    assert made.any_worth_evaluating(ARRAYS, tree, 1.5), "it was never evaluated"


def test_what_was_evaluated_for_another_goal_may_have_any_gain_for_this_one():
    viewpoints = Views(due=(2, 3, 4))
    made, tree, step = evaluations(viewpoints, most=2)
    viewpoints.gain[:] = 0.0
    viewpoints.gain[2] = 1.0
    viewpoints.evaluated[:] = 7
    assert step()[0] == 2
    assert not made.any_worth_evaluating(ARRAYS, tree, 1.5)
    viewpoints.for_other_goal[4] = True
    assert made.any_worth_evaluating(ARRAYS, tree, 1.5)
    assert step()[0] == 4, "an explored place may show the other object"
    viewpoints.for_other_goal[[0, 4]] = True, False
    assert not made.any_worth_evaluating(ARRAYS, tree, 1.5), "nothing has changed in view of it"


def test_an_evaluation_schedule_that_stops_is_refused():
    with pytest.raises(ValueError, match="per_step must be at least 2"):
        ViewpointEvaluationConfig(per_step=1)
    with pytest.raises(ValueError, match="arrival_s must be above 0"):
        ViewpointEvaluationConfig(arrival_s=0.0)

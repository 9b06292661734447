"""Which viewpoints are evaluated in a step."""

from types import SimpleNamespace

import numpy as np
import pytest

from ippon.planning.deadline import UNLIMITED, Deadline
from ippon.planning.visibility.evaluation_schedule import Evaluations
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
        self.done: list[int] = []

    def stale(self, nodes, xy, voxel_size):
        return self.due[nodes]

    def evaluate(self, node, at, arrays):
        np.testing.assert_array_equal(at, [3.0 * node, 0.0])
        self.done.append(node)
        self.evaluated[node] = 100


def evaluations(views: Views, most=4):
    count = len(views.due)
    road = SimpleNamespace(
        nodes=np.arange(count), xy=np.column_stack([3.0 * np.arange(count), np.zeros(count)])
    )
    tree = SimpleNamespace(order=np.arange(count), cost=np.zeros(count))
    made = Evaluations(most, road, views)

    def step(deadline: Deadline = UNLIMITED, target=None, *, standing=False):
        views.done.clear()
        count = made.step(ARRAYS, tree, NOTHING, deadline, target=target, standing=standing)
        assert count == len(views.done)
        return list(views.done)

    return made, tree, step


def test_the_most_promising_ones_come_first_and_whoever_waited_longest_last():
    views = Views()
    views.evaluated[:] = [5, 4, 3, 0, 6, 7, 8, 9]
    assert evaluations(views)[2]() == [7, 6, 5, 3]


def test_the_target_comes_before_all_others():
    assert evaluations(Views())[2](target=2)[0] == 2


def test_nothing_is_due_where_nothing_changed_but_a_target_that_was_looked_at():
    *_, step = evaluations(Views(due=()))
    assert step() == step(target=2) == []
    assert step(target=2, standing=True) == [2]


def test_one_is_evaluated_however_late_it_is_and_whoever_waited_longest_is_next():
    views = Views()
    *_, step = evaluations(views)
    views.evaluated[0] = -5
    views.gain[0] = -1e9
    assert step(late()) == [7]
    assert step(late()) == [0]
    assert step(late()) == [7]


@pytest.mark.parametrize(("potential", "left"), [(2.0, True), (1.0, False)])
def test_what_showed_too_little_before_it_changed_is_not_waited_for(potential, left):
    views = Views(due=(3,))
    views.potential[3] = potential
    views.potential[4] = 9.0
    made, tree, _ = evaluations(views)
    assert made.promising_left(ARRAYS, tree, 1.5) is left
    views.evaluated[3] = -1
    assert made.promising_left(ARRAYS, tree, 1.5), "it was never evaluated"

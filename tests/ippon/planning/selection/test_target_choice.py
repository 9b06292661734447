"""The target: chosen, held on to, given up."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from ippon.planning.deadline import UNLIMITED
from ippon.planning.roadmap.shortest_tree import ShortestTree
from ippon.planning.selection.look_target import Look
from ippon.planning.selection.node_selection import SelectionConfig
from ippon.planning.selection.target_choice import TargetChoice
from tests.ippon.planning.joined import late

ARRAYS = SimpleNamespace(voxel_size=0.1)
TREE = ShortestTree(
    cost=np.array([2.0, 2.0, 2.0]),
    parent=np.full(3, -1),
    via=np.zeros(3, dtype=np.int64),
    heading=np.zeros(3),
    order=np.arange(3),
)
HERE = (0.0, 0.0)


class Views:
    """What three viewpoints show, and what evaluating them anew would say."""

    def __init__(self, gain, anew=None):
        self.gain = np.array(gain, dtype=np.float32)
        self.anew = dict(anew or {})
        self.evaluated: list[int] = []
        self.far_evidence_nat: tuple[float, bool] = (0.0, False)
        self.yaw = np.zeros(3)
        self.termination = np.zeros(3, dtype=np.float32)

    @property
    def potential(self):
        return self.gain

    @property
    def by_heading(self):
        return np.tile(self.gain[:, None], (1, 4))

    def stale(self, nodes, xy, voxel_size):
        return np.isin(nodes, list(self.anew))

    def evaluate(self, node, at, arrays):
        self.gain[node] = self.anew.pop(node)
        self.evaluated.append(node)

    def far_evidence_at(self, node):
        return self.far_evidence_nat

    def frames_object(self, node):
        return math.pi, 0.0


def choice_among(views) -> TargetChoice:
    road = SimpleNamespace(xy=np.array([(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0)]))
    return TargetChoice(SelectionConfig(), road, views, 1.0)


def choose(choice, deadline=UNLIMITED):
    return choice.choose(ARRAYS, TREE, 4.0, deadline)


def test_one_whose_surroundings_changed_is_looked_at_again_before_it_is_chosen():
    views = Views([9.0, 8.0, 7.0], {0: 2.0, 2: 30.0})
    assert choose(choice_among(views))[0] == 1
    assert views.evaluated == [0], "the others are not"


def test_no_more_than_four_are_looked_at_again():
    views = Views([9.0, 8.0, 7.0])
    views.stale = lambda nodes, *_: np.ones(len(nodes), np.bool_)
    views.evaluate = lambda node, *_: views.evaluated.append(node)
    assert choose(choice_among(views))[0] == 0
    assert views.evaluated == [0] * 4


def test_one_that_there_is_no_time_for_is_chosen_as_it_was():
    views = Views([9.0, 8.0, 7.0], {0: 2.0})
    deadline = late()
    assert choose(choice_among(views), deadline)[0] == 0
    assert deadline.cut_short
    assert views.evaluated == []


def test_none_is_chosen_where_none_is_worth_it():
    assert choose(choice_among(Views([0.1, 0.1, 0.1])))[0] is None


def settled(views, node=0, look=None) -> TargetChoice:
    choice = choice_among(views)
    choice.settle(node, choose(choice)[1], look, HERE)
    choice.path = np.zeros((2, 2))
    return choice


def test_the_target_is_what_was_chosen_unless_something_is_looked_at_closer():
    look = Look(node=2, yaw_rad=0.0, tilt_rad=0.0)
    assert settled(Views([9.0, 8.0, 7.0])).node == 0
    assert settled(Views([9.0, 8.0, 7.0]), look=look).node == 2


def test_a_target_is_held_as_long_as_its_way_keeps_its_promise():
    views = Views([9.0, 8.0, 7.0])
    choice = settled(views)
    views.gain[:] = [9.0, 11.0, 7.0]
    assert choose(choice)[0] == 0, "hardly better"
    views.gain[:] = [2.0, 3.0, 2.0]
    assert choose(choice)[0] == 1, "little of the promise is left"
    views.far_evidence_nat = (0.5, False)
    assert choose(choice)[0] == 0, "but images show something there"
    views.far_evidence_nat = (0.0, True)
    assert choose(choice)[0] == 0


def test_a_removed_target_is_none_and_so_is_every_one_after_a_reset():
    choice = settled(Views([9.0, 8.0, 7.0]))
    choice.forget(1)
    assert choice.node == 0
    assert choice.path is not None
    choice.forget(0)
    assert (choice.node, choice.path) == (None, None)
    choice = settled(Views([9.0, 8.0, 7.0]))
    choice.reset()
    assert (choice.node, choice.path) == (None, None)


def test_the_robot_stands_at_its_target_within_a_hands_breadth_or_two():
    choice = settled(Views([9.0, 8.0, 7.0]))
    np.testing.assert_array_equal(choice.standing_at(0.85, 0.1), [1.0, 0.0])
    assert choice.standing_at(0.75, 0.0) is None
    choice.reset()
    assert choice.standing_at(1.0, 0.0) is None


def test_who_ends_the_search_faces_the_object():
    views = Views([9.0, 8.0, 7.0])
    views.termination[1] = 9.0
    node, scores = choose(choice_among(views))
    assert node == 1
    assert scores.path_cost.tolist() == pytest.approx([2.0, 2.0 + math.pi, 2.0])

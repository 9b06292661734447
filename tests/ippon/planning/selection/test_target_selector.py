"""Selection of the target with hysteresis."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from ippon.planning.deadline import UNLIMITED
from ippon.planning.roadmap.shortest_tree import ShortestTree
from ippon.planning.selection.look_target import LookTarget
from ippon.planning.selection.node_selection import SelectionConfig
from ippon.planning.selection.target_selector import TargetSelector
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

    def framing(self, node):
        return math.pi, 0.0


def choice_among(viewpoints) -> TargetSelector:
    roadmap = SimpleNamespace(xy=np.array([(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0)]))
    return TargetSelector(SelectionConfig(), roadmap, viewpoints, 1.0)


def choose(choice, deadline=UNLIMITED):
    return choice.choose(ARRAYS, TREE, 4.0, deadline)


def test_a_stale_node_is_evaluated_again_before_it_is_selected():
    viewpoints = Views([9.0, 8.0, 7.0], {0: 2.0, 2: 30.0})
    assert choose(choice_among(viewpoints))[0] == 1
    assert viewpoints.evaluated == [0], "the others are not"


def test_no_more_than_four_stale_nodes_are_evaluated_again():
    viewpoints = Views([9.0, 8.0, 7.0])
    viewpoints.stale = lambda nodes, *_: np.ones(len(nodes), np.bool_)
    viewpoints.evaluate = lambda node, *_: viewpoints.evaluated.append(node)
    assert choose(choice_among(viewpoints))[0] == 0
    assert viewpoints.evaluated == [0] * 4


def test_a_stale_node_is_selected_as_it_was_after_the_deadline():
    viewpoints = Views([9.0, 8.0, 7.0], {0: 2.0})
    deadline = late()
    assert choose(choice_among(viewpoints), deadline)[0] == 0
    assert deadline.cut_short
    assert viewpoints.evaluated == []


def test_no_node_is_selected_without_enough_gain():
    assert choose(choice_among(Views([0.1, 0.1, 0.1])))[0] is None


def settled(viewpoints, node=0, look=None) -> TargetSelector:
    choice = choice_among(viewpoints)
    choice.set_target(node, choose(choice)[1], look, HERE)
    choice.path = np.zeros((2, 2))
    return choice


def test_a_closer_look_replaces_the_selected_node():
    look = LookTarget(node=2, yaw_rad=0.0, tilt_rad=0.0)
    assert settled(Views([9.0, 8.0, 7.0])).node == 0
    assert settled(Views([9.0, 8.0, 7.0]), look=look).node == 2


def test_a_target_is_kept_while_the_gain_of_its_path_is_left():
    viewpoints = Views([9.0, 8.0, 7.0])
    choice = settled(viewpoints)
    viewpoints.gain[:] = [9.0, 11.0, 7.0]
    assert choose(choice)[0] == 0, "hardly better"
    viewpoints.gain[:] = [2.0, 3.0, 2.0]
    assert choose(choice)[0] == 1, "little of the promise is left"
    viewpoints.far_evidence_nat = (0.5, False)
    assert choose(choice)[0] == 0, "but images show something there"
    viewpoints.far_evidence_nat = (0.0, True)
    assert choose(choice)[0] == 0


def test_a_removed_target_and_a_reset_leave_no_target():
    choice = settled(Views([9.0, 8.0, 7.0]))
    choice.forget(1)
    assert choice.node == 0
    assert choice.path is not None
    choice.forget(0)
    assert (choice.node, choice.path) == (None, None)


def test_a_new_node_with_the_number_of_a_removed_target_is_no_return():
    viewpoints = Views([9.0, 8.0, 7.0])
    choice = settled(viewpoints)
    choice.set_target(1, choose(choice)[1], None, HERE)
    choice.forget(0)
    choice.set_target(0, choose(choice)[1], None, HERE)
    assert choice._returns.count == 0
    choice.set_target(1, choose(choice)[1], None, HERE)
    assert choice._returns.count == 1


def test_a_reset_leaves_no_target():
    choice = settled(Views([9.0, 8.0, 7.0]))
    choice.reset()
    assert (choice.node, choice.path) == (None, None)


def test_the_robot_has_reached_its_target_within_20_cm():
    choice = settled(Views([9.0, 8.0, 7.0]))
    np.testing.assert_array_equal(choice.standing_at(0.85, 0.1), [1.0, 0.0])
    assert choice.standing_at(0.75, 0.0) is None
    choice.reset()
    assert choice.standing_at(1.0, 0.0) is None


def test_a_node_that_ends_the_search_faces_the_object():
    viewpoints = Views([9.0, 8.0, 7.0])
    viewpoints.termination[1] = 9.0
    node, scores = choose(choice_among(viewpoints))
    assert node == 1
    assert scores.path_cost.tolist() == pytest.approx([2.0, 2.0 + math.pi, 2.0])

"""Straight ways for a long body through what it cannot turn in."""

import math
from itertools import pairwise

import numpy as np
import pytest

from ippon.geometry import base_pose
from ippon.planning.clearance import can_stand, move_between, straight_move
from ippon.planning.config import PlannerConfig
from ippon.planning.gates import find_gates
from ippon.planning.planner import ViewpointPlanner
from ippon.planning.sampling import PASSED, STANDABLE, reachable_cells
from ippon.planning.traversability import Traversability, TraversabilityConfig
from ippon.robot import ZED
from tests.long_robot import LONG

MARGIN_M = 0.02


def floor_of(volume, robot=LONG, at=(1.8, 2.8)):
    floor = Traversability(TraversabilityConfig(), robot)
    floor.update(volume.arrays(), base_pose(*at, 0.0, 0.0))
    reachable = reachable_cells(floor.grid, floor.limits, *at, MARGIN_M, 0.05)
    return floor, reachable


@pytest.mark.parametrize("door_m", [0.65, 0.7, 0.8])
def test_a_door_narrower_than_the_body_is_long_is_passed_straight(two_rooms, door_m):
    floor, reachable = floor_of(two_rooms(door_m))
    gates = [g for g in find_gates(floor.grid, floor.limits, reachable, MARGIN_M) if len(g) == 2]
    assert gates
    for ends in gates:
        left, right = sorted(ends.tolist())
        assert left[0] < 3.9 < right[0], "from one room to the other"
        for end in ends:
            assert can_stand(floor.grid, floor.limits, end, MARGIN_M), "it turns there"
        assert move_between(floor.grid, floor.limits, ends[0], ends[1], MARGIN_M)[0]
        assert abs(right[1] - left[1]) < 0.3 * (right[0] - left[0]), "along the door's axis"


def test_what_is_narrower_than_the_body_is_no_gate(two_rooms):
    floor, reachable = floor_of(two_rooms(0.4))
    assert (reachable[40:] == 0).all(), "the flood does not get through either"
    assert find_gates(floor.grid, floor.limits, reachable, MARGIN_M) == []


def test_a_round_body_needs_none(two_rooms):
    floor, reachable = floor_of(two_rooms(0.8), ZED)
    assert find_gates(floor.grid, floor.limits, reachable, MARGIN_M) == []


def test_one_region_has_no_gates(dense_map):
    floor, reachable = floor_of(dense_map().room((0.8, 0.8), (5.6, 5.6)))
    assert (reachable == STANDABLE).any()
    assert (reachable == PASSED).any()
    assert find_gates(floor.grid, floor.limits, reachable, MARGIN_M) == []


def test_the_planner_leads_a_long_body_through_a_door(two_rooms):
    volume = two_rooms(0.75)
    planner = ViewpointPlanner(PlannerConfig(), LONG, 3)
    planner.set_goal(
        probabilities=np.array([0.02, 0.1, 0.25, 0.6], dtype=np.float32), termination_min=5.0
    )
    pose = base_pose(1.8, 2.8, 0.0, 0.3)
    for _ in range(12):
        plan = planner.step(volume.arrays(), pose, 0.0)
    way = planner.way_to(pose, np.array([5.0, 2.8]))
    assert way is not None
    assert plan.tree.positions_world[:, 0].max() > 4.2, "viewpoints in the other room"
    floor = Traversability(TraversabilityConfig(), LONG)
    floor.update(volume.arrays(), pose)
    yaw = 0.3
    for a, b in pairwise(way):
        heading = math.atan2(*(b - a)[::-1])
        assert floor.can_turn(a, yaw, heading, 0.0, math.inf)
        assert straight_move(floor.grid, floor.limits, *a, *b, 0.0, math.inf)[0]
        yaw = heading


def test_a_circle_that_holds_it_does_not_fit(two_rooms):
    floor, _ = floor_of(two_rooms(0.75))
    door = np.array([3.95, 2.7])
    assert not can_stand(floor.grid, floor.limits, door, 0.0)
    assert not floor.can_turn(door, 0.0, math.pi, 0.0, math.inf)
    assert floor.can_turn(door, 0.0, 0.05, 0.0, math.inf)

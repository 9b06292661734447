"""Straight passages for a long body where it cannot turn."""

import math
from itertools import pairwise

import numpy as np
import pytest

from ippon.geometry import base_pose
from ippon.mapping.arrays import FREE, OCCUPIED
from ippon.planning.config import PlannerConfig
from ippon.planning.planner import ViewpointPlanner
from ippon.planning.roadmap.narrow_passages import (
    NarrowPassageConfig,
    _passage_kernel,
    _spread,
    find_narrow_passages,
)
from ippon.planning.terrain.floor_grid import OBSTACLE, OPEN, cell_centres
from ippon.planning.terrain.motion_check import can_stand, move_between, straight_move
from ippon.planning.terrain.reachability import PASSED, STANDABLE, reachable_cells
from ippon.planning.terrain.traversability import Traversability, TraversabilityConfig
from ippon.robot import ZED
from tests.ippon.planning.terrain.test_body_limits import limits as limits_of_robot
from tests.ippon.planning.terrain.test_clearance import make_grid
from tests.long_robot import LONG
from tests.reference import planning_floor as reference

MARGIN_M = 0.02
CONFIG = NarrowPassageConfig()
LIMITS = limits_of_robot(LONG)


def floor_of(volume, robot=LONG, at=(1.8, 2.8)):
    floor = Traversability(TraversabilityConfig(), robot)
    floor.update(volume.arrays(), base_pose(*at, 0.0, 0.0))
    reachable = reachable_cells(floor.grid, floor.limits, *at, MARGIN_M, 0.05)
    return floor, reachable


@pytest.mark.parametrize("door_m", [0.65, 0.7, 0.8])
def test_a_door_narrower_than_the_body_is_long_is_passed_straight(two_rooms, door_m):
    floor, reachable = floor_of(two_rooms(door_m))
    passages = find_narrow_passages(CONFIG, floor.grid, floor.limits, reachable, MARGIN_M)
    assert passages
    for ends in passages:
        left, right = sorted(ends.tolist())
        assert left[0] < 3.9 < right[0], "from one room to the other"
        for end in ends:
            assert can_stand(floor.grid, floor.limits, end, MARGIN_M), "it turns there"
        assert move_between(floor.grid, floor.limits, ends[0], ends[1], MARGIN_M)[0]
        assert abs(right[1] - left[1]) < 0.3 * (right[0] - left[0]), "along the door's axis"


def test_what_is_narrower_than_the_body_is_no_gate(two_rooms):
    floor, reachable = floor_of(two_rooms(0.4))
    assert (reachable[40:] == 0).all(), "the flood does not get through either"
    assert find_narrow_passages(CONFIG, floor.grid, floor.limits, reachable, MARGIN_M) == []


def test_a_door_between_rooms_one_behind_the_other_is_one_too(dense_map):
    volume = dense_map((5.6, 8.0, 2.4)).room((0.8, 0.8), (4.8, 3.8)).room((0.8, 3.9), (4.8, 6.9))
    volume.fill((2.5, 3.8, 0.0), (3.2, 3.9, 2.0), FREE)
    floor, reachable = floor_of(volume, at=(2.8, 1.8))
    passages = find_narrow_passages(CONFIG, floor.grid, floor.limits, reachable, MARGIN_M)
    assert passages
    for ends in passages:
        near, far = sorted(ends[:, 1].tolist())
        assert near < 3.9 < far


def test_a_passage_longer_than_a_way_is_none(dense_map):
    volume = dense_map((12.0, 5.6, 2.4)).room((0.8, 0.8), (3.8, 4.8)).room((8.0, 0.8), (11.0, 4.8))
    volume.fill((3.8, 2.3, -0.1), (8.0, 3.3, 2.0), OCCUPIED)
    volume.fill((3.7, 2.45, 0.0), (8.1, 3.15, 2.0), FREE)
    floor, reachable = floor_of(volume)
    assert (reachable[90:] == STANDABLE).any(), "the flood leads through"
    assert find_narrow_passages(CONFIG, floor.grid, floor.limits, reachable, MARGIN_M) == []


@pytest.mark.parametrize("seed", range(4))
def test_the_roomiest_way_is_found_as_by_trying_all(seed):
    rng = np.random.default_rng(seed)
    kind = np.full((60, 50), OPEN, dtype=np.uint8)
    kind[30:32] = OBSTACLE
    middle = int(rng.integers(15, 35))
    kind[30:32, middle - 4 : middle + 4] = OPEN
    kind[rng.random(kind.shape) < 0.002] = OBSTACLE
    grid = make_grid(kind, origin=(-7, 5))
    for x, y in cell_centres(grid, np.array([(30, middle), (31, middle - 1), (20, 10)])):
        ends = np.zeros((2, 2))
        found = _passage_kernel(
            grid, LIMITS, x, y, MARGIN_M, CONFIG.headings, CONFIG.max_length_m, ends
        )
        expected = reference.narrow_passage(grid, LIMITS, x, y, MARGIN_M)
        assert found == (expected is not None)
        if expected is not None:
            # Of two that are as roomy either may be the one.
            crowding = move_between(grid, LIMITS, ends[0], ends[1], MARGIN_M)[2]
            assert crowding == pytest.approx(expected[0], rel=1e-6)


def test_a_few_narrow_places_stand_for_all():
    grid = make_grid(np.full((100, 100), OPEN, dtype=np.uint8))
    cells = np.argwhere(np.ones((100, 100), dtype=np.bool_))
    worth = np.random.default_rng(0).random((100, 100))
    chosen = _spread(CONFIG, cells, worth, grid)
    assert len(chosen) == 12
    apart = np.linalg.norm(chosen[:, None] - chosen[None], axis=2) + 99.0 * np.eye(len(chosen))
    assert apart.min() * grid.voxel_size >= 0.4
    np.testing.assert_array_equal(chosen[0], np.unravel_index(worth.argmax(), worth.shape))
    assert len(_spread(CONFIG, cells[:3], worth, grid)) == 1, "those lie side by side"
    assert _spread(CONFIG, cells[:0], worth, grid).shape == (0, 2)


def test_a_round_body_needs_none(two_rooms):
    floor, reachable = floor_of(two_rooms(0.8), ZED)
    assert find_narrow_passages(CONFIG, floor.grid, floor.limits, reachable, MARGIN_M) == []


def test_one_region_has_no_gates(dense_map):
    floor, reachable = floor_of(dense_map().room((0.8, 0.8), (5.6, 5.6)))
    assert (reachable == STANDABLE).any()
    assert (reachable == PASSED).any()
    assert find_narrow_passages(CONFIG, floor.grid, floor.limits, reachable, MARGIN_M) == []


def test_the_planner_leads_a_long_body_through_a_door(two_rooms):
    volume = two_rooms(0.75)
    planner = ViewpointPlanner(PlannerConfig(), LONG, 3)
    planner.set_goal(
        probabilities=np.array([0.02, 0.1, 0.25, 0.6], dtype=np.float32), termination_min=5.0
    )
    pose = base_pose(1.8, 2.8, 0.0, 0.3)
    for _ in range(12):
        plan = planner.step(volume.arrays(), pose, 0.0)
    way = planner.path_to_point(pose, np.array([5.0, 2.8]))
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


def test_a_search_that_finds_nothing_is_refused():
    with pytest.raises(ValueError, match="max_length_m above 0; got 24, 12, 5"):
        NarrowPassageConfig(max_length_m=0.0)

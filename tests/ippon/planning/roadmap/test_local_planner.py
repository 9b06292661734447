"""OMPL between two viewpoints: round corners, deterministic, bounded."""

import gc
import math
import weakref
from itertools import pairwise

import numpy as np
import pytest

from ippon.planning.deadline import Deadline
from ippon.planning.roadmap import local_planner as local_planner_module
from ippon.planning.roadmap.local_planner import LocalPlanner, LocalPlannerConfig, LocalQuery
from ippon.planning.terrain.clearance import clearance_at
from ippon.planning.terrain.floor_grid import OBSTACLE, OPEN
from ippon.planning.terrain.motion_check import move_between
from tests.ippon.planning.joined import Joined, late
from tests.ippon.planning.terrain.test_clearance import LIMITS, make_grid
from tests.ippon.planning.test_deadline import Clock

CORNER_NEAR, CORNER_FAR = np.array([3.45, 1.35]), np.array([4.75, 3.35])
START, GOAL = np.array([0.65, 3.05]), np.array([3.05, 0.65])


def l_corridor(width: int = 10):
    """A corridor along x, then along y, `width` cells wide."""
    kind = np.full((42, 42), OBSTACLE)
    kind[2:40, 40 - width - 6 : 40 - 6] = OPEN
    kind[40 - width - 6 : 40 - 6, 2:36] = OPEN
    return make_grid(kind)


def query(grid, seed=1, start=START, goal=GOAL, **config):
    return LocalQuery(
        LocalPlannerConfig(**config), grid, LIMITS, start, goal, margin=0.0, seed=seed
    )


def plan(grid, seed=1, start=START, goal=GOAL, **config):
    asked = query(grid, seed, start, goal, **config)
    assert asked.solve(grid), "without a deadline the answer is there at once"
    return asked.path()


def divided():
    """Two halves that no way joins."""
    kind = np.full((42, 42), OPEN)
    kind[20, :] = OBSTACLE
    return make_grid(kind), {"start": np.array([1.0, 2.0]), "goal": np.array([3.0, 2.0])}


def test_a_way_round_the_corner_where_the_line_is_blocked():
    grid = l_corridor()
    assert not move_between(grid, LIMITS, START, GOAL, 0.0)[0]
    path = plan(grid)
    assert path is not None
    np.testing.assert_allclose(path[0], START)
    np.testing.assert_allclose(path[-1], GOAL)
    for a, b in pairwise(path):
        assert move_between(grid, LIMITS, a, b, 0.0)[0]


def test_the_same_seed_gives_the_same_way_whatever_came_before():
    grid = l_corridor()
    first = plan(grid, seed=7)
    plan(grid, seed=3)
    np.testing.assert_array_equal(first, plan(grid, seed=7))
    assert not np.array_equal(first, plan(grid, seed=8))


@pytest.mark.slow
def test_soft_clearance_keeps_to_the_middle():
    grid = l_corridor(14)

    def least_room(path):
        steps = [a + t * (b - a) for a, b in pairwise(path) for t in np.linspace(0, 1, 20)]
        return np.mean([min(0.6, clearance_at(grid, *p)) for p in steps])

    rooms = {
        weight: np.mean(
            [
                least_room(plan(grid, seed, clearance_weight=weight, iterations=800))
                for seed in range(1, 5)
            ]
        )
        for weight in (0.0, 0.6)
    }
    assert rooms[0.6] > rooms[0.0]


def test_hard_clearance_forbids_what_soft_allows():
    narrow = l_corridor(7)
    assert plan(narrow) is not None
    assert plan(narrow, clearance="hard", hard_margin_m=0.15) is None


def test_ends_inside_an_obstacle_are_refused_at_once():
    grid = l_corridor()
    assert plan(grid, goal=np.array([0.65, 0.65])) is None
    assert plan(grid, start=np.array([9.0, 9.0])) is None


def test_without_a_way_the_budget_ends_the_search():
    grid, ends = divided()
    assert plan(grid, **ends) is None


def solved_in_pieces(asked, grid):
    """Look on with a deadline that has passed; returns how often that took."""
    for count in range(1, 100):
        if asked.solve(grid, Deadline(1.0, Clock(jump_s=10.0))):
            return count
    raise AssertionError


def test_a_query_that_ran_out_of_time_goes_on_where_it_was():
    grid = l_corridor()
    asked = query(grid)
    assert not asked.solve(grid, Deadline(1.0, Clock(jump_s=10.0)))
    assert asked.path() is None
    solved_in_pieces(asked, grid)
    path = asked.path()
    np.testing.assert_allclose(path[[0, -1]], [START, GOAL])
    for a, b in pairwise(path):
        assert move_between(grid, LIMITS, a, b, 0.0)[0]


def test_a_query_without_a_path_ends_after_the_same_iterations_with_a_clock():
    grid, ends = divided()
    asked = query(grid, **ends)
    pieces = solved_in_pieces(asked, grid)
    assert asked.path() is None
    assert pieces == math.ceil(
        LocalPlannerConfig().iterations / (LocalPlannerConfig().min_iterations_per_step + 1)
    )


def test_a_query_that_has_time_gives_the_way_that_it_gives_without_a_clock():
    grid = l_corridor()
    asked = query(grid, seed=5)
    assert asked.solve(grid, Deadline(1.0, Clock()))
    np.testing.assert_array_equal(asked.path(), plan(grid, seed=5))


@pytest.mark.slow
def test_what_was_not_finished_leaves_nothing_behind():
    grid = l_corridor()
    asked = query(grid)
    asked.solve(grid, Deadline(1.0, Clock(jump_s=10.0)))
    floor = weakref.ref(asked._space)
    del asked
    gc.collect()
    assert floor() is None


def test_a_budget_that_finds_nothing_is_refused():
    with pytest.raises(ValueError, match="iterations must be at least 10"):
        LocalPlannerConfig(iterations=3)
    assert math.isfinite(LocalPlannerConfig().clearance_weight)


def test_a_path_leads_from_one_point_to_the_other(corner):
    queries = Joined(corner).local_planner
    way = queries.solve(CORNER_NEAR, CORNER_FAR)
    assert way is not None
    np.testing.assert_array_equal(way[[0, -1]], [CORNER_NEAR, CORNER_FAR])
    assert not queries.unfinished


def test_there_is_no_path_where_the_local_planner_is_off(corner):
    queries = Joined(corner, enabled=False).local_planner
    assert queries.solve(CORNER_NEAR, CORNER_FAR) is None
    assert (queries.begun, queries.unfinished) == (0, False)


def test_what_was_cut_short_goes_on_unless_another_way_is_asked_for(corner):
    joined = Joined(corner)
    queries = joined.local_planner
    assert queries.solve(CORNER_NEAR, CORNER_FAR, late()) is None
    assert queries.unfinished
    queries.solve(CORNER_NEAR, CORNER_FAR, late())
    assert queries.begun == 1
    queries.solve(CORNER_FAR, CORNER_NEAR, late())
    assert queries.begun == 2
    joined.floor.relax()
    queries.solve(CORNER_FAR, CORNER_NEAR, late())
    assert queries.begun == 3, "narrower gaps may be passed now"


def test_each_query_has_a_seed_of_its_own(corner, monkeypatch):
    seeds = []

    class Noted(LocalQuery):
        def __init__(self, *args, seed, **rest):
            seeds.append(seed)
            super().__init__(*args, seed=seed, **rest)

    monkeypatch.setattr(local_planner_module, "LocalQuery", Noted)
    queries = Joined(corner).local_planner
    for _ in range(3):
        queries.solve(CORNER_NEAR, CORNER_FAR)
    assert seeds == [seeds[0], seeds[0] + 1, seeds[0] + 2]
    assert seeds[0] > 0


@pytest.mark.parametrize("changes", [0, 4])
def test_what_failed_may_be_tried_again_after_the_floor_has_changed(corner, changes):
    queries = LocalPlanner(LocalPlannerConfig(), Joined(corner).floor, 1)
    for _ in range(changes):
        queries.note_floor_change()
    for _ in range(LocalPlannerConfig().retry_after_changes):
        assert not queries.may_retry(changes)
        queries.note_floor_change()
    assert queries.may_retry(changes)

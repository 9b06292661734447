"""Queries to the local planner, one after another."""

import numpy as np
import pytest

from ippon.planning.roadmap import local_queries as local_queries_module
from ippon.planning.roadmap.local_planner import LocalPlannerConfig, LocalQuery
from ippon.planning.roadmap.local_queries import RETRY_STEPS, LocalQueries
from tests.ippon.planning.joined import Joined, late

NEAR, FAR = np.array([3.45, 1.35]), np.array([4.75, 3.35])


def test_a_way_leads_from_one_point_to_the_other(corner):
    queries = Joined(corner).queries
    way = queries.solve(NEAR, FAR)
    assert way is not None
    np.testing.assert_array_equal(way[[0, -1]], [NEAR, FAR])
    assert not queries.unfinished


def test_there_is_none_where_the_local_planner_is_off(corner):
    queries = Joined(corner, enabled=False).queries
    assert queries.solve(NEAR, FAR) is None
    assert (queries.begun, queries.unfinished) == (0, False)


def test_what_was_cut_short_goes_on_unless_another_way_is_asked_for(corner):
    queries = Joined(corner).queries
    assert queries.solve(NEAR, FAR, late()) is None
    assert queries.unfinished
    queries.solve(NEAR, FAR, late())
    assert queries.begun == 1
    queries.solve(FAR, NEAR, late())
    assert queries.begun == 2


def test_each_query_has_a_seed_of_its_own(corner, monkeypatch):
    seeds = []

    class Noted(LocalQuery):
        def __init__(self, *args, seed, **rest):
            seeds.append(seed)
            super().__init__(*args, seed=seed, **rest)

    monkeypatch.setattr(local_queries_module, "LocalQuery", Noted)
    queries = Joined(corner).queries
    for _ in range(3):
        queries.solve(NEAR, FAR)
    assert seeds == [seeds[0], seeds[0] + 1, seeds[0] + 2]
    assert seeds[0] > 0


@pytest.mark.parametrize("changes", [0, 4])
def test_what_failed_may_be_tried_again_after_the_floor_has_changed(corner, changes):
    queries = LocalQueries(LocalPlannerConfig(), Joined(corner).floor, 1)
    for _ in range(changes):
        queries.note_floor_change()
    for _ in range(RETRY_STEPS):
        assert not queries.may_retry(changes)
        queries.note_floor_change()
    assert queries.may_retry(changes)

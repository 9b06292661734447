"""Detours over unseen floor to an object; whole searches are in tests/ippon/mission."""

from types import SimpleNamespace

import numpy as np
import pytest

from ippon.planning.roadmap.sampling import mark_discs
from ippon.planning.selection import out_of_reach as out_of_reach_module
from ippon.planning.selection.closer_look import CloserLookConfig, CloserLookSelector
from ippon.planning.selection.detours import (
    DetourConfig,
    Surroundings,
    farthest_point_sample,
    flood_fill_unseen,
    is_standable,
)
from ippon.planning.selection.look_target import LookConfig
from ippon.planning.selection.out_of_reach import OutOfReach, OutOfReachConfig
from ippon.planning.terrain.body_limits import BodyLimits
from ippon.planning.terrain.floor_grid import OPEN
from ippon.planning.terrain.reachability import PASSED, STANDABLE, reachable_cells
from tests.ippon.planning.terrain.test_clearance import make_grid, random_kind
from tests.reference import planning_floor as reference

LIMITS = BodyLimits(
    radius=0.2, unseen_radius=0.12, slow_clearance=0.25, slow_fraction=0.4, speed=0.8
)


@pytest.mark.parametrize("seed", range(4))
def test_the_flood_over_unseen_floor_agrees_with_a_plain_search(seed):
    grid = make_grid(random_kind(seed, share=0.015), origin=(4, -9))
    rng = np.random.default_rng(seed)
    x, y = (grid.origin + rng.random(2) * grid.kind.shape) * 0.1
    sure = reachable_cells(grid, LIMITS, x, y, 0.02, 0.05)
    blocked = np.zeros_like(sure)
    mark_discs(blocked, grid, np.array([[x + 1.0, y]]), 0.35, 1)
    nothing: dict = {"arrays": None, "geometry": None}
    around = Surroundings(grid=grid, limits=LIMITS, margin_m=0.02, reachable=sure, **nothing)
    steps, parent = flood_fill_unseen(around, blocked, (x, y))
    plain = reference.steps_over_unseen_floor(grid, LIMITS, sure, blocked, x, y, 0.02)
    np.testing.assert_array_equal(steps, plain)
    on_the_way = np.argwhere(parent >= 0)
    before = np.divmod(parent[parent >= 0], grid.kind.shape[1])
    assert (np.abs(on_the_way.T - np.array(before)).sum(axis=0) == 1).all()
    np.testing.assert_array_equal(steps[before] + 1, steps[parent >= 0])


def test_lines_of_sight_go_to_all_parts_of_a_cluster():
    row = np.column_stack([np.arange(11) * 0.1, np.zeros(11), np.zeros(11)])
    assert sorted(farthest_point_sample(row, 3)[:, 0]) == pytest.approx([0.0, 0.5, 1.0])
    assert len(farthest_point_sample(row[:2], 6)) == 2


@pytest.fixture
def stands(monkeypatch):
    """The robot can stand anywhere."""
    monkeypatch.setattr(out_of_reach_module, "is_standable", lambda *_: True)


def test_the_robot_can_stand_where_it_gets_to_and_nowhere_beyond_the_map():
    grid = make_grid(np.full((20, 20), OPEN), origin=(5, -3))
    reachable = np.full((20, 20), STANDABLE, dtype=np.uint8)
    reachable[3, 4] = PASSED
    around = SimpleNamespace(grid=grid, reachable=reachable)
    places = {(0.95, 0.25): True, (0.85, 0.15): False, (0.4, 0.2): False, (1.0, 1.75): False}
    for place, stands in places.items():
        assert is_standable(around, np.array(place)) is stands


def test_a_step_that_was_cut_short_does_not_count_as_one_without_a_detour(monkeypatch, stands):
    place, voxel = np.array([1.0, 1.0]), np.array([2.0, 1.0, 0.5])
    monkeypatch.setattr(out_of_reach_module, "find_detour", lambda *_: None)
    monkeypatch.setattr(out_of_reach_module, "nearest_viewing_position", lambda *_: (place, voxel))
    around = SimpleNamespace(camera_z_m=1.0)
    tree = SimpleNamespace(order=np.array([0]))
    given = (voxel[None], around, tree, place[None], np.eye(4))
    planned = OutOfReach(OutOfReachConfig(), LookConfig(), 0.5)
    for _ in range(50):
        assert planned.choose(*given, enough=4.0, cut_short=True) is None
    looks = [planned.choose(*given, enough=4.0) for _ in range(OutOfReachConfig().sure_steps)]
    assert looks[:-1] == [None] * (len(looks) - 1)
    assert looks[-1].away_m == 1.0


@pytest.mark.parametrize("turn", [15, 40, 400])
@pytest.mark.parametrize("unseen", [None, (1.5, 1.0)])
def test_two_objects_out_of_reach_that_take_turns_are_given_up(monkeypatch, stands, turn, unseen):
    """Of two clusters of one size, now the one and now the other counts as the larger."""
    place = np.array([1.0, 1.0])
    one, other = np.array([[2.0, 1.0, 0.5]]), np.array([[2.0, 3.0, 0.5]])
    config = OutOfReachConfig()
    detours = []
    monkeypatch.setattr(
        out_of_reach_module, "find_detour", lambda *_: detours.append(unseen) or unseen
    )
    monkeypatch.setattr(
        out_of_reach_module, "nearest_viewing_position", lambda *given: (place, given[2][0])
    )
    around = SimpleNamespace(
        camera_z_m=1.0, is_visible=lambda *_: True, grid=SimpleNamespace(voxel_size=0.1)
    )
    tree = SimpleNamespace(order=np.array([0]), cost=np.zeros(1))
    planned = OutOfReach(config, LookConfig(), 0.5)
    far = np.eye(4)  # The robot never arrives.
    looks = [
        planned.choose(
            one if n // turn % 2 == 0 else other, around, tree, place[None], far, enough=0.5
        )
        for n in range(6000)
    ]
    assert any(looks)
    assert not any(looks[4000:])
    assert len(detours) <= 2 * 2 * config.around_steps
    assert sum(look is not None for look in looks) <= 2 * 2 * (
        config.around_steps + config.approach_steps
    )
    planned.reset()
    again = [planned.choose(one, around, tree, place[None], far, enough=0.5) for _ in range(30)]
    assert any(again), "for another goal"


def test_after_an_object_out_of_reach_is_given_up_a_smaller_one_is_tried(monkeypatch, stands):
    place = np.array([1.0, 1.0])
    sizes = {2.0: 60, 6.0: 40}
    voxels = np.concatenate(
        [[(2.0 + 0.1 * (n % 4), y + 0.1 * (n // 4), 0.5) for n in range(size)]
         for y, size in sizes.items()]
    )  # fmt: skip
    monkeypatch.setattr(out_of_reach_module, "find_detour", lambda *_: None)
    monkeypatch.setattr(
        out_of_reach_module, "nearest_viewing_position", lambda *given: (place, given[2][0])
    )
    around = SimpleNamespace(
        camera_z_m=1.0, is_visible=lambda *_: False, grid=SimpleNamespace(voxel_size=0.1)
    )
    tree = SimpleNamespace(order=np.array([0]), cost=np.zeros(1))
    selector = CloserLookSelector(CloserLookConfig(), 0.5)
    monkeypatch.setattr(selector._passing, "choose", lambda *_, **__: None)
    for y, size in sizes.items():
        cluster = voxels[-size:] if y > 4.0 else voxels[:size]
        selector._left.append((cluster.mean(axis=0), size))
    far = np.eye(4)  # The robot never arrives.
    looks = [
        selector.choose(voxels, around, tree, place[None], far, termination_min=9.0)
        for _ in range(1000)
    ]
    looked_at = [round(look.away_m) for look in looks if look is not None]
    most = OutOfReachConfig().approach_steps
    assert looked_at == [1] * most + [5] * most, "the larger one first, each once"
    assert not any(looks[700:])


def test_a_place_that_turns_out_not_to_be_standable_is_chosen_again(monkeypatch):
    places, voxel = np.array([[1.05, 1.05], [1.05, 3.05]]), np.array([2.0, 1.0, 0.5])
    reachable = np.full((40, 40), STANDABLE, dtype=np.uint8)
    monkeypatch.setattr(out_of_reach_module, "find_detour", lambda *_: None)
    monkeypatch.setattr(
        out_of_reach_module,
        "nearest_viewing_position",
        lambda *_: (places[int(reachable[10, 10] != STANDABLE)], voxel),
    )
    grid = SimpleNamespace(voxel_size=0.1, origin=np.zeros(2, np.int64))
    around = SimpleNamespace(camera_z_m=1.0, grid=grid, reachable=reachable)
    tree = SimpleNamespace(order=np.array([0, 1]))
    given = (voxel[None], around, tree, places, np.eye(4))
    planned = OutOfReach(OutOfReachConfig(), LookConfig(), 0.5)
    looks = [planned.choose(*given, enough=4.0) for _ in range(20)]
    assert looks[-1].node == 0
    reachable[10, 10] = PASSED
    assert planned.choose(*given, enough=4.0).node == 1
    np.testing.assert_array_equal(planned.wanted_place(), places[1])


def test_counts_without_meaning_are_refused():
    with pytest.raises(ValueError, match="must be at least 1; got 300, 0, 10, 250"):
        OutOfReachConfig(patience_steps=0)
    with pytest.raises(ValueError, match="reach_m must be above 0"):
        OutOfReachConfig(reach_m=0.0)
    with pytest.raises(ValueError, match="max_places must be at least 1"):
        DetourConfig(max_places=0)

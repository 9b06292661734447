"""Strips of unseen floor before rooms."""

from types import SimpleNamespace

import numpy as np
import pytest

from ippon.planning.deadline import UNLIMITED
from ippon.planning.terrain import unseen_gaps as unseen_gaps_module
from ippon.planning.terrain.body_limits import BodyLimits
from ippon.planning.terrain.floor_grid import OBSTACLE, OPEN, UNSEEN, FloorGrid
from ippon.planning.terrain.reachability import reachable_cells
from ippon.planning.terrain.unseen_gaps import UnseenGapConfig, UnseenGapDetector, find_unseen_gap
from tests.ippon.planning.joined import late
from tests.ippon.planning.terrain.test_clearance import make_grid

LIMITS = BodyLimits(
    radius=0.2, unseen_radius=0.12, slow_clearance=0.25, slow_fraction=0.4, speed=0.8
)
MARGIN_M = 0.02
HERE = (2.05, 1.55)


def two_rooms(gap_m: float = 0.5, door_m: float = 0.9, behind_m: float = 2.0) -> FloorGrid:
    """Two rooms of 4 m along y with a door between them, and unseen floor behind the door."""
    kind = np.full((41, 61), OBSTACLE, np.uint8)
    kind[2:39, 2:24] = OPEN
    half = round(5.0 * door_m)
    kind[20 - half : 20 + half + 1, 24:26] = OPEN
    kind[2:39, 26 : min(59, 26 + round(10.0 * (gap_m + behind_m)))] = OPEN
    kind[2:39, 26 : 26 + round(10.0 * gap_m)] = UNSEEN
    return make_grid(kind, origin=(0, 0))


def gap(grid: FloorGrid, xy: tuple[float, float] = HERE, within_m: float = 1.6):
    reachable = reachable_cells(grid, LIMITS, *xy, MARGIN_M, 0.05)
    assert reachable.any()
    config = UnseenGapConfig(max_distance_m=within_m)
    return find_unseen_gap(config, grid, LIMITS, MARGIN_M, reachable, xy)


@pytest.mark.parametrize("origin", [(0, 0), (-17, 33)])
def test_the_nearest_unseen_floor_before_a_room_is_found(origin):
    grid = two_rooms()
    moved = grid._replace(origin=np.array(origin))
    xy = (HERE[0] + 0.1 * origin[0], HERE[1] + 0.1 * origin[1])
    found = gap(moved, xy)
    assert found is not None
    x, y = found[0] - 0.1 * origin[0], found[1] - 0.1 * origin[1]
    assert x == pytest.approx(2.05, abs=0.15)
    assert y == pytest.approx(2.65, abs=0.06)


@pytest.mark.parametrize(
    "rooms",
    [
        {"gap_m": 0.0},
        {"gap_m": 1.2, "behind_m": 1.5},
        {"door_m": 0.2},
        {"behind_m": 0.2},
    ],
    ids=["nothing unseen", "too wide", "the body does not fit", "hardly a room behind"],
)
def test_no_floor_check_without_unseen_floor(rooms):
    assert gap(two_rooms(**rooms)) is None


def test_only_from_nearby_and_in_sight():
    assert gap(two_rooms(), within_m=0.9) is None
    aside = two_rooms()
    assert gap(aside, (0.65, 2.15), within_m=2.5) is None, "the wall beside the door is before it"


def test_another_way_into_the_room_makes_a_look_unnecessary():
    grid = two_rooms()
    kind = grid.kind.copy()
    kind[4:12, 20:40] = OPEN
    assert gap(make_grid(kind, origin=(0, 0))) is None


def test_what_stands_in_the_gap_closes_it():
    grid = two_rooms()
    kind = grid.kind.copy()
    kind[12:29, 28] = OBSTACLE
    assert gap(make_grid(kind, origin=(0, 0))) is None


def test_a_grid_without_a_reachable_cell_has_none():
    grid = two_rooms()
    nothing = np.zeros(grid.kind.shape, np.uint8)
    assert find_unseen_gap(UnseenGapConfig(), grid, LIMITS, MARGIN_M, nothing, HERE) is None


def watched(grids, deadline=lambda: UNLIMITED):
    """The steps in which a gap is reported while the floor changes from grid to grid."""
    detector, reported = UnseenGapDetector(UnseenGapConfig()), []
    for grid in grids:
        floor = SimpleNamespace(grid=grid, limits=LIMITS, margin_m=MARGIN_M)
        reachable = reachable_cells(grid, LIMITS, *HERE, MARGIN_M, 0.05)
        reported.append(detector.step(floor, reachable, HERE, deadline()))
    return [n + 1 for n, place in enumerate(reported) if place is not None]


def test_a_gap_is_looked_for_in_every_fifth_step_and_must_stay():
    open_, closed = two_rooms(), two_rooms(gap_m=0.0)
    assert watched([open_] * 16) == [10, 15]
    assert watched([open_] * 5 + [closed] * 5 + [open_] * 10) == [20]


def test_a_gap_is_reported_after_it_was_found_twice(monkeypatch):
    places = [(1.0, 1.0), (1.0, 1.7), (3.0, 1.7), (3.0, 1.7), None, (3.0, 1.7)]
    found = iter(places)
    monkeypatch.setattr(unseen_gaps_module, "find_unseen_gap", lambda *_: next(found))
    assert watched([two_rooms()] * 30) == [10, 20]


def test_a_gap_waits_for_another_step_where_time_is_up_but_not_for_ever():
    assert watched([two_rooms()] * 40, late) == [20, 30, 40]


@pytest.mark.parametrize(
    "fields", [{"interval_steps": 0}, {"patience_steps": 4}, {"max_gap_m": 0.0}]
)
def test_intervals_and_gaps_that_find_nothing_are_refused(fields):
    with pytest.raises(ValueError, match="must"):
        UnseenGapConfig(**fields)

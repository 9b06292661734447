"""Where the floor ends near the robot, and the floor that is hidden beside it."""

import numpy as np
import pytest

from ippon.control.drops import drops_around
from ippon.geometry import base_pose
from ippon.planning.terrain.floor_grid import OBSTACLE
from ippon.planning.terrain.traversability import Traversability, TraversabilityConfig
from ippon.robot import ZED

HERE = base_pose(0.0, 0.0, 0.0, 0.0)


def test_a_drop_is_where_the_floor_ends_and_the_column_before(floor_with):
    assert len(drops_around(floor_with(), ZED, HERE, 2.0)[0]) == 0
    found = drops_around(floor_with(holes=[(1.0, -3.0, 4.0, 3.0)]), ZED, HERE, 2.0)[0]
    assert found[:, 0].min() == pytest.approx(0.95)
    assert np.hypot(*found.T).max() <= 2.0
    speck = floor_with(holes=[(1.0, 0.0, 1.1, 0.2)])
    assert len(drops_around(speck, ZED, HERE, 2.0)[0]) == 0, "two columns are holes in the map"


def test_a_robot_that_stands_in_a_drop_believes_none(floor_with):
    arrays = floor_with(holes=[(-1.0, -3.0, 4.0, 3.0)])
    assert len(drops_around(arrays, ZED, HERE, 2.0)[0]) == 0, "the map's height is off"
    for x in (-1.5, -1.09, -1.05, -0.99):
        at_its_edge = base_pose(x, 0.0, 0.0, 0.0)
        assert len(drops_around(arrays, ZED, at_its_edge, 2.0)[0]) > 0


def test_the_planner_avoids_all_drops_at_any_height_of_one_floor(floor_with):
    step, pit = (1.0, -2.0, 1.3, 2.0), (-2.0, -2.0, -1.5, 2.0)
    lower = (1.0, -2.0, -0.4, 1.3, 2.0, -0.05)
    arrays = floor_with(lower, holes=[step, pit], voxel_size=0.05)
    floor = Traversability(TraversabilityConfig(), ZED)
    for z in (0.0, 0.02, 0.035):
        at = base_pose(0.0, 0.0, z, 0.0)
        floor.update(arrays, at)
        obstacles = np.argwhere(floor.grid.kind == OBSTACLE) + floor.grid.origin
        drops, _ = drops_around(arrays, ZED, at, 2.0, floor.floor_z_m)
        found = np.floor(drops / 0.05).astype(int)
        assert {*map(tuple, found.tolist())} <= {*map(tuple, obstacles.tolist())}
        assert len(found) > 0


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("z", [0.0, 0.04])
def test_drops_are_those_that_the_planner_sees(floor_with, seed, z):
    rng = np.random.default_rng(seed)
    corners = rng.random((6, 2)) * 5.0 - 2.5
    holes = [(*low, *(low + 0.1 + rng.random(2))) for low in corners]
    arrays = floor_with(*[(*low, -0.8, *(low + 0.3), 0.0) for low in corners[:2]], holes=holes)
    at = base_pose(*(rng.random(2) - 0.5), z, 0.3)
    floor = Traversability(TraversabilityConfig(), ZED)
    floor.update(arrays, at)
    i, j = np.nonzero(floor.grid.kind == OBSTACLE)
    centres = (np.stack([i, j], axis=1) + floor.grid.origin + 0.5) * 0.1
    inside = np.hypot(*(centres - at[:2, 3]).T) <= 1.6
    found, _ = drops_around(arrays, ZED, at, 1.6)
    expected = {tuple(p) for p in centres[inside].round(3).tolist()}
    assert {tuple(p) for p in found.round(3).tolist()} == expected
    assert len(expected) > 0


def hidden_beside(arrays, at=HERE, radius_m=2.0):
    drops, hidden = drops_around(arrays, ZED, at, radius_m, hidden=True)
    assert drops.tolist() == drops_around(arrays, ZED, at, radius_m)[0].tolist()
    assert len(drops_around(arrays, ZED, at, radius_m)[1]) == 0, "only who asks for it"
    return hidden


def test_unseen_floor_between_a_drop_and_the_seen_floor_is_hidden(floor_with):
    behind = floor_with(holes=[(1.4, -3.0, 4.0, 3.0)], unseen=[(1.0, -3.0, 1.4, 3.0)])
    hidden = hidden_beside(behind)
    assert set(hidden[:, 0].round(3)) == {1.05, 1.15, 1.25}, "the last column is the drop's"
    assert np.hypot(*hidden.T).max() <= 2.0
    assert hidden[:, 1].max() - hidden[:, 1].min() > 3.0


def test_hidden_floor_ends_half_a_metre_from_the_drop(floor_with):
    wide = floor_with(holes=[(1.4, -3.0, 4.0, 3.0)], unseen=[(-3.0, -3.0, 1.4, 3.0)])
    assert hidden_beside(wide)[:, 0].min() == pytest.approx(0.85)


def test_no_floor_is_hidden_without_a_drop_or_behind_seen_floor(floor_with):
    assert len(hidden_beside(floor_with(unseen=[(0.5, -1.0, 1.5, 1.0)]))) == 0
    speck = floor_with(holes=[(1.0, 0.0, 1.1, 0.2)], unseen=[(1.1, -1.0, 1.5, 1.0)])
    assert len(hidden_beside(speck)) == 0, "two columns are holes in the map"
    apart = floor_with(holes=[(1.4, -3.0, 4.0, 3.0)], unseen=[(0.8, -3.0, 1.2, 3.0)])
    assert len(hidden_beside(apart)) == 0


def test_the_floor_under_the_body_is_not_hidden(floor_with):
    blind = floor_with(holes=[(0.4, -3.0, 4.0, 3.0)], unseen=[(-1.0, -3.0, 0.4, 3.0)])
    beyond = np.hypot(*hidden_beside(blind).T)
    assert ZED.radius_m < beyond.min() < ZED.radius_m + 0.1


def test_a_drop_out_of_reach_hides_floor_within_it(floor_with):
    arrays = floor_with(holes=[(1.3, -3.0, 4.0, 3.0)], unseen=[(0.8, -3.0, 1.3, 3.0)])
    hidden = hidden_beside(arrays, radius_m=1.0)
    assert len(hidden) > 0
    assert hidden[:, 0].max() == pytest.approx(0.95)

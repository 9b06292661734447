"""The floor follows the map: holes, drops, unseen start, contacts, growth."""

import dataclasses
import math

import numpy as np
import pytest

from ippon.geometry import base_pose
from ippon.mapping.arrays import FREE, OCCUPIED, UNKNOWN
from ippon.planning.terrain.floor_grid import (
    BEYOND_CUTOFF,
    OBSTACLE,
    OPEN,
    UNSEEN,
    update_nearest_offsets,
)
from ippon.planning.terrain.motion_check import can_stand
from ippon.planning.terrain.traversability import Traversability, TraversabilityConfig
from ippon.robot import ZED, upright_body

POSE = base_pose(2.8, 2.8, 0.0, 0.0)


def kind_at(floor: Traversability, x: float, y: float) -> int:
    i, j = np.floor(np.array([x, y]) / 0.1).astype(int) - floor.grid.origin
    return int(floor.grid.kind[i, j])


def open_floor(dense_map):
    return dense_map().room((0.8, 0.8), (5.6, 5.6))


def test_a_room_is_open_up_to_its_walls(dense_map):
    floor = Traversability(TraversabilityConfig(), ZED)
    floor.update(open_floor(dense_map).arrays(), POSE)
    assert kind_at(floor, 1.05, 2.05) == OPEN
    assert kind_at(floor, 0.75, 2.05) == OBSTACLE
    assert kind_at(floor, 0.35, 2.05) == UNSEEN
    assert floor.clearance(2.85, 1.3) == pytest.approx(0.55)
    assert can_stand(floor.grid, floor.limits, np.array([1.1, 2.8]), 0.0)
    assert not can_stand(floor.grid, floor.limits, np.array([0.95, 2.8]), 0.0)


def test_single_missing_floor_voxels_do_not_matter_but_a_hole_does(dense_map):
    volume = open_floor(dense_map)
    rng = np.random.default_rng(1)
    holes = rng.random(volume.state.shape[:2]) < 0.1
    layer = -1 - volume.origin[2] * 8
    volume.state[:, :, layer][holes] = UNKNOWN
    volume.fill((4.0, 4.0, -0.1), (4.8, 4.8, 0.0), UNKNOWN)
    floor = Traversability(TraversabilityConfig(), ZED)
    floor.update(volume.arrays(), POSE)
    inside = floor.grid.kind[10:38, 10:38]
    assert (inside == OPEN).mean() > 0.98
    assert kind_at(floor, 4.45, 4.45) == UNSEEN


def test_a_drop_is_an_obstacle(dense_map):
    volume = open_floor(dense_map)
    volume.fill((4.0, 0.8, -0.8), (5.6, 5.6, 0.0), FREE)
    floor = Traversability(TraversabilityConfig(), ZED)
    floor.update(volume.arrays(), POSE)
    assert kind_at(floor, 4.6, 3.0) == OBSTACLE
    assert not can_stand(floor.grid, floor.limits, np.array([3.9, 3.0]), 0.0)


def test_a_stair_is_no_floor(dense_map):
    volume = open_floor(dense_map)
    for n in range(4):
        rise = 0.2 * (n + 1)
        volume.fill((3.6 + 0.3 * n, 0.8, 0.0), (3.9 + 0.3 * n, 5.6, rise), OCCUPIED)
    floor = Traversability(TraversabilityConfig(), ZED)
    floor.update(volume.arrays(), POSE)
    assert [kind_at(floor, 3.75 + 0.3 * n, 3.0) for n in range(4)] == [OBSTACLE] * 4


def test_the_robot_starts_on_floor_that_it_cannot_see(dense_map):
    volume = open_floor(dense_map)
    volume.fill((2.2, 2.2, -0.1), (3.4, 3.4, 2.0), UNKNOWN)
    floor = Traversability(TraversabilityConfig(), ZED)
    floor.update(volume.arrays(), POSE)
    assert kind_at(floor, 2.85, 2.85) == OPEN
    assert kind_at(floor, 2.35, 2.35) == UNSEEN
    assert can_stand(floor.grid, floor.limits, POSE[:2, 3], 0.0)


def test_only_the_changed_window_is_worked_on_and_equals_starting_afresh(dense_map):
    volume = open_floor(dense_map)
    floor = Traversability(TraversabilityConfig(), ZED)
    floor.update(volume.arrays(), POSE)
    assert floor.update(volume.arrays(), POSE) is None
    volume.fill((4.0, 4.0, 0.0), (4.3, 4.2, 0.8), OCCUPIED)
    box = floor.update(volume.arrays(), POSE)
    assert box is not None
    assert box[1] - box[0] < 45
    fresh = np.full_like(floor.grid.obstacle, BEYOND_CUTOFF)
    whole = (0, fresh.shape[0], 0, fresh.shape[1])
    update_nearest_offsets(floor.grid.kind, OBSTACLE, whole, floor.grid.cutoff, fresh)
    np.testing.assert_allclose(
        *(np.hypot(*s.astype(float).transpose(2, 0, 1)) for s in (fresh, floor.grid.obstacle))
    )
    assert floor.clearance(3.5, 4.1) == pytest.approx(math.hypot(0.55, 0.05), abs=1e-6)


def test_marks_are_kept_as_the_grid_grows(dense_map):
    floor = Traversability(TraversabilityConfig(), ZED)
    floor.update(open_floor(dense_map).arrays(), POSE)
    floor.mark_contact(POSE)
    floor.update(open_floor(dense_map).arrays(), POSE)
    assert kind_at(floor, 3.15, 2.85) == OBSTACLE
    bigger = dense_map((9.6, 8.0, 2.4), origin=(-3, -2, -1)).room((0.8, 0.8), (5.6, 5.6))
    floor.update(bigger.arrays(), POSE)
    assert kind_at(floor, 3.15, 2.85) == OBSTACLE
    assert kind_at(floor, 1.05, 2.05) == OPEN


def test_a_wide_body_keeps_away_from_what_is_beyond_the_usual_distances(dense_map):
    """Its circle is wider than `clearance_max_m`."""
    volume = dense_map((12.8, 12.8, 2.4)).room((0.8, 0.8), (12.0, 12.0))
    wide = dataclasses.replace(ZED, spheres=upright_body(1.6, 1.2, 0.06))
    floor = Traversability(TraversabilityConfig(), wide)
    floor.update(volume.arrays(), base_pose(6.4, 6.4, 0.0, 0.0))
    margin_m = floor.margin_m + floor.config.comfort_m
    for x, free in ((6.4, True), (10.2, True), (10.5, False)):
        assert can_stand(floor.grid, floor.limits, np.array([x, 6.4]), margin_m) is free


def test_relaxing_opens_contacts_and_reduces_the_margin_once(dense_map):
    volume = open_floor(dense_map)
    floor = Traversability(TraversabilityConfig(), ZED)
    floor.update(volume.arrays(), POSE)
    floor.mark_contact(POSE)
    floor.update(volume.arrays(), POSE)
    assert floor.relax()
    assert floor.margin_m == TraversabilityConfig().squeeze_margin_m
    assert floor.update(volume.arrays(), POSE) is not None
    assert kind_at(floor, 3.15, 2.85) == OPEN
    assert not floor.relax(), "there is nothing left to relax"
    floor.restore()
    floor.update(volume.arrays(), POSE)
    assert kind_at(floor, 3.15, 2.85) == OBSTACLE, "the contact is no less true"


def test_the_full_margin_comes_back_and_the_whole_floor_is_checked_with_it(dense_map):
    volume = open_floor(dense_map)
    floor = Traversability(TraversabilityConfig(), ZED)
    floor.update(volume.arrays(), POSE)
    floor.restore()
    assert floor.update(volume.arrays(), POSE) is None, "it was never reduced"
    floor.squeeze()
    floor.update(volume.arrays(), POSE)
    floor.restore()
    assert floor.margin_m == TraversabilityConfig().margin_m
    nx, ny = floor.grid.kind.shape
    assert floor.update(volume.arrays(), POSE) == (0, nx, 0, ny)
    assert floor.update(volume.arrays(), POSE) is None
    assert floor.relax()


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ({"margin_m": 0.9}, "margin_m"),
        ({"min_seen": 0.0}, "min_seen"),
        ({"slow_fraction": 0.0}, "slow_fraction"),
        ({"margin_m": 0.0, "squeeze_margin_m": 0.1}, "squeeze_margin_m"),
    ],
)
def test_values_that_close_or_open_everything_are_refused(values, text):
    with pytest.raises(ValueError, match=text):
        TraversabilityConfig(**values)


def test_what_was_driven_over_on_one_floor_is_not_seen_on_another(dense_map):
    volume = open_floor(dense_map)
    floor = Traversability(TraversabilityConfig(), ZED)
    floor.update(volume.arrays(), POSE)
    upstairs = POSE.copy()
    upstairs[:3, 3] += (1.5, 1.5, 3.0)
    floor.update(volume.arrays(), upstairs)
    assert kind_at(floor, *POSE[:2, 3]) == UNSEEN
    assert kind_at(floor, *upstairs[:2, 3]) == OPEN
    floor.update(volume.arrays(), POSE)
    assert kind_at(floor, *POSE[:2, 3]) == OPEN

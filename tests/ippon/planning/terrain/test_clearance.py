"""Distances in the plane, exact, and what they say about a straight move."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ippon.planning.terrain.body_limits import BodyLimits
from ippon.planning.terrain.clearance import (
    clearance_at,
    clearance_at_pose,
    seen_around,
    seen_at_pose,
)
from ippon.planning.terrain.floor_grid import (
    BEYOND_CUTOFF,
    OBSTACLE,
    OPEN,
    UNSEEN,
    FloorGrid,
    update_nearest_offsets,
)
from ippon.planning.terrain.motion_check import can_stand, can_turn, free_turn, move_between, straight_move
from tests.reference import planning_floor as reference

LIMITS = BodyLimits(
    radius=0.25, unseen_radius=0.15, slow_clearance=0.25, slow_fraction=0.4, speed=0.8
)


def make_grid(kind: np.ndarray, cutoff: int = 15, origin=(0, 0)) -> FloorGrid:
    grid = FloorGrid(
        voxel_size=0.1,
        origin=np.array(origin, dtype=np.int64),
        kind=kind.astype(np.uint8),
        obstacle=np.full((*kind.shape, 2), BEYOND_CUTOFF, dtype=np.int16),
        unseen=np.full((*kind.shape, 2), BEYOND_CUTOFF, dtype=np.int16),
        cutoff=cutoff,
    )
    everything = (0, kind.shape[0], 0, kind.shape[1])
    update_nearest_offsets(grid.kind, OBSTACLE, everything, cutoff, grid.obstacle)
    update_nearest_offsets(grid.kind, UNSEEN, everything, cutoff, grid.unseen)
    return grid


def random_kind(seed: int, shape=(34, 27), share=0.03) -> np.ndarray:
    rng = np.random.default_rng(seed)
    kind = np.full(shape, OPEN, dtype=np.uint8)
    kind[rng.random(shape) < share] = OBSTACLE
    kind[rng.random(shape) < share] = UNSEEN
    return kind


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 10_000), share=st.sampled_from([0.0, 0.01, 0.05, 0.4]))
def test_every_cell_has_its_nearest_obstacle(seed, share):
    kind = random_kind(seed, (21, 17), share)
    grid = make_grid(kind, cutoff=7)
    for i in range(kind.shape[0]):
        for j in range(kind.shape[1]):
            expected = reference.nearest_distance(kind, OBSTACLE, i, j, 7)
            di, dj = grid.obstacle[i, j]
            if math.isinf(expected):
                assert di == BEYOND_CUTOFF
            else:
                assert math.hypot(di, dj) == pytest.approx(expected)
                assert kind[i + di, j + dj] == OBSTACLE


@pytest.mark.parametrize("seed", range(5))
def test_a_window_round_a_change_is_as_good_as_everything(seed):
    rng = np.random.default_rng(seed)
    kind = random_kind(seed)
    grid = make_grid(kind)
    for _ in range(5):
        i, j = rng.integers(0, kind.shape)
        grid.kind[i, j] = rng.choice([OPEN, OBSTACLE])
        window = (
            max(0, i - 15),
            min(kind.shape[0], i + 16),
            max(0, j - 15),
            min(kind.shape[1], j + 16),
        )
        update_nearest_offsets(grid.kind, OBSTACLE, window, 15, grid.obstacle)
    fresh = make_grid(grid.kind)
    lengths = [np.hypot(*g.obstacle.astype(float).transpose(2, 0, 1)) for g in (grid, fresh)]
    np.testing.assert_allclose(*lengths)


@pytest.mark.parametrize("seed", range(3))
def test_clearance_is_exact_below_a_cell(seed):
    grid = make_grid(random_kind(seed), origin=(-7, 5))
    rng = np.random.default_rng(seed)
    size = np.array(grid.kind.shape)
    points = (grid.origin + 1.0 + rng.random((300, 2)) * (size - 2.0)) * 0.1
    for x, y in points:
        exact = reference.clearance(grid, OBSTACLE, x, y)
        # The four cells round a point nearly always hold its nearest site between them.
        assert exact - 1e-9 <= clearance_at(grid, x, y) <= exact + 0.02


def test_outside_the_grid_nothing_is_free_or_seen():
    grid = make_grid(np.full((10, 10), OPEN))
    assert clearance_at(grid, -0.2, 0.5) == 0.0
    assert not seen_around(grid, 0.5, 1.2, 0.1)
    assert not can_stand(grid, LIMITS, np.array([5.0, 5.0]), 0.0)


def test_a_straight_move_through_open_floor_takes_length_over_speed():
    grid = make_grid(np.full((60, 40), OPEN))
    free, time, crowding = straight_move(grid, LIMITS, 2.0, 2.0, 4.0, 2.0, 0.0, math.inf)
    assert free
    assert time == pytest.approx(2.0 / 0.8)
    assert crowding == pytest.approx(2.0 / (1.5 - 0.25))


def test_a_wall_blocks_and_a_door_lets_through_slowly():
    kind = np.full((60, 40), OPEN)
    kind[30, :] = OBSTACLE
    a, b = np.array([2.0, 2.05]), np.array([4.0, 2.05])
    assert not move_between(make_grid(kind), LIMITS, a, b, 0.0)[0]
    kind[30, 17:24] = OPEN
    free, time, _ = move_between(make_grid(kind), LIMITS, a, b, 0.0)
    assert free
    assert time > 2.0 / 0.8 * 1.05
    assert not move_between(make_grid(kind), LIMITS, a, b, 0.2)[0], "the margin closes the door"


def test_unseen_floor_blocks_only_close_to_the_centre():
    kind = np.full((60, 40), OPEN)
    kind[:, 22] = UNSEEN
    grid = make_grid(kind)
    near, far = 2.05, 1.95
    for y, free in ((near, True), (2.15, False), (far, True)):
        assert move_between(grid, LIMITS, np.array([2, y]), np.array([4, y]), 0.0)[0] is free


def test_a_robot_too_close_to_an_obstacle_may_only_move_away():
    kind = np.full((60, 40), OPEN)
    kind[30, 20] = OBSTACLE
    grid = make_grid(kind)
    here = np.array([2.85, 2.05])
    room = clearance_at(grid, 2.85, 2.05)
    assert room < LIMITS.radius
    away, closer = np.array([1.5, 2.05]), np.array([2.95, 2.05])
    assert not move_between(grid, LIMITS, here, away, 0.0)[0]
    assert move_between(grid, LIMITS, here, away, 0.0, room)[0]
    assert not move_between(grid, LIMITS, here, closer, 0.0, room)[0]


LONG = LIMITS._replace(
    radius=0.47,
    unseen_radius=0.32,
    half_width=0.27,
    unseen_half_width=0.15,
    discs=np.array([(-0.2, 0.0, 0.27, 0.15), (0.0, 0.0, 0.27, 0.15), (0.2, 0.0, 0.27, 0.15)]),
)


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10_000))
def test_a_long_body_has_the_room_of_its_tightest_disc(seed):
    grid = make_grid(random_kind(seed))
    rng = np.random.default_rng(seed)
    size = np.array(grid.kind.shape)
    for x, y, yaw in rng.random((60, 3)) * (*(0.1 * (size - 12.0)), 6.3) + (0.6, 0.6, 0.0):
        ends = [(x + d * math.cos(yaw), y + d * math.sin(yaw)) for d in (-0.2, 0.0, 0.2)]
        rooms = [clearance_at(grid, *end) - 0.27 for end in ends]
        assert clearance_at_pose(grid, LONG, x, y, yaw) == pytest.approx(min(rooms) + 0.47)
        seen = all(seen_around(grid, *end, 0.15) for end in ends)
        assert seen_at_pose(grid, LONG, x, y, yaw) is seen
        assert clearance_at_pose(grid, LIMITS, x, y, yaw) == clearance_at(grid, x, y)


def test_a_long_body_fits_along_a_corridor_and_not_across():
    kind = np.full((60, 40), OPEN)
    kind[:, :16] = kind[:, 24:] = OBSTACLE
    grid = make_grid(kind)
    a, b = np.array([1.5, 2.0]), np.array([3.5, 2.0])
    assert move_between(grid, LONG, a, b, 0.02)[0]
    assert not can_stand(grid, LONG, a, 0.0), "it cannot turn there"
    assert not can_turn(grid, LONG, 1.5, 2.0, 0.0, 1.6, 0.0, math.inf)
    assert can_turn(grid, LONG, 1.5, 2.0, 0.0, 0.1, 0.0, math.inf)
    assert can_turn(grid, LONG, 1.5, 2.0, 3.0, -3.0, 0.0, math.inf), "the shorter way"
    assert can_turn(grid, LIMITS, 1.5, 2.0, 0.0, 1.6, 0.0, math.inf), "a round one does"


def test_how_far_a_long_body_can_turn():
    kind = np.full((60, 40), OPEN)
    kind[:, 22:] = UNSEEN
    grid = make_grid(kind)
    right, left = free_turn(grid, LONG, 3.0, 2.0, 0.0, 0.0, 1.5)
    assert 0.3 <= left < math.pi / 2, "until its nose would be over what was not seen"
    assert right == pytest.approx(left, abs=0.101), "or its tail"
    assert can_turn(grid, LONG, 3.0, 2.0, 0.0, left, 0.0, 1.5)
    assert not can_turn(grid, LONG, 3.0, 2.0, 0.0, left + 0.1, 0.0, 1.5)
    half = (math.pi, math.pi)
    assert free_turn(grid, LIMITS, 3.0, 2.0, 0.0, 0.0, 1.5) == half, "a round one does not ask"
    assert free_turn(make_grid(np.full((60, 40), OPEN)), LONG, 3.0, 2.0, 0.0, 0.0, 1.5) == half


def test_a_long_body_that_stands_too_close_may_turn_away():
    kind = np.full((60, 40), OPEN)
    kind[:, 20] = OBSTACLE
    grid = make_grid(kind)
    x, y, askew = 3.0, 1.75, 0.3
    room = clearance_at_pose(grid, LONG, x, y, askew)
    assert room < LONG.radius
    assert not can_turn(grid, LONG, x, y, askew, 0.0, 0.02, math.inf)
    assert can_turn(grid, LONG, x, y, askew, 0.0, 0.02, room)
    assert not can_turn(grid, LONG, x, y, askew, 1.5, 0.02, room)


def test_a_long_body_turns_here_over_floor_that_was_seen_and_there_over_any():
    kind = np.full((60, 40), OPEN)
    grid = make_grid(kind)
    assert can_turn(grid, LONG, 3.0, 2.0, 0.0, math.pi / 2, 0.02, math.inf), "its circle has room"
    assert can_turn(grid, LONG, 3.0, 2.0, 0.0, math.pi / 2, 0.02, 1.5), "and is on seen floor"
    kind[:, 23:] = UNSEEN
    grid = make_grid(kind)
    assert can_turn(grid, LONG, 3.0, 2.0, 0.0, math.pi / 2, 0.02, math.inf), "seen by then"
    assert not can_turn(grid, LONG, 3.0, 2.0, 0.0, math.pi / 2, 0.02, 1.5), "its nose would be"
    assert can_turn(grid, LONG, 3.0, 2.0, 0.0, 0.3, 0.02, 1.5), "not over what lies aside"

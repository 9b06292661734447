"""The distance field: exact after any sequence of changes, against scipy and a plain twin."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.ndimage import distance_transform_edt

from ippon.mapping.arrays import OCCUPIED
from ippon.mapping.blocks import BlockDirectory, allocate_block, make_pools
from ippon.mapping.occupancy import distance_field
from ippon.mapping.occupancy.distance_field import MAX_REACH, DistanceField
from ippon.mapping.queries import to_metres
from tests.reference.distance_field import nearest_occupied


class Volume:
    """Blocks set voxel by voxel, without a camera."""

    def __init__(self, voxel_size=0.1, distance_max=1.0, seed=0):
        self.voxel_size, self.distance_max = voxel_size, distance_max
        self.pools = make_pools(4000)
        self.directory = BlockDirectory(10**6)
        self.field = DistanceField(voxel_size, distance_max)
        self.rng = np.random.default_rng(seed)
        self.coords = []

    def add_block(self, coord):
        coord = np.array(coord)
        self.directory.cover(coord, coord + 1)
        row = allocate_block(self.pools, *coord, np.uint16(self.field.farthest), 1)
        self.directory.rows[tuple(coord - self.directory.origin)] = row
        self.coords.append(coord)
        return coord

    def row(self, coord):
        return self.directory.rows[tuple(coord - self.directory.origin)]

    def set_random(self, coord, share):
        row = self.row(coord)
        self.pools.state[row] = np.where(self.rng.random(512) < share, OCCUPIED, 1)
        self.pools.occupied[row] = np.count_nonzero(self.pools.state[row] == OCCUPIED)

    def update(self, changed, fresh=()):
        changed = np.array(changed, np.int64).reshape(-1, 3)
        fresh = np.array(fresh, np.int64).reshape(-1, 3)
        d = self.directory
        return self.field.update(self.pools, d.rows, d.origin, changed, fresh)

    def dense(self):
        low = np.min(self.coords, axis=0)
        shape = (np.max(self.coords, axis=0) - low + 1) * 8
        occupied, distance = np.zeros(shape, bool), np.full(shape, np.nan)
        for coord in self.coords:
            at = tuple(slice(8 * k, 8 * k + 8) for k in coord - low)
            occupied[at] = self.pools.state[self.row(coord)].reshape(8, 8, 8) == OCCUPIED
            distance[at] = self.metres(coord).reshape(8, 8, 8)
        return occupied, distance

    def metres(self, coord):
        squared = self.pools.squared_distance[self.row(coord)]
        return to_metres(squared, self.voxel_size, self.distance_max)

    def check(self):
        occupied, distance = self.dense()
        exact = np.full(occupied.shape, self.distance_max)
        if occupied.any():
            exact = distance_transform_edt(~occupied) * self.voxel_size
        exact = np.minimum(exact, self.distance_max)
        known = np.isfinite(distance)
        assert np.abs(distance - exact)[known].max() < 1e-6


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
# Blocks above the window that is read ran into the lines below.
@example(seed=152, voxel_size=0.1, distance_max=1.0)
@given(
    seed=st.integers(0, 10**6),
    voxel_size=st.sampled_from([0.1, 0.05, 0.13]),
    distance_max=st.sampled_from([0.35, 1.0]),
)
def test_exact_after_any_sequence_of_changes(seed, voxel_size, distance_max):
    volume = Volume(voxel_size, distance_max, seed)
    rng = np.random.default_rng(seed)
    present = set()
    for _ in range(6):
        fresh = []
        for _ in range(int(rng.integers(0, 8))):
            coord = tuple(int(c) for c in rng.integers(-4, 5, 3))
            if coord not in present:
                present.add(coord)
                fresh.append(volume.add_block(coord))
        changed = [c for c in volume.coords if rng.random() < 0.3]
        for coord in changed:
            volume.set_random(coord, rng.choice([0.0, 0.002, 0.05]))
        volume.update(changed, fresh)
        if volume.coords:
            volume.check()


@pytest.mark.parametrize("seed", range(4))
def test_exact_where_a_change_is_computed_in_pieces(monkeypatch, seed):
    monkeypatch.setattr(distance_field, "PIECE_BLOCKS", 2)
    volume = Volume(0.1, 1.0, seed)
    coords = [volume.add_block((x, y, z)) for x in range(-3, 4) for y in range(5) for z in range(2)]
    for coord in coords:
        volume.set_random(coord, 0.002)
    volume.update(coords, coords)
    volume.check()
    changed = [coords[0], coords[-1]]
    for coord in changed:
        volume.set_random(coord, 0.01)
    volume.update(changed)
    volume.check()


def test_what_lies_between_two_changes_far_apart_is_not_computed():
    volume = Volume(0.1, 1.0)
    coords = [volume.add_block((x, 0, 0)) for x in (0, 600)]
    for coord in coords:
        volume.set_random(coord, 0.01)
    assert volume.update(coords, coords) == 2 * 512
    assert volume.field._work.size < 10 * 512
    for coord in coords:
        state = volume.pools.state[volume.row(coord)].reshape(8, 8, 8)
        exact = np.minimum(distance_transform_edt(state != OCCUPIED) * 0.1, 1.0)
        assert np.abs(volume.metres(coord).reshape(8, 8, 8) - exact).max() < 1e-6


def test_agrees_with_the_plain_twin():
    volume = Volume(0.1, 0.9, seed=4)
    coords = [volume.add_block((x, y, 0)) for x in range(2) for y in range(2)]
    for coord in coords:
        volume.set_random(coord, 0.01)
    volume.update(coords, coords)
    occupied, distance = volume.dense()
    assert np.allclose(distance, nearest_occupied(occupied, 0.1, 0.9), atol=1e-6)


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 10**6), share=st.sampled_from([0.0005, 0.003, 0.05]))
def test_no_voxel_is_nearer_than_its_neighbour_by_more_than_a_step(seed, share):
    volume = Volume(0.1, 1.0, seed)
    coords = [volume.add_block((x, y, z)) for x in range(3) for y in range(3) for z in range(2)]
    for coord in coords:
        volume.set_random(coord, share)
    volume.update(coords, coords)
    _, distance = volume.dense()
    for axis in range(3):
        assert np.abs(np.diff(distance, axis=axis)).max() <= 0.1 + 1e-6


def test_nothing_is_computed_when_nothing_changed():
    volume = Volume()
    coord = volume.add_block((0, 0, 0))
    assert volume.update([], [coord]) == 512
    assert volume.update([], []) == 0


def test_distance_of_a_ball(tools):
    volume = Volume(0.05, 1.0)
    coords = [
        volume.add_block((x, y, z))
        for x in range(-3, 3)
        for y in range(-3, 3)
        for z in range(-3, 3)
    ]
    k = np.arange(512)
    local = np.stack([k >> 6, (k >> 3) & 7, k & 7], axis=1)
    for coord in coords:
        radius = np.linalg.norm((coord * 8 + local + 0.5) * 0.05, axis=1)
        row = volume.row(coord)
        volume.pools.state[row] = np.where(radius <= 0.5, OCCUPIED, 1)
        volume.pools.occupied[row] = np.count_nonzero(radius <= 0.5)
    volume.update(coords, coords)
    for coord in coords:
        radius = np.linalg.norm((coord * 8 + local + 0.5) * 0.05, axis=1)
        expected = np.clip(radius - 0.5, 0.0, 1.0)
        # Centres of occupied voxels lie up to a voxel's diagonal inside the ball.
        error = volume.metres(coord) - expected
        assert error.min() > -1e-6
        assert error.max() < 0.05 * np.sqrt(3.0)


def test_reach_is_bounded_with_a_reason():
    with pytest.raises(ValueError, match=f"at most {MAX_REACH}"):
        DistanceField(0.01, 2.0)

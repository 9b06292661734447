"""Questions about points."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ippon.mapping.arrays import FREE, OCCUPIED, UNKNOWN
from ippon.mapping.config import MapConfig
from ippon.mapping.voxel_map import VoxelMap
from tests.reference import queries as plain


@pytest.fixture(scope="module")
def room(tools):
    world = tools.World.room()
    voxel_map = VoxelMap(MapConfig(), ("thing",))
    for n, pose in enumerate(tools.tour([(1.0, 1.0), (3.0, 3.0)])):
        voxel_map.integrate(world.frame(pose, stamp_ns=n * 10**9))
    return voxel_map


@pytest.mark.slow
def test_states(room):
    points = np.array([[2.0, 2.0, 1.0], [2.0, 2.0, -0.05], [2.0, 2.0, -0.65], [1e5, 0, 0]])
    assert room.state_at(points).tolist() == [FREE, OCCUPIED, UNKNOWN, UNKNOWN]
    assert room.state_at(np.empty((0, 3))).shape == (0,)


def test_an_empty_map_and_points_outside_it_are_unknown():
    points = np.array([[0.0, 0.0, 0.0], [1e300, -1e300, 0.0]])
    assert VoxelMap(MapConfig(), ("thing",)).state_at(points).tolist() == [UNKNOWN, UNKNOWN]


def test_distances(room):
    points = np.array([[2.0, 0.55, 1.2], [2.0, 2.0, 1.2], [2.0, 2.0, -0.65], [1e300, 0, 0]])
    assert room.distance_at(points) == pytest.approx([0.6, 1.0, 0.6, 1.0], abs=0.101)


def test_points_of_the_wrong_shape_or_not_finite_are_refused(room):
    with pytest.raises(ValueError, match=r"\(N, 3\)"):
        room.state_at(np.zeros(3))
    with pytest.raises(ValueError, match=r"point 1 of 2 is \[ 1\. nan  1\.\]"):
        room.distance_at(np.array([[1.0] * 3, [1.0, np.nan, 1.0]]))


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_agree_with_the_plain_twins(room, seed):
    rng = np.random.default_rng(seed)
    points = rng.uniform((-1.0, -1.0, -1.0), (5.0, 5.0, 3.5), (20, 3))
    arrays = room.arrays()
    assert room.state_at(points).tolist() == [plain.state(arrays, p) for p in points]
    expected = [plain.distance(arrays, p, 1.0) for p in points]
    assert np.allclose(room.distance_at(points), expected, atol=1e-6)

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


def test_distances_and_unknown_policy(room):
    points = np.array([[2.0, 0.55, 1.2], [2.0, 2.0, 1.2], [2.0, 2.0, -0.65], [80.0, 0, 0]])
    free = room.distance_at(points, unknown="free")
    assert free == pytest.approx([0.6, 1.0, 0.6, 1.0], abs=0.101)
    obstacle = room.distance_at(points, unknown="obstacle")
    assert (obstacle[:2] == free[:2]).all()
    assert (obstacle[2:] == 0.0).all()


def test_gradient_points_away_from_the_wall(room):
    gradient = room.gradient_at(np.array([[2.0, 0.55, 1.25], [2.0, 3.45, 1.25], [0.55, 2.0, 1.25]]))
    assert gradient == pytest.approx(np.array([[0, 1, 0], [0, -1, 0], [1, 0, 0]]), abs=0.05)


def test_spheres(room):
    centers = np.array([[2.0, 2.0, 1.2], [2.0, 0.25, 1.2], [2.0, 2.0, -0.65]])
    radii = np.array([0.5, 0.4, 0.1])
    assert room.spheres_are_free(centers, radii, unknown="free").tolist() == [True, False, True]
    assert room.spheres_are_free(centers, radii, unknown="obstacle").tolist() == [
        True, False, False,
    ]  # fmt: skip
    with pytest.raises(ValueError, match=r"make MapConfig\.distance_max_m larger"):
        room.spheres_are_free(centers, np.array([0.5, 0.95, 0.1]), unknown="free")


def test_points_of_the_wrong_shape_and_misspelt_policies_are_refused(room):
    with pytest.raises(ValueError, match=r"\(N, 3\)"):
        room.state_at(np.zeros(3))
    points = np.array([[1.0] * 3, [1.0, np.nan, 1.0]])
    with pytest.raises(ValueError, match=r"point 1 of 2 is \[ 1\. nan  1\.\]"):
        room.spheres_are_free(points, np.full(2, 0.1), unknown="free")
    with pytest.raises(ValueError, match="cannot check a sphere of nan m"):
        room.spheres_are_free(np.ones((1, 3)), np.array([np.nan]), unknown="free")
    with pytest.raises(ValueError, match="or \"obstacle\"; got 'obstacles'"):
        room.distance_at(np.zeros((1, 3)), unknown="obstacles")


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10**6), unknown=st.sampled_from(["free", "obstacle"]))
def test_agree_with_the_plain_twins(room, seed, unknown):
    rng = np.random.default_rng(seed)
    points = rng.uniform((-1.0, -1.0, -1.0), (5.0, 5.0, 3.5), (20, 3))
    arrays = room.arrays()
    assert room.state_at(points).tolist() == [plain.state(arrays, p) for p in points]
    expected = [
        plain.distance(arrays, p, 1.0, unknown_blocks=unknown == "obstacle") for p in points
    ]
    assert np.allclose(room.distance_at(points, unknown=unknown), expected, atol=1e-6)
    radii = rng.uniform(0.05, 0.85, len(points))
    clear = [d > r + 0.05 for d, r in zip(np.float32(expected), radii, strict=True)]
    assert room.spheres_are_free(points, radii, unknown=unknown).tolist() == clear

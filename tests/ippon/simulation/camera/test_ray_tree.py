import numpy as np
import pytest

from ippon.simulation.camera.ray_tree import RayTree
from tests.reference import ray_tree as reference


@pytest.mark.parametrize("count", [1, 3, 5, 200])
def test_the_tree_agrees_with_testing_every_triangle(count):
    rng = np.random.default_rng(count)
    corners = rng.uniform(0.0, 4.0, (count, 1, 3)) + rng.normal(0.0, 0.5, (count, 3, 3))
    origins, ways = rng.uniform(-1.0, 5.0, (500, 3)), rng.normal(0.0, 2.0, (500, 3))
    # Some along the axes, where a direction holds zeros.
    ways[:90, rng.integers(0, 3)] = 0.0
    ways[:30, :2] = 0.0
    hit = RayTree(corners).is_hit(origins, ways)
    np.testing.assert_array_equal(hit, reference.is_hit(corners, origins, ways))
    assert hit.any() or count < 5
    assert not hit.all()


def test_a_ray_meets_triangles_between_its_ends_and_passes_no_seam():
    floor = [[[0, 0, 0], [2, 0, 0], [2, 2, 0]], [[0, 0, 0], [2, 2, 0], [0, 2, 0]]]
    tree = RayTree(np.array(floor, float))
    along = np.linspace(0.0, 2.0, 101)
    above = np.column_stack([along, along, np.full(101, 1.0)])
    assert tree.is_hit(above, np.tile([0.0, 0.0, -1.0], (101, 1))).all()
    assert tree.is_hit(above - [0.0, 0.0, 2.0], np.tile([0.0, 0.0, 1.0], (101, 1))).all()
    assert not tree.is_hit(above, np.tile([0.0, 0.0, -0.99], (101, 1))).any()
    assert not tree.is_hit(above, np.tile([0.0, 0.0, 3.0], (101, 1))).any()


def test_many_triangles_in_one_place_and_none_at_all():
    same = np.tile(np.eye(3), (1000, 1, 1))
    ray = np.zeros((1, 3)), np.ones((1, 3))
    assert RayTree(same).is_hit(*ray).all()
    assert not RayTree(np.empty((0, 3, 3))).is_hit(*ray).any()


def test_invalid_triangles_are_rejected():
    with pytest.raises(ValueError, match=r"triangles are \(N, 3, 3\); got \(3, 3\)"):
        RayTree(np.eye(3))
    with pytest.raises(ValueError, match="finite corners"):
        RayTree(np.full((1, 3, 3), np.nan))

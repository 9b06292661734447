"""Thinning out a roadmap that is full."""

import math

import numpy as np

from ippon.planning.roadmap.roadmap import Roadmap
from ippon.planning.roadmap.sampling import SamplingConfig
from ippon.planning.roadmap.thinning import Thinning, crowded_rows

NOTHING = np.zeros((0, 3))


def test_of_places_that_crowd_the_better_one_stays():
    xy = np.array([(0.0, 0.0), (0.5, 0.0), (1.0, 0.0), (3.0, 0.0), (3.2, 0.0), (3.4, 0.0)])
    worth = np.array([1.0, 2.0, 1.0, math.inf, 9.0, math.inf])
    assert crowded_rows(xy, worth, 0.8) == [0, 2, 4]
    assert crowded_rows(xy, worth, 0.1) == []
    assert crowded_rows(xy[:0], worth[:0], 0.8) == []


def row_of_nodes(count=12, capacity=12):
    """A roadmap of nodes 0.4 m apart along x, and what they might show: the more the farther."""
    roadmap = Roadmap(capacity)
    for k in range(count):
        roadmap.add_node(0.4 * k, 0.0)
    return roadmap, np.arange(capacity, dtype=np.float32)


def steps(thinning, *args, count=5):
    return [thinning.crowded(*args) for _ in range(count)]


def test_only_a_full_roadmap_is_thinned_out_and_not_in_every_step():
    roadmap, worth = row_of_nodes()
    found = steps(Thinning(SamplingConfig(), 3, roadmap), NOTHING, worth, None, 0.0, 9.0, count=10)
    assert [bool(nodes) for nodes in found] == ([False] * 4 + [True]) * 2
    # Every third one stays, the one with most to see first: they are 1.2 m apart.
    assert found[4] == [0, 1, 3, 4, 6, 7, 9, 10]
    roadmap, worth = row_of_nodes(capacity=40)
    assert not any(steps(Thinning(SamplingConfig(), 3, roadmap), NOTHING, worth, None, 0.0, 9.0))


def test_what_is_near_the_robot_or_an_object_and_the_target_stay():
    roadmap, worth = row_of_nodes()
    thinning = Thinning(SamplingConfig(local_radius_m=1.0), 3, roadmap)
    object_voxel = np.array([[4.4, 0.5, 0.5]])
    *_, found = steps(thinning, object_voxel, worth, 5, 0.0, 0.0)
    assert found == [3, 4, 6, 7, 8]


def test_a_node_that_is_gone_is_not_removed_again():
    roadmap, worth = row_of_nodes()
    roadmap.remove_node(3)
    *_, found = steps(Thinning(SamplingConfig(), 3, roadmap), NOTHING, worth, None, 0.0, 9.0)
    assert 3 not in found
    assert set(found) < set(roadmap.nodes.tolist())

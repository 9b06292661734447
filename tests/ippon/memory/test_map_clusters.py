import numpy as np
import pytest

from ippon.memory.map_clusters import (
    MapClusters,
    indices_of,
    keys_of,
    least_voxels,
    share_observed,
)


def sightings(clusters):
    return [c.sighting for c in clusters.values() if c.sighting is not None]


def test_keys_are_packed_and_unpacked():
    index = np.random.default_rng(0).integers(-50_000, 50_000, (100, 3))
    assert np.array_equal(indices_of(keys_of(index)), index)
    step = keys_of(index + np.array([1, -1, 1])) - keys_of(index)
    assert len(np.unique(step)) == 1


def test_connected_voxels_of_one_label_are_a_thing(painted_map):
    painted_map.paint((2, 2, 0), (6, 6, 5), "chair", other="stool")
    painted_map.paint((7, 2, 0), (8, 4, 2), "table")
    painted_map.paint((20, 20, 0), (24, 24, 5), "chair")
    painted_map.paint((0, 0, 0), (30, 2, 20), "wall")
    found = sightings(MapClusters(painted_map).update().current)
    assert sorted(one.label for one in found) == ["chair", "chair"], "the table is too small"
    first = found[0]
    assert first.position_world == pytest.approx((0.4, 0.4, 0.25))
    assert first.size_m == pytest.approx((0.4, 0.4, 0.5))
    assert first.voxels == 80
    odds = np.exp(-1.0)
    assert first.probability == pytest.approx(1.0 / (1.0 + odds), abs=0.01)
    assert first.alternatives == (("stool", pytest.approx(odds / (1.0 + odds), abs=0.01)),)


def test_only_what_changed_is_clustered_again_with_the_same_result(painted_map):
    painted_map.paint((2, 2, 0), (6, 6, 5), "chair")
    painted_map.paint((20, 20, 0), (24, 24, 5), "chair")
    clusters = MapClusters(painted_map)
    first = clusters.update()
    far = next(k for k, c in first.current.items() if c.sighting.position_world[0] > 1.0)
    painted_map.paint((6, 2, 0), (12, 6, 5), "chair")
    second = clusters.update()
    assert far not in second.replaced
    assert far not in second.seen
    assert len(second.replaced) == 1
    (grown,) = sightings(second.current)
    assert grown.voxels == 200
    whole = sightings(MapClusters(painted_map).update().current)
    assert sorted(one.voxels for one in whole) == [80, 200]


def test_a_bridge_joins_clusters_and_its_end_parts_them(painted_map):
    painted_map.paint((2, 2, 0), (6, 6, 5), "chair")
    painted_map.paint((14, 2, 0), (18, 6, 5), "chair")
    clusters = MapClusters(painted_map)
    assert len(clusters.update().current) == 2
    painted_map.paint((6, 3, 2), (14, 4, 3), "chair")
    joined = clusters.update()
    assert len(joined.replaced) == 2
    assert [one.voxels for one in sightings(joined.current)] == [168]
    painted_map.paint((9, 3, 2), (10, 4, 3))
    parted = clusters.update()
    assert sorted(one.voxels for one in sightings(parted.current)) == [83, 84]


def test_nothing_changes_where_nothing_was_seen(painted_map):
    painted_map.paint((2, 2, 0), (6, 6, 5), "chair")
    clusters = MapClusters(painted_map)
    (number,) = clusters.update().current
    same = clusters.update()
    assert (same.replaced, same.current, same.seen) == ({}, {}, frozenset())
    painted_map.look_at((2, 2, 0))
    again = clusters.update()
    assert (again.replaced, again.seen) == ({}, {number})


def test_what_the_map_gives_up_is_shown_no_more(painted_map):
    painted_map.paint((2, 2, 0), (6, 6, 5), "chair")
    clusters = MapClusters(painted_map)
    clusters.update()
    painted_map.drop((2, 2, 0))
    lost = clusters.update()
    assert len(lost.replaced) == 1
    assert lost.current == {}
    assert share_observed(painted_map, next(iter(lost.replaced.values())).sighting) == 0.0


def test_a_box_is_observed_where_it_is_free_or_occupied(painted_map, make_instance):
    painted_map.paint((8, 8, 3), (12, 10, 7))
    one = make_instance(at=(1.0, 1.0, 0.5))
    assert share_observed(painted_map, one) == pytest.approx(0.5)


def test_a_large_thing_needs_more_voxels_than_a_small_one():
    assert least_voxels("bed", 0.1) >= least_voxels("chair", 0.1) > least_voxels("mug", 0.1) == 2
    assert least_voxels("chair", 0.05) == pytest.approx(4.0 * least_voxels("chair", 0.1))
    assert 2 < least_voxels("a thing that no table has", 0.1) < 20

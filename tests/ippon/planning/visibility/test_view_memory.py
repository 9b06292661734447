"""What the camera has looked at, and what changed."""

import numpy as np
import pytest

from ippon.mapping.arrays import FREE, OCCUPIED, UNKNOWN
from ippon.planning.array_overlap import copy_overlap
from ippon.planning.visibility.view_config import StalenessConfig
from ippon.planning.visibility.view_geometry import ViewLayers
from ippon.planning.visibility.view_memory import ViewMemory
from tests.ippon.planning.visibility.test_panorama import RULES, make_table

LAYERS = ViewLayers(camera=10, low=0, high=19, floor=0)


def followed(volume) -> ViewMemory:
    memory = ViewMemory(StalenessConfig(), 3.0)
    memory.update(volume.arrays(), LAYERS, RULES)
    return memory


def test_the_field_holds_the_maps_states_where_they_belong(speckled):
    volume = speckled(2)
    memory = followed(volume)
    field = memory.field
    for index in np.random.default_rng(0).integers(0, volume.state.shape, size=(300, 3)):
        voxel = index + volume.origin * 8
        if not LAYERS.low <= voxel[2] <= LAYERS.high:
            continue
        missing = volume.missing[tuple(index // 8)]
        expected = UNKNOWN if missing else volume.state[tuple(index)]
        assert field.state[tuple(voxel - field.origin)] == expected


def test_of_the_floors_layers_only_object_voxels_count(dense_map):
    volume = dense_map().room((0.8, 0.8), (5.6, 5.6), ooi=0.5)
    volume.fill((4.0, 4.0, -0.1), (4.1, 4.1, 0.0), OCCUPIED, ooi=0.9)
    volume.fill((2.0, 2.0, 0.0), (2.1, 2.1, 0.1), OCCUPIED, ooi=0.9)
    memory = ViewMemory(StalenessConfig(), 3.0)
    memory.update(volume.arrays(), ViewLayers(10, -1, 19, 2), RULES._replace(floor_layers=2))
    floor = memory.field.state[:, :, :2]
    found = np.argwhere(floor != FREE) + memory.field.origin
    assert found.tolist() == [[20, 20, 0], [40, 40, -1]]
    assert (memory.field.state[:, :, 2] == OCCUPIED).any(), "walls above it count as ever"


def test_only_changes_that_matter_are_noted(dense_map):
    volume = dense_map().room((0.8, 0.8), (5.6, 5.6))
    memory = followed(volume)
    assert (memory.changed == 1).any()
    volume.fill((2.0, 2.0, 0.5), (2.1, 2.1, 0.6), UNKNOWN)
    memory.update(volume.arrays(), LAYERS, RULES)
    assert (memory.changed != 2).all(), "one voxel is nothing"
    volume.fill((2.0, 2.0, 0.5), (2.5, 2.3, 0.9), UNKNOWN)
    memory.update(volume.arrays(), LAYERS, RULES)
    changed = np.argwhere(memory.changed == 3) * 8 + memory.field.origin[:2]
    assert changed.tolist() == [[16, 16]], "the next block lost a dozen voxels only"
    volume.fill((4.0, 4.0, 0.5), (4.1, 4.1, 0.6), OCCUPIED, ooi=0.9)
    memory.update(volume.arrays(), LAYERS, RULES)
    assert (memory.changed == 4).sum() == 1, "one object voxel matters"


def test_images_are_counted_for_unknown_voxels_and_surfaces(dense_map):
    volume = dense_map().room((0.8, 0.8), (5.6, 5.6))
    volume.fill((4.0, 2.0, 0.5), (4.4, 4.0, 1.5), UNKNOWN)
    memory = followed(volume)
    table = make_table(range_voxels=30.0)
    rules = RULES._replace(surface_range=30.0)
    shown = np.zeros(len(table.rays), dtype=bool)
    shown[table.rays[:, 0] > 0.9] = True
    for _ in range(3):
        memory.record(volume.arrays(), table, rules, (32, 30, 10), shown)
    looks = memory.field.unknown_views
    assert looks.max() == 3
    seen = np.argwhere(looks == 3) + memory.field.origin
    assert (seen[:, 0] >= 40).all(), "only ahead"
    assert (volume.state[seen[:, 0], seen[:, 1], seen[:, 2] + 8] == UNKNOWN).all()
    surface = memory.field.surface_views
    assert surface.max() == 3
    memory.begin_goal(volume.arrays(), LAYERS)
    assert surface.max() == 0
    assert looks.max() == 3, "unknown stays unknown, whatever is searched for"


def test_numbers_of_images_are_kept_as_the_map_grows(dense_map):
    memory = followed(dense_map().room((0.8, 0.8), (5.6, 5.6)))
    at = np.array([30, 40, 5])
    memory.field.unknown_views[tuple(at - memory.field.origin)] = 7
    bigger = dense_map((9.6, 9.6, 2.4), origin=(-2, -1, -1)).room((0.8, 0.8), (5.6, 5.6))
    memory.update(bigger.arrays(), LAYERS, RULES)
    assert memory.field.unknown_views[tuple(at - memory.field.origin)] == 7
    assert memory.field.unknown_views.sum() == 7


def test_another_floor_has_an_empty_memory(dense_map):
    volume = dense_map().room((0.8, 0.8), (5.6, 5.6))
    memory = followed(volume)
    memory.field.unknown_views[:] = 5
    memory.update(volume.arrays(), ViewLayers(-20, -30, -1, 0), RULES)
    assert memory.field.unknown_views.max() == 0


def test_numbers_of_images_stay_with_their_voxels_where_the_floor_is_a_little_higher(dense_map):
    volume = dense_map().room((0.8, 0.8), (5.6, 5.6))
    memory = followed(volume)
    at, below = np.array([30, 40, 5]), np.array([30, 40, 0])
    memory.field.unknown_views[tuple(at - memory.field.origin)] = 7
    memory.field.surface_views[tuple(at - memory.field.origin)] = 3
    memory.field.surface_views[tuple(below - memory.field.origin)] = 9
    memory.update(volume.arrays(), ViewLayers(11, 1, 20, 0), RULES)
    field = memory.field
    assert field.unknown_views[tuple(at - field.origin)] == field.unknown_views.sum() == 7
    assert field.surface_views[tuple(at - field.origin)] == field.surface_views.sum() == 3
    assert field.state[tuple(at - field.origin)] == volume.state[30, 40, 5 + 8], "read again"
    assert (memory.changed == memory.step).all()
    memory.update(volume.arrays(), LAYERS, RULES)
    assert memory.field.unknown_views[tuple(at - memory.field.origin)] == 7


def test_blocks_that_the_map_has_dropped_are_unknown_for_another_goal(dense_map):
    volume = dense_map().room((0.8, 0.8), (5.6, 5.6))
    memory = ViewMemory(StalenessConfig(), 3.0)
    layers = ViewLayers(10, 0, 19, 1)
    memory.update(volume.arrays(), layers, RULES)
    field, before = memory.field, memory.field.state.copy()
    field.unknown_views[:] = 5
    volume.missing[2, 3] = True
    memory.update(volume.arrays(), layers, RULES)
    assert (field.state == before).all(), "within a search it stays as it was seen"
    memory.begin_goal(volume.arrays(), layers)
    x, y = np.array([2, 3]) * 8 - field.origin[:2]
    column = np.s_[x : x + 8, y : y + 8]
    known = before[column] == UNKNOWN
    assert (field.state[column][..., 1:] == UNKNOWN).all()
    assert (field.state[column][..., 0] == FREE).all(), "of the floor only object voxels count"
    assert not known[..., 1:].all()
    assert (field.unknown_views[column][..., 1:][~known[..., 1:]] == 0).all()
    field.state[column] = before[column]
    assert (field.state == before).all(), "the others stay"
    changed = np.argwhere(memory.changed == memory.step) * 8 + field.origin[:2]
    assert changed.tolist() == [[16, 24]]


def test_the_statistics_of_a_row_are_not_those_of_the_block_that_had_it_before(dense_map):
    volume = dense_map().room((0.8, 0.8), (5.6, 5.6))
    memory = followed(volume)
    arrays = volume.arrays()
    # The rows of two blocks of free space, which have the same statistics, change places.
    one, other = (2, 2, 1), (4, 4, 1)
    directory = arrays.directory.copy()
    directory[one], directory[other] = directory[other], directory[one]
    revision = arrays.revision.copy()
    revision[[directory[one], directory[other]]] += 1
    memory.update(arrays._replace(directory=directory, revision=revision), LAYERS, RULES)
    changed = np.argwhere(memory.changed == 2) * 8 + memory.field.origin[:2]
    assert changed.tolist() == [[16, 16], [32, 32]]


def test_a_robot_outside_the_map_counts_no_images(dense_map):
    volume = dense_map().room((0.8, 0.8), (5.6, 5.6))
    memory = followed(volume)
    table = make_table()
    everything = np.ones(len(table.rays), dtype=bool)
    memory.record(volume.arrays(), table, RULES, (900, 900, 10), everything)
    assert memory.field.unknown_views.max() == 0


@pytest.mark.parametrize("offset", [(-2, 1), (3, 3), (9, 0), (0, -9)])
def test_only_the_overlap_is_copied(offset):
    source = np.arange(1, 17).reshape(4, 4)
    target = np.zeros((5, 5), dtype=int)
    copy_overlap(source, np.array(offset), target)
    expected = np.zeros((5, 5), dtype=int)
    for i in range(4):
        for j in range(4):
            a, b = i + offset[0], j + offset[1]
            if 0 <= a < 5 and 0 <= b < 5:
                expected[a, b] = source[i, j]
    np.testing.assert_array_equal(target, expected)

"""Visibility, gain and termination of a viewpoint against the slow way, and known scenes."""

import math

import numpy as np
import pytest

from ippon.mapping.arrays import FREE, OCCUPIED, UNKNOWN
from ippon.planning.visibility.panorama import ViewField, ViewRules, cast_panorama, within_field
from ippon.planning.visibility.view_table import build_view_table
from ippon.planning.visibility.viewpoint_gain import recount_levels
from tests.reference import planning_view as reference

RULES = ViewRules(
    unknown_occupied=0.1,
    unknown_depth=12.0,
    unknown_views=4.0,
    surface_views=20.0,
    surface_range=18.0,
    ooi_floor=0.05,
    termination_threshold=0.8,
    termination_range=9.5,
    termination_depth=3.0,
    termination_depth_factor=3.0,
    termination_depth_columns=1,
    termination_fringe=1.0,
    level_range=15.0,
)


def make_table(range_voxels=20.0, yaw_bins=48, low=-10, high=9):
    return build_view_table(
        yaw_bins=yaw_bins,
        pitch_low=-1.2,
        pitch_high=0.8,
        range_voxels=range_voxels,
        layer_low=low,
        layer_high=high,
    )


def make_field(volume, low: int, high: int, reach: int = 24, rng=None) -> ViewField:
    """The field of a dense map, a view's reach wider on every side."""
    origin = volume.origin * 8 - (reach, reach, 0)
    origin[2] = low
    shape = (volume.state.shape[0] + 2 * reach, volume.state.shape[1] + 2 * reach, high - low + 1)
    state = np.full(shape, UNKNOWN, dtype=np.uint8)
    known = np.where(volume.missing.repeat(8, 0).repeat(8, 1).repeat(8, 2), UNKNOWN, volume.state)
    first = low - volume.origin[2] * 8
    state[reach:-reach, reach:-reach] = known[:, :, first : first + high - low + 1]
    looks = [np.zeros(shape, dtype=np.uint8) for _ in range(2)]
    if rng is not None:
        looks = [rng.integers(0, 6, size=shape).astype(np.uint8) for _ in range(2)]
    return ViewField(origin, state, *looks)


def look(volume, camera, rules=RULES, **table_options):
    table = make_table(**table_options)
    low, high = camera[2] + table.layer_low, camera[2] + table.layer_high
    return cast_panorama(
        volume.arrays(), table, rules, make_field(volume, low, high), camera
    ), table


@pytest.mark.parametrize("seed", range(4))
def test_agrees_with_asking_every_voxel_one_by_one(speckled, seed):
    volume = speckled(seed)
    rng = np.random.default_rng(seed)
    table = make_table(range_voxels=14.0, yaw_bins=40)
    i, j = (int(c) for c in volume.origin[:2] * 8 + rng.integers(14, 30, size=2))
    camera = (i, j, 8)
    field = make_field(volume, -2, 17, rng=rng)
    arrays = volume.arrays()
    result = cast_panorama(arrays, table, RULES, field, camera)
    known, unknown, ooi, behind, levels = reference.panorama(arrays, table, RULES, field, camera)
    np.testing.assert_allclose(result.known, known, rtol=1e-5, atol=1e-5)
    np.testing.assert_allclose(result.unknown, unknown, rtol=1e-5, atol=1e-5)
    np.testing.assert_array_equal(result.ooi, ooi)
    np.testing.assert_array_equal(result.behind, behind)
    np.testing.assert_array_equal(result.levels, levels)
    assert known.sum() > 0.0, "the scene must hold what is compared"
    assert behind.sum() > 0.0
    assert unknown.sum() > 0.0
    np.testing.assert_array_equal(recount_levels(arrays, table, camera, result.labelled), levels)


def test_every_voxel_of_open_unknown_space_counts_once(dense_map):
    volume = dense_map((4.8, 4.8, 2.4))
    deep = RULES._replace(unknown_depth=100.0)
    result, table = look(volume, (24, 24, 10), deep, range_voxels=20.0)
    axis = np.arange(-20, 21)
    x, y, z = np.meshgrid(axis, axis, np.arange(-10, 10), indexing="ij")
    far = np.sqrt(x**2 + y**2 + z**2)
    pitch = np.arctan2(z, np.hypot(x, y))
    rows = np.floor((pitch - table.pitch_low) / table.bin_rad)
    inside = (far <= 20.0) & (far > 0.0) & (rows >= 0) & (rows < table.pitch_bins)
    expected = 0.1 * inside.sum()
    # Rays end where they leave the band; a cell's few voxels beyond that end are lost.
    assert 0.93 * expected <= result.unknown.sum() <= expected + 1e-3


def test_unknown_space_behind_a_wall_does_not_count(dense_map):
    volume = dense_map((6.4, 6.4, 2.4))
    volume.room((1.0, 1.0), (4.0, 4.0))
    result, _ = look(volume, (25, 25, 10), range_voxels=40.0)
    assert result.unknown.sum() < 0.5
    # A door: what lies beyond it counts, in its direction only.
    volume.fill((4.0, 2.2, 0.0), (4.1, 3.0, 1.9), FREE)
    result, table = look(volume, (25, 25, 10), range_voxels=40.0)
    assert result.unknown.sum() > 20.0
    columns = result.unknown.sum(axis=0)
    yaw = (np.arange(table.yaw_bins) + 0.5) * table.bin_rad
    aside = np.abs((yaw + math.pi) % (2 * math.pi) - math.pi) > 0.7
    assert columns[aside].sum() < 0.05 * columns.sum()


def test_unknown_depth_bounds_what_lies_behind_the_frontier(dense_map):
    volume = dense_map((6.4, 6.4, 2.4))
    volume.room((1.0, 1.0), (4.0, 4.0)).fill((4.0, 1.0, 0.0), (4.1, 4.0, 2.0), FREE)
    sums = [
        look(volume, (25, 25, 10), RULES._replace(unknown_depth=depth), range_voxels=40.0)[
            0
        ].unknown.sum()
        for depth in (5.0, 10.0, 40.0)
    ]
    assert 0.0 < sums[0] < sums[1] < sums[2]


def test_unknown_space_loses_its_gain_with_every_image(dense_map):
    volume = dense_map()
    table = make_table()
    field = make_field(volume, 0, 19)
    fresh = cast_panorama(volume.arrays(), table, RULES, field, (32, 32, 10)).unknown.sum()
    field.unknown_views[:] = 2
    assert cast_panorama(
        volume.arrays(), table, RULES, field, (32, 32, 10)
    ).unknown.sum() == pytest.approx(0.5 * fresh, rel=1e-4)
    field.unknown_views[:] = 4
    assert cast_panorama(volume.arrays(), table, RULES, field, (32, 32, 10)).unknown.sum() == 0.0


def test_object_voxels_count_within_reach_and_in_sight_only(dense_map):
    def count(x: float, screen: bool = False, p: float = 0.95) -> float:
        volume = dense_map()
        volume.room((0.8, 0.8), (5.6, 5.6))
        volume.fill((x, 3.0, 0.6), (x + 0.2, 3.4, 1.0), OCCUPIED, ooi=p, level=2)
        if screen:
            volume.fill((x - 0.3, 2.0, 0.0), (x - 0.2, 4.4, 2.0), OCCUPIED, ooi=0.0)
        return look(volume, (22, 32, 11))[0].ooi.sum()

    assert count(2.9) > 8.0
    assert count(3.3) == 0.0, "more than the termination range away"
    assert count(2.9, screen=True) == 0.0, "hidden"
    assert count(2.9, p=0.7) == 0.0, "below the threshold"


def test_voxels_beyond_reach_count_up_to_three_times_those_within_reach(dense_map):
    deep = RULES._replace(termination_depth=7.0)

    def view(front: float | None, height: float = 0.2):
        volume = dense_map().room((0.8, 0.8), (6.0, 6.0))
        volume.fill((3.3, 2.9, 0.0), (3.8, 3.5, 0.2), OCCUPIED, ooi=0.95, level=2)
        if front is not None:
            volume.fill((front, 3.1, 0.0), (3.2, 3.3, height), OCCUPIED, ooi=0.95, level=2)
        return look(volume, (22, 32, 11), deep)[0]

    wide = view(2.7)
    assert 0.0 < wide.behind.sum() <= 3.0 * wide.ooi.sum() - 3.0
    assert wide.termination == wide.ooi.sum() + wide.behind.sum()
    edge = view(3.1)
    assert 3.0 < 3.0 * edge.ooi.sum() < edge.behind.sum()
    assert edge.termination == 4.0 * edge.ooi.sum() - 3.0, "most of it is out of reach"
    assert view(None).termination == 0.0, "nothing of it is within reach"
    assert view(3.1, height=1.5).behind.sum() < edge.behind.sum(), "its front hides some of it"


def test_voxels_beyond_reach_in_other_directions_do_not_count(dense_map):
    deep = RULES._replace(termination_depth=7.0)
    volume = dense_map().room((0.8, 0.8), (6.0, 6.0))
    volume.fill((2.8, 3.1, 0.4), (2.9, 3.4, 0.6), OCCUPIED, ooi=0.95, level=2)
    alone = look(volume, (22, 32, 11), deep)[0].termination
    volume.fill((1.0, 2.9, 0.4), (1.1, 3.5, 0.8), OCCUPIED, ooi=0.95, level=2)
    volume.fill((2.0, 4.4, 0.4), (2.4, 4.5, 0.8), OCCUPIED, ooi=0.95, level=2)
    both = look(volume, (22, 32, 11), deep)[0]
    assert alone == both.termination == both.ooi.sum() > 1.0
    assert not both.behind.any()
    volume.fill((3.4, 3.1, 0.4), (3.5, 3.4, 1.0), OCCUPIED, ooi=0.95, level=2)
    assert look(volume, (22, 32, 11), deep)[0].termination > alone, "in the same direction"


def test_voxels_beyond_reach_do_not_count_for_a_fringe_within_reach(dense_map):
    deep = RULES._replace(termination_depth=7.0)
    volume = dense_map().room((0.8, 0.8), (6.0, 6.0))
    volume.fill((3.0, 3.2, 0.4), (3.1, 3.3, 0.5), OCCUPIED, ooi=0.95, level=2)
    volume.fill((3.4, 2.9, 0.4), (3.5, 3.6, 1.0), OCCUPIED, ooi=0.95, level=2)
    seen = look(volume, (22, 32, 11), deep)[0]
    assert (seen.ooi.sum(), seen.termination) == (1.0, 1.0)
    assert seen.behind.sum() > 3.0


def test_surfaces_out_of_range_have_no_gain(dense_map):
    volume = dense_map()
    volume.room((2.4, 2.4), (4.0, 4.0), ooi=None)
    near_only = RULES._replace(surface_range=5.0)
    wide = RULES._replace(surface_range=20.0)
    assert look(volume, (32, 32, 10), near_only)[0].unknown.sum() == 0.0
    assert look(volume, (32, 32, 10), wide)[0].unknown.sum() > 50.0


def test_a_view_beyond_the_field_is_refused(dense_map):
    volume = dense_map()
    table = make_table(range_voxels=40.0)
    field = make_field(volume, 0, 19, reach=8)
    assert not within_field(table, field, (0, 0, 10))
    with pytest.raises(ValueError, match="rim of the mapped space"):
        cast_panorama(volume.arrays(), table, RULES, field, (0, 0, 10))

"""Choosing where to look from sums over directions."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ippon.guidance.levels import Level, LevelProbabilities
from ippon.mapping.arrays import OCCUPIED
from ippon.planning.visibility.panorama import Panorama
from ippon.planning.visibility.view_table import build_orientations, build_view_table
from ippon.planning.visibility.viewpoint_gain import (
    choose_view,
    frame_object,
    imagined_level,
    recount_levels,
    sum_views,
)
from ippon.robot import ZED
from tests.reference import planning_view as reference

PROBABILITIES = LevelProbabilities().as_array()
NOTHING = np.zeros(10, np.float32)
NO_CUE = np.zeros(10, np.bool_)
FRAMING = {"hold": 0.05, "centre_weight": 0.01}


def chosen(sums, *, probabilities=PROBABILITIES, far_evidence_nat=NOTHING, cued=NO_CUE):
    return choose_view(sums, probabilities, 10, far_evidence_nat, cued, np.ones(10, np.float32))


@pytest.fixture(scope="module")
def table():
    return build_view_table(
        yaw_bins=40, pitch_low=-1.6, pitch_high=0.87, range_voxels=4.0, layer_low=-3, layer_high=3
    )


@pytest.fixture(scope="module")
def orientations(table):
    return build_orientations(table, ZED, 4, 5)


def empty(table) -> Panorama:
    shape = (table.pitch_bins, table.yaw_bins)
    image = np.zeros(shape, dtype=np.float32)
    return Panorama(
        known=image.copy(),
        unknown=image.copy(),
        ooi=image.copy(),
        behind=image.copy(),
        levels=np.zeros((table.yaw_bins, 4), dtype=np.int32),
        labelled=np.zeros(0, dtype=np.int32),
        depth=image.copy(),
    )


def test_sums_equal_adding_up_each_image(table, orientations):
    rng = np.random.default_rng(4)
    panorama = empty(table)
    panorama.known[:] = rng.random(panorama.known.shape)
    panorama.unknown[:] = rng.random(panorama.known.shape)
    panorama.ooi[:] = rng.integers(0, 3, panorama.known.shape)
    panorama.behind[:] = rng.integers(0, 3, panorama.known.shape)
    panorama.levels[:] = rng.integers(0, 9, panorama.levels.shape)
    sums = sum_views(panorama, orientations, 4)
    for a in range(len(orientations.yaws)):
        for b in range(len(orientations.tilts)):
            for name in ("known", "unknown", "framed"):
                expected = reference.window(getattr(panorama, name), orientations, a, b)
                summed = getattr(sums, "ooi" if name == "framed" else name)
                assert summed[a, b] == pytest.approx(expected, rel=1e-5)
        columns = [(a * 4 + d) % table.yaw_bins for d in range(-4, 5)]
        np.testing.assert_array_equal(sums.levels[a], panorama.levels[columns].sum(axis=0))


# The first example may wait for a kernel.
@settings(deadline=None)
@given(st.lists(st.integers(0, 30), min_size=4, max_size=4))
def test_the_highest_ranking_level_that_is_not_empty_is_taken(counts):
    order = [Level.CERTAIN, Level.FAR, Level.NEAR]
    expected = next((level for level in order if counts[level] >= 10), Level.AVERAGE)
    assert imagined_level(np.array(counts, dtype=np.int32), 10) == expected


def test_unknown_space_by_a_promising_object_is_worth_more(table, orientations):
    panorama = empty(table)
    middle = table.pitch_bins // 2
    panorama.unknown[middle, 5] = 10.0
    panorama.unknown[middle, 25] = 8.0
    panorama.levels[:, Level.AVERAGE] = 50
    choice = chosen(sum_views(panorama, orientations, 4))
    assert choice.gain == pytest.approx(10.0 * PROBABILITIES[Level.AVERAGE])
    panorama.levels[25, Level.NEAR] = 30
    choice = chosen(sum_views(panorama, orientations, 4))
    assert choice.level == Level.NEAR
    assert choice.gain == pytest.approx(8.0 * PROBABILITIES[Level.NEAR])
    assert choice.potential == pytest.approx(10.0 * PROBABILITIES[Level.AVERAGE])
    off = orientations.yaws[choice.heading] - 25.5 * table.bin_rad
    assert abs(math.remainder(off, 2 * math.pi)) < ZED.horizontal_fov_rad / 2
    assert choice.by_heading.max() == pytest.approx(choice.gain)


def test_other_probabilities_change_the_gain_of_the_same_sums(table, orientations):
    panorama = empty(table)
    panorama.unknown[:] = 1.0
    panorama.known[table.pitch_bins // 2, 3] = 2.0
    sums = sum_views(panorama, orientations, 4)
    gains = [chosen(sums, probabilities=p * np.ones(4, np.float32)).gain for p in (0.0, 0.1, 0.5)]
    assert gains[0] == pytest.approx(2.0)
    assert gains[0] < gains[1] < gains[2]


def test_what_images_show_from_afar_raises_p_img_of_that_heading_alone(table, orientations):
    panorama = empty(table)
    panorama.unknown[table.pitch_bins // 2, :] = 1.0
    sums = sum_views(panorama, orientations, 4)
    before = chosen(sums)
    far_evidence_nat = NOTHING.copy()
    heading = (before.heading + 5) % len(far_evidence_nat)
    far_evidence_nat[heading] = 2.0
    choice = chosen(sums, far_evidence_nat=far_evidence_nat)
    assert choice.heading == heading
    assert choice.gain / before.by_heading[heading] == pytest.approx(math.exp(2.0))
    others = np.delete(np.arange(len(far_evidence_nat)), heading)
    np.testing.assert_array_equal(choice.by_heading[others], before.by_heading[others])
    assert choice.potential == before.potential, "what ends a search is not moved by it"


def test_a_cue_from_afar_makes_that_heading_certain(table, orientations):
    panorama = empty(table)
    panorama.unknown[table.pitch_bins // 2, :] = 1.0
    panorama.levels[:, Level.FAR] = 50
    sums = sum_views(panorama, orientations, 4)
    cued = NO_CUE.copy()
    cued[7] = True
    choice = chosen(sums, cued=cued)
    assert (choice.heading, choice.level) == (7, Level.CERTAIN)
    ratio = PROBABILITIES[Level.CERTAIN] / PROBABILITIES[Level.FAR]
    assert choice.gain / chosen(sums).by_heading[7] == pytest.approx(ratio, rel=1e-4)
    assert choice.potential == chosen(sums).potential


def test_an_object_is_framed_whole_and_in_the_middle(table, orientations):
    panorama = empty(table)
    for row in range(table.pitch_bins):
        pitch = table.pitch_low + (row + 0.5) * table.bin_rad
        if -0.6 < pitch < -0.2:
            panorama.ooi[row, [38, 39, 0, 1]] = 1.0
    sums = sum_views(panorama, orientations, 4)
    framed = frame_object(sums, panorama, orientations, table, **FRAMING)
    assert framed is not None
    yaw, tilt = framed
    assert abs(math.remainder(yaw, 2 * math.pi)) <= 0.5 * 4 * table.bin_rad + 1e-9
    assert -0.7 < tilt < -0.1
    assert sums.ooi.max() == panorama.ooi.sum(), "one image holds it all"


def test_a_framing_stays_while_a_voxel_comes_and_goes(table, orientations):
    """The camera used to turn to and fro between two headings until time was up."""

    def framed(columns, before=None):
        panorama = empty(table)
        panorama.ooi[table.pitch_bins // 2, columns] = 1.0
        sums = sum_views(panorama, orientations, 4)
        return frame_object(sums, panorama, orientations, table, before, **FRAMING)

    few, more, moved = [1, 2], [2, 3], [12, 13]
    assert framed(few) != framed(more), "by themselves they are framed by two headings"
    assert framed(more, framed(few)) == framed(few)
    assert framed(few, framed(more)) == framed(more)
    assert framed(moved, framed(few)) == framed(moved), "what is out of sight is turned to"


def test_without_an_object_there_is_nothing_to_frame(table, orientations):
    panorama = empty(table)
    sums = sum_views(panorama, orientations, 4)
    assert frame_object(sums, panorama, orientations, table, **FRAMING) is None


def test_levels_are_counted_again_without_a_ray(dense_map, table):
    volume = dense_map((1.6, 1.6, 1.6))
    volume.fill((0.2, 0.2, 0.2), (0.4, 0.4, 0.4), OCCUPIED, ooi=0.0, level=Level.AVERAGE)
    camera = (4, 4, 2)
    seen = np.arange(len(table.offset), dtype=np.int32)
    inside = ((table.offset + camera >= 2) & (table.offset + camera < 4)).all(axis=1)
    direction = np.repeat(np.arange(len(table.rays)), np.diff(table.start))
    columns = np.bincount(direction[inside] % table.yaw_bins, minlength=table.yaw_bins)
    assert columns.sum() == 8
    for level in (Level.AVERAGE, Level.CERTAIN):
        volume.fill((0.2, 0.2, 0.2), (0.4, 0.4, 0.4), OCCUPIED, ooi=0.0, level=level)
        counts = recount_levels(volume.arrays(), table, camera, seen)
        np.testing.assert_array_equal(counts[:, level], columns)
        assert counts.sum() == 8, "voxels without a label do not count"
    assert recount_levels(volume.arrays(), table, camera, seen[~inside]).sum() == 0

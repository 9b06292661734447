"""Choosing where to look from sums over directions."""

import math

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from ippon.guidance.levels import Level, LevelProbabilities
from ippon.mapping.arrays import OCCUPIED
from ippon.planning.visibility.panorama import Panorama
from ippon.planning.visibility.view_table import (
    Orientations,
    build_orientations,
    build_view_table,
)
from ippon.planning.visibility.viewpoint_gain import (
    ViewSums,
    choose_view,
    frame_object,
    imagined_level,
    recount_levels,
    sum_views,
)
from ippon.robot import ZED
from tests.reference import planning_gain as plain
from tests.reference import planning_view as reference

PROBABILITIES = LevelProbabilities().as_array()
NOTHING = np.zeros(10, np.float32)
NO_CUE = np.zeros(10, np.bool_)
FRAMING = {"hold": 0.05, "centre_weight": 0.01}


def chosen(sums, *, probabilities=PROBABILITIES, far_evidence_nat=NOTHING, cued=NO_CUE):
    ones = np.ones(10, np.float32)
    return choose_view(sums, probabilities, 10, far_evidence_nat, cued, ones, ones)


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


def test_every_width_of_an_image_is_summed(table):
    columns = table.yaw_bins
    widths = np.array([-1, 0, 1, 2, columns // 2 - 1, columns // 2, 3 * columns])
    orientations = Orientations(
        yaws=np.arange(0, columns, 5) * table.bin_rad,
        tilts=np.array([-0.3, 0.1]),
        half_width=np.random.default_rng(8).choice(widths, (2, table.pitch_bins)),
        stride=5,
    )
    panorama = empty(table)
    panorama.known[:] = np.random.default_rng(9).random(panorama.known.shape)
    panorama.levels[:] = np.random.default_rng(9).integers(0, 9, panorama.levels.shape)
    sums = sum_views(panorama, orientations, 3)
    for a, b in np.ndindex(8, 2):
        expected = reference.window(panorama.known, orientations, a, b)
        assert sums.known[a, b] == pytest.approx(expected, rel=1e-5)
    assert (sums.ooi == 0.0).all()


amounts = st.integers(0, 8).map(lambda n: n / 16)
per_heading = st.tuples(
    st.lists(amounts, min_size=6, max_size=6),
    st.lists(st.integers(0, 20), min_size=4, max_size=4),
    st.sampled_from((0.0, 1.0, -1.0, 0.7)),
    st.booleans(),
    st.sampled_from((0.0, 0.5, 1.0)),
    st.sampled_from((0.02, 1.0)),
)


@settings(max_examples=60, deadline=None)
@given(st.lists(per_heading, min_size=1, max_size=5))
def test_the_gain_is_that_of_equation_3(headings):
    known, levels, nat, cued, weights, painted = zip(*headings, strict=True)
    both = np.array(known, np.float32)
    sums = ViewSums(
        known=np.ascontiguousarray(both[:, :3]),
        unknown=np.ascontiguousarray(both[:, 3:]),
        ooi=np.zeros((len(headings), 3), np.float32),
        levels=np.array(levels, np.int32),
    )
    rules = (
        np.array([0.02, 0.1, 0.25, 0.6], np.float32),
        10,
        np.array(nat, np.float32),
        np.array(cued),
        np.array(weights, np.float32),
        np.array(painted, np.float32),
    )
    gains, level, potential = plain.gains(sums, *rules)
    choice = choose_view(sums, *rules)
    assert choice.gain == pytest.approx(gains.max(), abs=1e-6)
    assert choice.by_heading == pytest.approx(gains.max(axis=1), abs=1e-6)
    assert choice.potential == pytest.approx(potential, abs=1e-6)
    assert gains[choice.heading, choice.tilt] == pytest.approx(gains.max(), abs=1e-6)
    assert choice.level == level[choice.heading]


@pytest.mark.parametrize("gain", [0.0, 0.25])
def test_of_equal_gains_the_first_is_taken(gain):
    same = np.full((10, 3), gain, np.float32)
    levels = np.tile(np.array([0, 0, 20, 0], np.int32), (10, 1))
    choice = chosen(ViewSums(known=same, unknown=0.0 * same, ooi=0.0 * same, levels=levels))
    assert (choice.heading, choice.tilt, choice.level) == (0, 0, Level.NEAR)
    assert choice.gain == choice.potential == gain
    assert choice.by_heading.tolist() == [gain] * 10


# The first example may wait for a kernel.
@settings(deadline=None)
@given(st.lists(st.integers(0, 30), min_size=4, max_size=4))
def test_the_highest_ranking_level_that_is_not_empty_is_taken(counts):
    for minimum in (10, *counts):
        expected = plain.imagined_level(counts, minimum)
        assert imagined_level(np.array(counts, dtype=np.int32), minimum) == expected


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


@settings(
    max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(
    cells=st.lists(
        st.tuples(st.integers(0, 15), st.integers(0, 39), st.integers(1, 5)),
        min_size=1,
        max_size=6,
    ),
    before=st.none() | st.tuples(st.floats(0.0, 6.28), st.floats(-1.5, 0.8)),
    hold=st.sampled_from((0.0, 0.1, 0.5)),
    centre_weight=st.sampled_from((0.0, 0.01, 0.3)),
)
def test_the_framing_is_the_one_with_the_highest_score(
    table, orientations, cells, before, hold, centre_weight
):
    panorama = empty(table)
    for row, column, count in cells:
        panorama.ooi[row % table.pitch_bins, column] += count
    scores = plain.framing_scores(panorama, orientations, table, centre_weight)
    total = panorama.framed.sum()
    sums = sum_views(panorama, orientations, 4)
    framed = frame_object(
        sums, panorama, orientations, table, before, hold=hold, centre_weight=centre_weight
    )
    assert framed is not None
    a = int(np.abs(orientations.yaws - framed[0]).argmin())
    b = int(np.abs(orientations.tilts - framed[1]).argmin())
    assert framed == (orientations.yaws[a], orientations.tilts[b])
    if before is None:
        assert scores[a, b] == pytest.approx(scores.max(), abs=1e-4)
        return
    kept = (
        int(np.abs(orientations.yaws - before[0]).argmin()),
        int(np.abs(orientations.tilts - before[1]).argmin()),
    )
    margin = scores[kept] - (scores.max() - hold * total)
    if margin > 1e-4:
        assert (a, b) == kept
    elif margin < -1e-4:
        assert scores[a, b] == pytest.approx(scores.max(), abs=1e-4)


def test_of_two_equal_framings_the_present_one_stays(table, orientations):
    panorama = empty(table)
    panorama.ooi[table.pitch_bins // 2, 20] = 1.0
    sums = sum_views(panorama, orientations, 4)
    equal = np.argwhere(sums.ooi == 1.0)
    assert len(equal) > 1
    for a, b in equal:
        before = float(orientations.yaws[a]), float(orientations.tilts[b])
        rules = {"hold": 0.0, "centre_weight": 0.0}
        assert frame_object(sums, panorama, orientations, table, before, **rules) == before


def test_an_object_halfway_between_two_headings_stays_in_either(table, orientations):
    panorama = empty(table)
    panorama.ooi[table.pitch_bins // 2, 2] = 1.0
    sums = sum_views(panorama, orientations, 4)
    tilt = float(orientations.tilts[2])
    for a in (0, 1):
        before = float(orientations.yaws[a]), tilt
        framed = frame_object(
            sums, panorama, orientations, table, before, hold=0.1, centre_weight=5.0
        )
        assert framed is not None
        assert framed[0] == before[0]


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


@pytest.mark.parametrize("seed", range(2))
def test_levels_counted_again_equal_asking_each_voxel(speckled, table, seed):
    volume = speckled(seed)
    # Views reach the first block and one that was dropped since.
    volume.missing[:2, :2, :2] = False
    volume.missing[1, 0, 1] = True
    # What the last block holds is not counted in place of that one.
    volume.level[-8:, -8:, -8:] = Level.NEAR
    arrays = volume.arrays()
    camera = tuple(int(c) for c in arrays.origin_block * 8 + (8, 7, 8))
    some = np.random.default_rng(seed).random(len(table.offset)) < 0.5
    some[: table.start[1]] = True
    labelled = np.flatnonzero(some).astype(np.int32)
    expected = plain.recount(arrays, table, camera, labelled)
    assert expected.sum() > 0
    np.testing.assert_array_equal(recount_levels(arrays, table, camera, labelled), expected)

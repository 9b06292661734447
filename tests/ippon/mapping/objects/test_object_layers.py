"""New objects, new levels and rejected places, against the plain twins."""

import math

import numpy as np
import pytest

from ippon.mapping.arrays import NOT_MAPPED
from ippon.mapping.config import MapConfig
from ippon.mapping.objects.posterior_arithmetic import LOG_ODDS_MAX, ooi_code
from ippon.mapping.voxel_map import VoxelMap
from ippon.mission.explanation import label_census
from ippon.observation import Heatmap
from tests.reference import object_layers as plain

LABELS = ("wall", "floor", "chair", "sofa")
LEVELS = np.array([0, 1, 3, 2], np.uint8)
PROBABILITIES = np.array([0.02, 0.1, 0.25, 0.6], np.float32)


@pytest.fixture
def voxel_map(tools):
    """A room seen with random, but repeated, heatmaps."""
    rng = np.random.default_rng(4)
    world = tools.World.room(3.0, 3.0)
    result = VoxelMap(MapConfig(memory_limit_mb=64.0), LABELS)
    result.set_ooi("hat")
    for n in range(12):
        p = rng.integers(0, 256, (15, 20, len(LABELS) + 1), dtype=np.uint8)
        heatmap = Heatmap(labels=LABELS, ooi="hat", probabilities=p)
        pose = tools.look(1.5, 1.5, 1.2, 2.4 * (n // 2), -0.4)
        result.integrate(world.frame(pose, stamp_ns=n * 10**9, heatmap=lambda _, h=heatmap: h))
    assert len(plain.labelled(result)) > 1000
    return result


def test_a_common_object_starts_from_its_label(voxel_map):
    voxel_map.set_ooi("chair")
    best = np.zeros(len(voxel_map._pools.best_ooi), int)
    for slot, block, column in plain.labelled(voxel_map):
        expected = plain.log_odds_of_label(voxel_map, slot, 2)
        assert voxel_map.surface.log_odds[slot] == pytest.approx(expected, abs=2e-3)
        code = int(voxel_map._pools.ooi[voxel_map._pools.slab[block], column])
        assert code == ooi_code(voxel_map.surface.log_odds[slot])
        best[block] = max(best[block], code)
    assert (best == voxel_map._pools.best_ooi).all()


def test_another_object_starts_from_nothing(voxel_map):
    voxel_map.set_ooi("keys")
    assert (voxel_map.arrays().ooi == NOT_MAPPED).all()
    assert voxel_map.best_ooi() == 0.0
    prior = -np.log(len(LABELS))
    for slot, _, _ in plain.labelled(voxel_map):
        assert voxel_map.surface.log_odds[slot] == pytest.approx(prior, abs=1e-6)


def test_levels_and_proximity(voxel_map):
    voxel_map.set_levels(LEVELS, PROBABILITIES)
    rows, pools = voxel_map.surface, voxel_map._pools
    for slot, block, column in plain.labelled(voxel_map):
        q = plain.posterior(voxel_map, slot)
        assert rows.label[slot] == int(np.argmax(q))
        assert pools.level[pools.slab[block], column] == LEVELS[int(np.argmax(q))]
        assert rows.confidence[slot] == pytest.approx(254 * q.max(), abs=0.51)
        expected = plain.proximity(voxel_map, slot, PROBABILITIES[LEVELS])
        assert rows.proximity[slot] == pytest.approx(254 * expected, abs=0.51)


def test_the_same_levels_change_no_block(voxel_map):
    voxel_map.set_levels(LEVELS, PROBABILITIES)
    pools, before = voxel_map._pools, voxel_map.revision
    voxel_map.set_levels(LEVELS, PROBABILITIES)
    assert voxel_map.revision == before + 1
    assert pools.appearance.max() <= before
    assert pools.revision.max() <= before


def test_another_level_marks_the_blocks_that_show_it(voxel_map):
    voxel_map.set_levels(LEVELS, PROBABILITIES)
    pools, before = voxel_map._pools, voxel_map.revision
    was = pools.level.copy(), voxel_map.surface.proximity.copy()
    chair_is_far = np.array([0, 1, 0, 2], np.uint8)
    voxel_map.set_levels(chair_is_far, PROBABILITIES)
    expected = {
        block
        for slot, block, column in plain.labelled(voxel_map)
        if was[0][pools.slab[block], column] != pools.level[pools.slab[block], column]
        or was[1][slot] != voxel_map.surface.proximity[slot]
    }
    assert set(np.flatnonzero(pools.appearance > before).tolist()) == expected
    assert expected


def test_a_rejected_place(voxel_map):
    ball, radius = np.array([1.0, 1.0, 0.0]), 0.8
    before = voxel_map.surface.log_odds.copy()
    voxel_map.suppress_ooi(ball, radius)
    inside = 0
    for slot, block, column in plain.labelled(voxel_map):
        away = float(np.linalg.norm(plain.center(voxel_map, block, column) - ball))
        if abs(away - radius) < 1e-9:
            continue
        expected = -LOG_ODDS_MAX if away < radius else float(before[slot])
        assert voxel_map.surface.log_odds[slot] == expected
        inside += away < radius
    assert inside > 50


def test_a_place_is_taken_back_as_it_was(voxel_map):
    def state():
        arrays = voxel_map.arrays()
        return [
            voxel_map.surface.log_odds.copy(),
            arrays.ooi.copy(),
            voxel_map._pools.best_ooi[: len(arrays.state)].copy(),
        ]

    before, revision = state(), voxel_map.revision
    ruled_out = voxel_map.suppress_ooi(np.array([1.0, 1.0, 0.0]), 0.8)
    assert len(ruled_out.voxel) > 50
    other = voxel_map.suppress_ooi(np.array([2.5, 2.5, 0.0]), 0.3)
    voxel_map.restore_ooi(ruled_out)
    voxel_map.restore_ooi(other)
    for was, now in zip(before, state(), strict=True):
        np.testing.assert_array_equal(was, now)
    assert voxel_map.revision == revision + 4
    changed = voxel_map._pools.revision[: len(voxel_map.arrays().state)]
    assert (changed == revision + 3).any()
    again = voxel_map.suppress_ooi(np.array([1.0, 1.0, 0.0]), 0.8)
    np.testing.assert_array_equal(again.log_odds, ruled_out.log_odds)
    nowhere = voxel_map.suppress_ooi(np.array([90.0, 90.0, 0.0]), 0.5)
    assert len(nowhere.voxel) == 0
    voxel_map.restore_ooi(nowhere)


@pytest.mark.parametrize("first", [0, 1])
def test_places_that_overlap_are_taken_back_in_any_order(voxel_map, first):
    before = voxel_map.surface.log_odds.copy()
    balls = [(np.array([x, 1.0, 0.0]), 0.8) for x in (1.0, 1.6)]
    ruled_out = [voxel_map.suppress_ooi(*ball) for ball in balls]
    voxel_map.restore_ooi(ruled_out[first])
    for slot, block, column in plain.labelled(voxel_map):
        away = np.linalg.norm(plain.center(voxel_map, block, column) - balls[1 - first][0])
        if away < 0.8 - 1e-6:
            assert voxel_map.surface.log_odds[slot] == -LOG_ODDS_MAX, "the other one stays"
    voxel_map.restore_ooi(ruled_out[1 - first])
    after = voxel_map.surface.log_odds
    changed = np.flatnonzero(after != before)
    prior = -np.log(len(LABELS))
    # What lies in both was set aside twice: only the first of the two knew its values. Where that
    # was taken back before the other, images count again.
    assert (len(changed) > 0) == (first == 0)
    assert after[changed] == pytest.approx(prior, abs=1e-6)
    assert not voxel_map.surface.ooi_places[changed].any()


def test_surface_that_changed_while_suppressed_is_reset_or_stays_removed(voxel_map):
    ball = np.array([1.0, 1.0, 0.0])
    ruled_out = voxel_map.suppress_ooi(ball, 0.8)
    half = len(ruled_out.voxel) // 2
    known = ruled_out._replace(
        voxel=np.concatenate([ruled_out.voxel[:half], [[40, 40, 40]]]),
        log_odds=np.append(ruled_out.log_odds[:half], np.float32(3.0)),
        code=np.append(ruled_out.code[:half], np.uint8(242)),
        places=np.append(ruled_out.places[:half], np.uint64(0)),
    )
    voxel_map.restore_ooi(known)
    again = voxel_map.suppress_ooi(ball, 0.8)
    np.testing.assert_array_equal(again.log_odds[:half], ruled_out.log_odds[:half])
    np.testing.assert_array_equal(again.code[:half], ruled_out.code[:half])
    assert again.log_odds[half:] == pytest.approx(-np.log(len(LABELS)), abs=1e-6)
    assert (again.code[half:] == NOT_MAPPED).all(), "no image has said anything of it"


def highest_ooi_m(voxel_map):
    return max(
        plain.center(voxel_map, block, column)[2]
        for slot, block, column in plain.labelled(voxel_map)
        if voxel_map.surface.log_odds[slot] > -LOG_ODDS_MAX
    )


@pytest.mark.parametrize("ooi", ["hat", LABELS[0]])
def test_nothing_is_the_object_higher_than_it_can_be(tools, voxel_map, ooi):
    voxel_map.set_ooi(ooi)
    assert highest_ooi_m(voxel_map) > 1.5
    voxel_map.set_ooi(ooi, highest_m=1.0)
    world = tools.World.room(3.0, 3.0)
    p = np.full((15, 20, len(LABELS) + (ooi == "hat")), 200, np.uint8)
    heatmap = Heatmap(labels=LABELS, ooi=ooi, probabilities=p)
    pose = tools.look(1.5, 1.5, 1.2, 0.4, 0.0)
    voxel_map.integrate(world.frame(pose, stamp_ns=20 * 10**9, heatmap=lambda _: heatmap))
    if ooi == "hat":
        seen = voxel_map.arrays().ooi != NOT_MAPPED
        assert (voxel_map.arrays().ooi[seen] == ooi_code(-LOG_ODDS_MAX)).any()
        assert (voxel_map.arrays().ooi[seen] > ooi_code(-LOG_ODDS_MAX)).any()
    mapped = [
        (plain.center(voxel_map, block, column)[2], voxel_map.surface.log_odds[slot])
        for slot, block, column in plain.labelled(voxel_map)
        if voxel_map._pools.ooi[voxel_map._pools.slab[block], column] != NOT_MAPPED
    ]
    assert all(odds == -LOG_ODDS_MAX for z, odds in mapped if z > 1.0)
    with pytest.raises(ValueError, match="more than 0; got -1"):
        voxel_map.set_ooi(ooi, highest_m=-1.0)
    with pytest.raises(ValueError, match=r"below highest_m; got 1\.0 and"):
        voxel_map.set_ooi(ooi, highest_m=1.0, lowest_m=1.0)


@pytest.mark.slow
@pytest.mark.parametrize("lowest_m", [0.0, 0.1])
@pytest.mark.parametrize("ooi", ["hat", LABELS[0]])
def test_the_floor_is_not_an_object_on_it(tools, voxel_map, ooi, lowest_m):
    def odds_of_floor_and_rest():
        floor, rest = [], []
        for slot, block, column in plain.labelled(voxel_map):
            if voxel_map._pools.ooi[voxel_map._pools.slab[block], column] != NOT_MAPPED:
                low = plain.center(voxel_map, block, column)[2] < lowest_m
                (floor if low else rest).append(voxel_map.surface.log_odds[slot])
        return np.array(floor), np.array(rest)

    world = tools.World.room(3.0, 3.0)
    p = np.full((15, 20, len(LABELS) + (ooi == "hat")), 200, np.uint8)
    heatmap = Heatmap(labels=LABELS, ooi=ooi, probabilities=p)
    for stamp, begins_m in enumerate((-math.inf, lowest_m), start=20):
        voxel_map.set_ooi(ooi, lowest_m=begins_m)
        for step in range(2):
            pose = tools.look(1.5, 1.5, 1.2, 0.4, -0.6 * step)
            ns = (2 * stamp + step) * 10**9
            voxel_map.integrate(world.frame(pose, stamp_ns=ns, heatmap=lambda _: heatmap))
        floor, rest = odds_of_floor_and_rest()
        assert len(floor) > 20
        assert (floor == -LOG_ODDS_MAX).all() == (begins_m == lowest_m)
        assert (rest > -LOG_ODDS_MAX).sum() > 20
    # Another floor, below: what stands there stays what it is.
    voxel_map._integrator.floor_z_m = 1.0
    voxel_map.set_ooi(ooi, lowest_m=lowest_m)
    if ooi != "hat":
        assert (odds_of_floor_and_rest()[0] > -LOG_ODDS_MAX).any()


@pytest.mark.parametrize(
    ("levels", "probabilities", "problem"),
    [
        (LEVELS[:2], PROBABILITIES, "one for each of 4 labels"),
        (np.array([0, 1, -1, 2]), PROBABILITIES, "0 to 3; got -1 to 2"),
        (np.array([0, 1, 1.5, 2]), PROBABILITIES, "0 to 3"),
        (LEVELS, np.array([0.0, 0.1, np.nan, 0.5], np.float32), r"in \[0, 1\]"),
    ],
)
def test_levels_that_mean_nothing_are_refused(levels, probabilities, problem):
    voxel_map = VoxelMap(MapConfig(memory_limit_mb=64.0), LABELS)
    with pytest.raises(ValueError, match=problem):
        voxel_map.set_levels(levels, probabilities)
    assert voxel_map.revision == 0


def test_one_text_is_no_list_of_labels():
    with pytest.raises(TypeError, match="got the single string 'chair'"):
        VoxelMap(MapConfig(), "chair")


def test_surface_for_which_no_row_was_left_counts_for_no_label(tools):
    voxel_map = VoxelMap(MapConfig(memory_limit_mb=64.0), LABELS)
    voxel_map.integrate(tools.World.room().frame(tools.tour([(1.0, 1.0)])[0]))
    voxel_map.surface_slots[:] = 0
    assert label_census(voxel_map, np.array([1.0, 1.0, 0.0]), 5.0).sum() == 0

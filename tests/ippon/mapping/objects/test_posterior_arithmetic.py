"""The filter: against the joint filter, and what must hold of any Bayes filter."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ippon.mapping.arrays import NOT_MAPPED
from ippon.mapping.config import MapConfig
from ippon.mapping.objects.posterior_arithmetic import (
    LOG_ODDS_MAX,
    energy_table,
    exp_of_steps,
    may_be_ooi,
    ooi_code,
    prior_log_odds,
)
from ippon.mapping.objects.surface_voxels import ENERGY_MAX, N_USED, NORM_STEPS, STEPS_PER_NAT
from ippon.mapping.voxel_map import VoxelMap
from ippon.observation import Heatmap
from tests.reference.object_filter import joint_filter, two_part_filter

LABELS = ("wall", "floor", "chair", "table", "sofa")
SMALL = MapConfig(memory_limit_mb=64.0)

# From 70 on, six images reach neither floor, where the filter leaves the joint one.
images = st.lists(
    st.lists(st.integers(70, 255), min_size=len(LABELS) + 1, max_size=len(LABELS) + 1),
    min_size=1,
    max_size=6,
)


@pytest.fixture(scope="module")
def wall_frame(tools):
    world = tools.World([(1.0, -3.0, -3.0, 1.2, 3.0, 3.0)])
    return world.frame(tools.look(0.02, 0.02, 0.02, 0.0))


def observed(wall_frame, pixels, labels=LABELS, ooi="hat", config=SMALL, map_labels=LABELS):
    """Show a map one wall with these heatmap values again and again."""
    voxel_map = VoxelMap(config, map_labels)
    voxel_map.set_ooi(ooi)
    for n, pixel in enumerate(pixels):
        p = np.broadcast_to(np.array(pixel, np.uint8), (15, 20, len(pixel)))
        heatmap = Heatmap(labels=tuple(labels), ooi=ooi, probabilities=np.ascontiguousarray(p))
        voxel_map.integrate(dataclasses.replace(wall_frame, stamp_ns=n, heatmap=heatmap))
    return voxel_map


def posterior(voxel_map):
    """Return q (N,) and L of the first surface row; every voxel saw the same."""
    n = len(voxel_map.labels)
    rows = voxel_map.surface
    energy = rows.energy[1, :n].astype(np.float64) / STEPS_PER_NAT
    q = np.exp(-energy)
    assert rows.log_norm[1] / NORM_STEPS == pytest.approx(np.log(q.sum()), abs=2e-4)
    return q / q.sum(), float(rows.log_odds[1])


def likelihood(pixels):
    return np.maximum(np.array(pixels, np.float64) / 255.0, MapConfig().likelihood_floor)


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(pixels=images)
def test_two_parts_make_the_joint_filter(wall_frame, pixels):
    h = likelihood(pixels)
    joint = joint_filter(h)
    q_plain, log_odds_plain = two_part_filter(h[:, :-1], h[:, -1])
    p_ooi = 1.0 / (1.0 + np.exp(-log_odds_plain))
    assert np.allclose([*(q_plain * (1.0 - p_ooi)), p_ooi], joint, atol=1e-9)
    q, log_odds = posterior(observed(wall_frame, pixels))
    assert q.sum() == pytest.approx(1.0)
    # Every image rounds a label's -log q by less than a step, the most probable one's by nothing.
    bound = len(pixels) / STEPS_PER_NAT
    gap, exact = np.log(q.max() / q), np.log(q_plain.max() / q_plain)
    assert np.abs(gap - exact).max() < 2 * bound
    assert np.abs(np.log(q) - np.log(q_plain)).max() < 2 * bound
    assert log_odds == pytest.approx(
        np.clip(log_odds_plain, -LOG_ODDS_MAX, LOG_ODDS_MAX), abs=bound + 1e-4
    )


@pytest.mark.slow
@settings(max_examples=30, deadline=None)
@given(pixels=images, seed=st.integers(0, 100))
def test_order_of_images_does_not_matter(wall_frame, pixels, seed):
    shuffled = np.random.default_rng(seed).permutation(np.array(pixels)).tolist()
    a, b = observed(wall_frame, pixels), observed(wall_frame, shuffled)
    apart = a.surface.energy[1].astype(int) - b.surface.energy[1].astype(int)
    assert np.abs(apart).max() <= len(pixels)
    bound = 2 * len(pixels) / STEPS_PER_NAT
    assert a.surface.log_odds[1] == pytest.approx(b.surface.log_odds[1], abs=bound)


@pytest.mark.slow
@settings(max_examples=20, deadline=None)
@given(first=images.map(lambda p: p[0]), second=images.map(lambda p: p[0]))
def test_two_images_in_either_order_differ_by_a_step_at_most(wall_frame, first, second):
    a, b = observed(wall_frame, [first, second]), observed(wall_frame, [second, first])
    apart = a.surface.energy[1, :5].astype(int) - b.surface.energy[1, :5].astype(int)
    assert np.abs(apart).max() <= 2
    (q, _), (other, _) = posterior(a), posterior(b)
    assert np.abs(q - other).max() <= 2 / STEPS_PER_NAT


def test_weak_evidence_adds_up(wall_frame):
    # 0.7 % more for the sofa than for the others is a sixth of a step; 400 images make it certain.
    faint = [150, 150, 150, 150, 151, 150]
    q, _ = posterior(observed(wall_frame, [faint] * 400))
    exact, _ = two_part_filter(likelihood([faint[:-1]] * 400), likelihood([faint] * 400)[:, -1])
    assert np.abs(np.log(q) - np.log(exact)).max() < 2 / STEPS_PER_NAT


@pytest.mark.slow
@settings(max_examples=30, deadline=None)
@given(pixels=images, winner=st.integers(0, len(LABELS) - 1))
def test_more_evidence_never_lowers_the_winner(wall_frame, pixels, winner):
    favouring = [100] * (len(LABELS) + 1)
    favouring[winner] = 200
    before, _ = posterior(observed(wall_frame, pixels))
    after, _ = posterior(observed(wall_frame, [*pixels, favouring]))
    assert after[winner] >= before[winner] - 1e-9


def test_a_label_recovers_from_its_floor(wall_frame):
    sure_of_wall = [255, 0, 0, 0, 0, 0]
    sure_of_sofa = [0, 0, 0, 0, 255, 0]
    voxel_map = observed(wall_frame, [sure_of_wall] * 50)
    assert voxel_map.surface.energy[1, 4] == ENERGY_MAX
    voxel_map = observed(wall_frame, [sure_of_wall] * 50 + [sure_of_sofa] * 3)
    assert voxel_map.surface.label[1] == 4
    sure_of_ooi = [0, 0, 0, 0, 0, 255]
    voxel_map = observed(wall_frame, [sure_of_wall] * 50 + [sure_of_ooi] * 4)
    assert voxel_map.best_ooi() > 0.5


@pytest.mark.slow
@settings(max_examples=30, deadline=None)
@given(pixels=images)
def test_a_common_label_as_the_object_of_interest(wall_frame, pixels):
    common = [pixel[:-1] for pixel in pixels]
    h = likelihood(common)
    others = np.delete(h, 2, axis=1)
    expected = two_part_filter(others, h[:, 2])[1]
    voxel_map = observed(wall_frame, common, ooi="chair")
    _, log_odds = posterior(voxel_map)
    assert log_odds == pytest.approx(
        np.clip(expected, -LOG_ODDS_MAX, LOG_ODDS_MAX), abs=len(pixels) / STEPS_PER_NAT + 1e-4
    )
    # Asked for later, the same is read from the common objects.
    later = observed(wall_frame, common, ooi=None)
    assert later.best_ooi() == 0.0
    later.set_ooi("chair")
    q, log_odds = posterior(later)
    wanted = np.clip(np.log(q[2] / max(1.0 - q[2], 1e-9)), -LOG_ODDS_MAX, LOG_ODDS_MAX)
    assert log_odds == pytest.approx(wanted, abs=2e-3)
    # Other voxels were rounded otherwise; the best of them all is what counts.
    best = float(later.surface.log_odds[1 : later.surface.tally[N_USED]].max())
    assert best == pytest.approx(log_odds, abs=2 * len(pixels) / STEPS_PER_NAT)
    assert later.best_ooi() == pytest.approx(1.0 / (1.0 + np.exp(-best)), abs=1 / 254)


def test_a_heatmap_for_another_object_updates_common_objects_only(wall_frame):
    voxel_map = observed(wall_frame, [[10, 200, 10, 10, 10, 10]], ooi="hat")
    voxel_map.set_ooi("keys")
    before = voxel_map.surface.energy[1, :5].copy()
    p = np.full((15, 20, 6), 10, np.uint8)
    p[..., 5] = 250
    heatmap = Heatmap(labels=LABELS, ooi="hat", probabilities=p)
    voxel_map.integrate(dataclasses.replace(wall_frame, stamp_ns=9, heatmap=heatmap))
    assert voxel_map.best_ooi() == 0.0
    assert (voxel_map.arrays().ooi == NOT_MAPPED).all()
    assert np.abs(voxel_map.surface.energy[1, :5].astype(int) - before.astype(int)).max() == 0


def test_labels_in_another_order_or_missing(wall_frame):
    pixels = [[10, 20, 200, 30, 40, 5], [20, 20, 90, 80, 10, 5]]
    straight = observed(wall_frame, pixels)
    turned = observed(
        wall_frame, [p[4::-1] + p[5:] for p in pixels], labels=LABELS[::-1], ooi="hat"
    )
    assert np.array_equal(straight.surface.energy[1], turned.surface.energy[1])
    # A label that the heatmap lacks keeps its share.
    fewer = observed(wall_frame, [p[:4] + p[5:] for p in pixels], labels=LABELS[:4])
    q, _ = posterior(fewer)
    assert q[4] == pytest.approx(0.2, abs=0.2 * 2 / STEPS_PER_NAT)
    h = likelihood([p[:4] for p in pixels])
    assert np.allclose(q[:4] / q[:4].sum(), joint_filter(h), atol=2 / STEPS_PER_NAT)


def test_a_label_added_while_running(wall_frame):
    voxel_map = observed(wall_frame, [[10, 20, 200, 30, 40, 5]])
    before, _ = posterior(voxel_map)
    voxel_map.add_label("lamp")
    q, _ = posterior(voxel_map)
    assert q[5] == pytest.approx(1.0 / 6.0, rel=0.5 / STEPS_PER_NAT)
    assert np.allclose(q[:5] / q[:5].sum(), before, atol=1e-6)
    for n in range(30):
        voxel_map.add_label(f"thing {n}")
    q, _ = posterior(voxel_map)
    assert len(voxel_map.labels) == 36
    assert q.sum() == pytest.approx(1.0)
    with pytest.raises(ValueError, match="'lamp' is already a label"):
        voxel_map.add_label("lamp")


def test_maximum_fusion_keeps_the_highest(wall_frame):
    config = dataclasses.replace(SMALL, fusion="max")
    pixels = [[50, 100, 20, 10, 10, 30], [80, 60, 20, 10, 10, 200], [10, 10, 10, 10, 10, 10]]
    voxel_map = observed(wall_frame, pixels, config=config)
    highest = likelihood(pixels).max(axis=0)
    q, log_odds = posterior(voxel_map)
    assert np.allclose(q, highest[:5] / highest[:5].sum(), atol=0.5 / STEPS_PER_NAT)
    assert 1.0 / (1.0 + np.exp(-log_odds)) == pytest.approx(highest[5], abs=1e-3)


def test_ranges_of_common_objects_and_of_the_ooi_are_separate(tools):
    world = tools.World([(2.0, -3.0, -3.0, 2.2, 3.0, 3.0)])
    frame = world.frame(tools.look(0.02, 0.02, 0.02, 0.0))
    near_ooi = dataclasses.replace(SMALL, ooi_max_range_m=1.5)
    voxel_map = observed(frame, [[200, 10, 10, 10, 10, 10]], config=near_ooi)
    assert (voxel_map.arrays().ooi == NOT_MAPPED).all()
    assert (voxel_map.arrays().level != NOT_MAPPED).any()
    near_common = dataclasses.replace(SMALL, common_max_range_m=1.5)
    voxel_map = observed(frame, [[100, 10, 10, 10, 10, 250]], config=near_common)
    assert voxel_map.best_ooi() > 0.5
    assert (voxel_map.arrays().level == NOT_MAPPED).all()


def test_codes_and_tables():
    assert ooi_code(0.0) == 127
    assert ooi_code(-50.0) == 0
    assert ooi_code(50.0) == 254
    table = energy_table(1.0 / 255.0)
    assert table[255] == 0.0
    assert table[0] == table[1] == pytest.approx(np.log(255.0) * STEPS_PER_NAT)


def test_every_label_and_the_object_are_equally_likely_before_any_image():
    assert prior_log_odds(4, -1) == pytest.approx(-np.log(4))
    assert prior_log_odds(4, 2) == pytest.approx(-np.log(3)), "the object is one of the four"
    assert prior_log_odds(1, 0) == 0.0, "the only label is the object"


def test_the_exponential_is_exact_to_a_millionth():
    codes = np.arange(256)
    found = [exp_of_steps(np.float32(code)) for code in codes]
    assert np.abs(found - np.exp(-codes / STEPS_PER_NAT)).max() < 1e-6


@given(st.integers(-9, 20), st.integers(-5, 5), st.integers(0, 5), st.integers(0, 9))
def test_the_object_is_neither_floor_nor_too_high(layer, low, floor_layers, height):
    bounds = (low, low + floor_layers, low + floor_layers + height)
    in_floor = layer in range(low, low + floor_layers)
    assert may_be_ooi(layer, bounds) == (layer < bounds[2] and not in_floor)


@given(st.floats(-20.0, 20.0), st.floats(0.0, 5.0))
def test_the_code_of_the_object_rises_with_its_log_odds(log_odds, more):
    code = int(ooi_code(log_odds))
    assert code == pytest.approx(254.0 / (1.0 + np.exp(-log_odds)), abs=0.51)
    assert ooi_code(log_odds + more) >= code
    assert code + int(ooi_code(-log_odds)) in (254, 255)

"""One image's update of single voxels, step by step against plain arithmetic."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ippon.mapping.arrays import NOT_MAPPED
from ippon.mapping.config import MapConfig
from ippon.mapping.objects.posterior_arithmetic import LOG_ODDS_MAX
from ippon.mapping.objects.surface_voxels import ENERGY_MAX, N_USED, NO_LABEL, STEPS_PER_NAT
from ippon.observation_model import NOTHING_SAID
from tests.ippon.mapping.objects.single_voxels import (
    LABELS,
    OOI,
    TABLE,
    SingleVoxels,
    centre_of,
    voxel,
)
from tests.reference.place_pooling import place_filter

A, B, C = voxel(3, 5, 7), voxel(7, 0, 2), voxel(0, 6, 1)
SMALL = MapConfig(memory_limit_mb=64.0)
N = len(LABELS)
RATIO = np.exp(TABLE.log_ratios("scores").astype(np.float64))
FLOOR = SMALL.likelihood_floor

pixel = st.lists(st.integers(0, 255), min_size=N + 1, max_size=N + 1)
few = settings(max_examples=15, deadline=None, derandomize=True)


def likelihood(values) -> np.ndarray:
    return np.maximum(np.array(values) / 255.0, FLOOR)


def bounded(log_odds: float) -> float:
    return min(max(log_odds, -LOG_ODDS_MAX), LOG_ODDS_MAX)


def agrees_with_its_codes(cells: SingleVoxels, k: int) -> None:
    """Check what is derived from the energies and the log-odds of a voxel."""
    surface, slot = cells.layers.surface, cells.slot(k)
    p = np.exp(-cells.energy(k) / STEPS_PER_NAT)
    weights = cells.layers.level_probabilities[cells.layers.levels]
    assert cells.log_norm(k) == pytest.approx(np.log(p.sum()), abs=2e-4)
    assert surface.label[slot] == p.argmax()
    assert surface.confidence[slot] == pytest.approx(254.0 * cells.q(k).max(), abs=0.51)
    assert surface.proximity[slot] == pytest.approx(254.0 * weights @ cells.q(k), abs=0.51)
    code = cells.pools.ooi[cells.pools.slab[0], k]
    assert code == pytest.approx(254.0 / (1.0 + np.exp(-cells.log_odds(k))), abs=0.51)


@few
@given(before=st.lists(pixel, max_size=3), last=pixel, other=pixel)
def test_an_image_multiplies_the_papers_posterior_by_its_likelihood(before, last, other):
    cells = SingleVoxels("distribution")
    cells.layers.levels[:] = 0, 1, 2, 3
    for values in before:
        cells.show({A: values, B: other})
    q = cells.q(A) if before else np.full(N, 1.0 / N)
    energy = cells.energy(A) if before else np.zeros(N)
    log_odds = cells.log_odds(A) if before else -np.log(N)
    assert cells.show({B: other, A: last}) == 2
    h = likelihood(last)
    expected = log_odds + np.log(h[N]) - np.log((q * h[:N]).sum())
    assert cells.log_odds(A) == pytest.approx(bounded(expected), abs=5e-4)
    assert cells.energy(A).min() == 0
    gap = energy - STEPS_PER_NAT * np.log(h[:N])
    gap = np.minimum(gap - gap.min(), ENERGY_MAX)
    assert np.abs(cells.energy(A) - gap).max() < 1.0
    agrees_with_its_codes(cells, A)
    agrees_with_its_codes(cells, B)


@few
@given(images=st.lists(st.tuples(st.integers(0, 2), pixel), min_size=1, max_size=5), other=pixel)
def test_images_of_one_place_are_averaged_and_those_of_several_multiplied(images, other):
    cells = SingleVoxels()
    cells.layers.levels[:] = 3, 2, 1, 0
    x, y, z = centre_of(A)
    cameras = ((x - 0.9, y - 0.1, z), (x + 0.1, y + 1.4, z + 0.2), (x - 2.3, y - 0.3, z))
    for place, values in images:
        cells.show({B: other, A: values}, camera_at=cameras[place])
    ratios = RATIO[np.array([values for _, values in images])]
    q, log_odds = place_filter([place for place, _ in images], ratios, -np.log(N))
    assert cells.log_odds(A) == pytest.approx(log_odds, abs=1e-3)
    gap, exact = cells.energy(A), STEPS_PER_NAT * np.log(q.max() / q)
    places = len({place for place, _ in images})
    assert np.abs(gap - exact).max() < (0.52 if places == 1 else places + 0.05)
    agrees_with_its_codes(cells, A)


def test_energies_of_one_place_are_rounded_to_the_nearest_step():
    cells, voxels = SingleVoxels(), range(60)
    values = np.random.default_rng(5).integers(25, 230, (60, N + 1))
    cells.show(dict(zip(voxels, values.tolist(), strict=True)))
    nats = TABLE.log_ratios("scores")[values[:, :N]]
    exact = STEPS_PER_NAT * (nats.max(axis=1, keepdims=True) - nats)
    found = np.array([cells.energy(k) for k in voxels])
    assert np.abs(found - exact).max() < 0.51


@few
@given(
    images=st.lists(pixel, min_size=1, max_size=3),
    order=st.permutations(range(N)),
    kind=st.sampled_from(("scores", "distribution")),
)
def test_the_order_of_the_labels_does_not_matter(images, order, kind):
    plain, turned = SingleVoxels(kind), SingleVoxels(kind)
    labels = tuple(LABELS[j] for j in order)
    for values in images:
        plain.show({A: values})
        turned.show({A: [*(values[j] for j in order), values[N]]}, labels=labels)
    assert turned.energy(A).tolist() == plain.energy(A).tolist()
    assert turned.log_odds(A) == pytest.approx(plain.log_odds(A), abs=1e-5)


def test_a_label_that_the_heatmap_lacks_keeps_its_share():
    cells = SingleVoxels("distribution")
    cells.show({A: [90, 20, 30, 60, 0]})
    q, log_odds = cells.q(A), cells.log_odds(A)
    cells.show({A: [40, 90, 60, 70]}, labels=("picture", "table", "wall"))
    known = np.array([60, 40, 90]) / 255.0
    rest = q[[0, 2, 3]] * known
    mean = rest.sum() / q[[0, 2, 3]].sum()
    assert cells.q(A)[1] == pytest.approx(q[1], rel=1.1 / STEPS_PER_NAT)
    assert cells.q(A)[[0, 2, 3]] == pytest.approx(rest / mean, rel=1.1 / STEPS_PER_NAT)
    # The object's own likelihood is compared with the mean over the labels that were asked for.
    assert cells.log_odds(A) == pytest.approx(log_odds + np.log(70 / 255 / mean), abs=1e-3)


def test_a_heatmap_of_other_labels_alone_changes_nothing():
    cells = SingleVoxels("distribution")
    cells.show({A: [90, 20, 30, 60, 0]})
    before = cells.energy(A)
    cells.show({A: [200, 90]}, labels=("lamp",))
    assert np.abs(cells.energy(A) - before).max() <= 1


def test_new_levels_change_what_is_derived_from_the_labels():
    cells = SingleVoxels("distribution")
    cells.show({A: [90, 20, 30, 60, 0], B: [10, 200, 190, 9, 9]})
    probabilities = np.array([0.1, 0.2, 0.4, 0.8], np.float32)
    cells.layers.set_levels(np.array([3, 1, 0, 2], np.uint8), probabilities, 7)
    for k, level in ((A, 3), (B, 1)):
        agrees_with_its_codes(cells, k)
        assert cells.pools.level[cells.pools.slab[0], k] == level


def test_a_label_without_a_score_has_a_likelihood_ratio_of_one():
    cells = SingleVoxels()
    cells.show({A: [40, 90, 60, 70]}, labels=("picture", "table", "wall"))
    ratio = np.array([RATIO[60], 1.0, RATIO[40], RATIO[90]])
    exact = STEPS_PER_NAT * np.log(ratio.max() / ratio)
    assert np.abs(cells.energy(A) - exact).max() < 0.52


@pytest.mark.parametrize("label", [0, 2])
@few
@given(images=st.lists(pixel, min_size=1, max_size=3))
def test_a_common_label_as_the_object_of_interest_is_no_evidence_against_itself(label, images):
    cells = SingleVoxels("distribution", ooi=LABELS[label])
    log_odds = -np.log(N - 1)
    q = np.full(N, 1.0 / N)
    for values in images:
        h = likelihood(values)
        others = np.delete(q, label) / np.delete(q, label).sum()
        log_odds += np.log(h[label]) - np.log((others * np.delete(h[:N], label)).sum())
        log_odds = bounded(log_odds)
        cells.show({A: values[:N]}, ooi=LABELS[label])
        q = cells.q(A)
        assert cells.log_odds(A) == pytest.approx(log_odds, abs=1e-3)
        log_odds = cells.log_odds(A)


@pytest.mark.parametrize("kind", ["scores", "distribution"])
@pytest.mark.parametrize(
    ("depth_m", "common", "ooi"),
    [(1.5, True, True), (1.51, True, False), (3.0, True, False), (3.01, False, False)],
)
def test_labels_are_updated_within_their_range(kind, depth_m, common, ooi):
    config = dataclasses.replace(SMALL, common_max_range_m=3.0, ooi_max_range_m=1.5)
    cells = SingleVoxels(kind, config)
    cells.show({A: [9, 200, 9, 9, 250]}, depth_m=depth_m)
    assert (cells.layers.surface.label[cells.slot(A)] == 1) == common
    assert (cells.layers.surface.label[cells.slot(A)] == NO_LABEL) == (not common)
    assert (cells.log_odds(A) > 0.0) == ooi
    assert (cells.pools.ooi[cells.pools.slab[0], A] == NOT_MAPPED) == (not ooi)


@pytest.mark.parametrize("kind", ["scores", "distribution"])
@pytest.mark.parametrize(("depth_m", "ooi"), [(3.0, True), (3.01, False)])
def test_the_object_may_have_the_longer_range(kind, depth_m, ooi):
    config = dataclasses.replace(SMALL, common_max_range_m=1.5, ooi_max_range_m=3.0)
    cells = SingleVoxels(kind, config)
    assert cells.show({A: [9, 200, 9, 9, 250]}, depth_m=depth_m) == ooi
    assert cells.layers.surface.label[cells.slot(A)] == NO_LABEL
    assert cells.energy(A).tolist() == [0] * N
    assert (cells.log_odds(A) > 0.0) == ooi


def test_the_first_label_as_the_object_of_interest_has_its_own_scores():
    cells = SingleVoxels(ooi=LABELS[0])
    cells.show({A: [200, 9, 9, 9]}, ooi=LABELS[0])
    assert cells.log_odds(A) == pytest.approx(-np.log(N - 1) + np.log(RATIO[200]), abs=1e-3)


@pytest.mark.parametrize("kind", ["scores", "distribution"])
def test_a_heatmap_for_another_object_says_nothing_of_this_one(kind):
    cells = SingleVoxels(kind)
    assert cells.show({A: [9, 200, 9, 9, 250]}, ooi="keys") == 1
    assert cells.log_odds(A) == pytest.approx(-np.log(N))
    assert cells.energy(A)[1] == 0
    assert cells.energy(A)[0] > 0


@pytest.mark.parametrize(
    ("depth_m", "value", "counts"),
    [(1.0, 5, True), (1.01, 5, False), (1.01, 61, False), (1.01, 66, True), (1.01, 200, True)],
)
def test_an_object_too_small_to_be_missed_is_updated_by_what_speaks_for_it(depth_m, value, counts):
    cells = SingleVoxels()
    focal_length = 0.5 / np.tan(0.5)
    cells.layers.ooi_small_m = 0.05 / focal_length
    cells.show({A: [100] * N + [value]}, depth_m=depth_m)
    assert (cells.log_odds(A) != pytest.approx(-np.log(N))) == counts


def test_an_image_that_says_nothing_of_a_small_object_is_not_averaged():
    cells = SingleVoxels()
    cells.layers.ooi_small_m = 0.01
    cells.show({A: [100] * N + [200]})
    before = cells.log_odds(A)
    cells.show({A: [100] * N + [NOTHING_SAID]})
    assert cells.log_odds(A) == before


@settings(max_examples=8, deadline=None, derandomize=True)
@given(
    balls=st.lists(
        st.tuples(*[st.floats(-0.5, 0.5)] * 3, st.floats(0.05, 0.6)), min_size=1, max_size=2
    ),
    kind=st.sampled_from(("scores", "distribution")),
)
def test_nothing_within_a_suppressed_ball_is_the_object(balls, kind):
    cells = SingleVoxels(kind)
    middle = centre_of(voxel(7, 4, 4))
    cells.layers.suppressed = np.array([(*(middle + b[:3]), b[3]) for b in balls])
    # More than are updated at a time, in two blocks.
    voxels = np.random.default_rng(3).permutation(1024)[:70].tolist()
    cells.show({k: [100] * N + [230] for k in voxels})
    for k in voxels:
        away = np.linalg.norm(cells.layers.suppressed[:, :3] - centre_of(k), axis=1)
        room = away - cells.layers.suppressed[:, 3]
        if np.abs(room).min() > 1e-6:
            assert (cells.log_odds(k) == -LOG_ODDS_MAX) == (room < 0.0).any()


@pytest.mark.parametrize("kind", ["scores", "distribution"])
def test_only_layers_within_the_objects_heights_may_be_it(kind):
    cells = SingleVoxels(kind)
    # The floor is at 0, the block from 0.8 to 1.6 m: layers 0 to 7 have centres at 0.85 to 1.55 m.
    cells.layers.ooi_lowest_m, cells.layers.ooi_highest_m = 1.0, 1.3
    column = {voxel(2, 3, z): [100] * N + [230] for z in range(8)}
    cells.show(column)
    may_be = [cells.log_odds(k) > -LOG_ODDS_MAX for k in column]
    assert may_be == [False] * 2 + [True] * 3 + [False] * 3


@pytest.mark.parametrize("fusion", ["places", "paper", "max"])
@pytest.mark.parametrize("ooi", [OOI, LABELS[1]])
def test_all_voxels_that_show_the_same_are_updated_alike(fusion, ooi):
    config = dataclasses.replace(SMALL, fusion=fusion)
    cells = SingleVoxels("scores", config, ooi=ooi)
    # More than are updated at a time, in two blocks.
    voxels = np.random.default_rng(3).permutation(1024)[:70].tolist()
    values = [60, 90, 30, 80, 70][: N + (ooi == OOI)]
    assert cells.show(dict.fromkeys(voxels, values), ooi=ooi) == 70
    assert len({round(cells.log_odds(k), 4) for k in voxels}) == 1
    assert np.ptp([cells.energy(k) for k in voxels], axis=0).max() <= 1
    for k in voxels:
        assert cells.layers.surface.label[cells.slot(k)] == 1


def test_a_colour_is_a_running_mean_of_eight():
    cells = SingleVoxels()
    row = cells.layers.surface.color
    cells.show({A: [0] * 5}, color=(200, 40, 0), has_heatmap=False)
    assert row[cells.slot(A)].tolist() == [200, 40, 0]
    cells.show({A: [0] * 5}, color=(100, 140, 0), has_heatmap=False)
    assert row[cells.slot(A)].tolist() == [150, 90, 0]
    for _ in range(6):
        cells.show({A: [0] * 5}, color=(150, 90, 0), has_heatmap=False)
    assert cells.layers.surface.color_count[cells.slot(A)] == 8
    for expected in (94, 98, 101):
        cells.show({A: [0] * 5}, color=(150, 122, 0), has_heatmap=False)
        assert row[cells.slot(A)].tolist() == [150, expected, 0]
    assert cells.pools.appearance[0] == cells.revision


@pytest.mark.parametrize("kind", ["scores", "distribution"])
def test_an_image_without_a_heatmap_changes_colours_only(kind):
    cells = SingleVoxels(kind)
    cells.show({A: [9, 200, 9, 9, 250], B: [9] * 5})
    before = cells.energy(A).tolist(), cells.log_odds(A)
    assert cells.show({A: [0] * 5, B: [0] * 5}, color=(9, 9, 9), has_heatmap=False) == 0
    assert (cells.energy(A).tolist(), cells.log_odds(A)) == before
    assert cells.layers.surface.color[cells.slot(B)].tolist() == [5, 5, 5]


@pytest.mark.parametrize("kind", ["scores", "distribution"])
def test_a_block_has_the_revision_of_its_last_image(kind):
    cells = SingleVoxels(kind)
    for _ in range(3):
        cells.show({A: [9, 200, 9, 9, 250]})
        assert cells.pools.appearance[0] == cells.revision


@pytest.mark.parametrize("kind", ["scores", "distribution"])
def test_at_the_limit_of_memory_known_voxels_are_still_updated(kind):
    cells = SingleVoxels(kind)
    cells.show({B: [100] * 5})
    cells.layers.surface.tally[N_USED] = len(cells.layers.surface.voxel)
    assert cells.show({A: [9, 200, 9, 9, 9], B: [9, 200, 9, 9, 9]}, camera_at=(9, 9, 1)) == 1
    assert cells.slot(A) == 0
    assert cells.layers.surface.label[cells.slot(B)] == 1


@pytest.mark.parametrize("kind", ["scores", "distribution"])
def test_one_voxel_out_of_range_does_not_end_the_image(kind):
    cells = SingleVoxels(kind)
    seen = {A: [9, 200, 9, 9, 9], B: [9, 9, 200, 9, 9]}
    cells.show(seen, depth_m=9.0)
    assert cells.layers.surface.color_count[cells.slot(B)] == 1
    cells.show(seen)
    x, y, z = centre_of(A)
    for at in ((x + 1.0, y, z), (x - 1.0, y, z)):
        cells.show({A: seen[A]}, camera_at=at)
    # A was seen from there before, C was not.
    assert cells.show({A: seen[A], C: seen[A]}, camera_at=(x + 1.0, y, z)) == 1 + (
        kind == "distribution"
    )
    assert cells.layers.surface.label[cells.slot(C)] == 1


def test_a_camera_that_shakes_at_the_border_of_two_places_stays_in_one():
    x, y, z = centre_of(A)

    def updated(*degrees: float) -> list[int]:
        """Return whether each image updated the voxel, seen from these headings."""
        cells, angles = SingleVoxels(), np.radians(degrees)
        places = [(x + np.cos(a), y + np.sin(a), z) for a in angles]
        return [cells.show({A: [9] * 5}, camera_at=place) for place in places]

    # A place is 15 to 30 degrees; it is left 5 degrees beyond, and closed from then on.
    assert updated(22, 34.5, 10.5, 22) == [1, 1, 1, 1]
    assert updated(22, 35.5, 25.5, 24.5) == [1, 1, 1, 0]
    assert updated(22, 9.5, 19.5, 20.5) == [1, 1, 1, 0]


@pytest.mark.parametrize("bearing", np.radians([0, 80, 170, 260]))
def test_places_differ_in_distance_and_steepness(bearing):
    middle = centre_of(A)

    def updated(*views: tuple[float, float]) -> list[int]:
        """Return whether each image updated the voxel, seen from (metres, degrees up)."""
        cells = SingleVoxels()
        places = [
            middle
            + away * np.array([np.cos(bearing) * c, np.sin(bearing) * c, np.sin(np.radians(up))])
            for away, up in views
            for c in (np.cos(np.radians(up)),)
        ]
        return [cells.show({A: [9] * 5}, camera_at=tuple(place)) for place in places]

    # Near is up to 2 m; from 60 degrees up or down there is no azimuth. A place is left for good.
    assert updated((1.99, 0), (2.01, 0), (1.99, 0)) == [1, 1, 0]
    assert updated((1.99, 0), (1.0, 0), (1.98, 0)) == [1, 1, 1]
    assert updated((1.0, 59.6), (1.0, 60.4), (1.0, 59.6)) == [1, 1, 0]
    assert updated((1.0, -59.6), (1.0, -60.4), (1.0, -59.6)) == [1, 1, 0]
    assert updated((1.0, 61), (1.0, -61), (1.0, 61)) == [1, 1, 0]
    assert updated((1.0, 10), (1.0, -30), (1.0, 50)) == [1, 1, 1]


def test_weak_evidence_of_the_papers_filter_adds_up():
    cells = SingleVoxels("distribution")
    for _ in range(150):
        cells.show({A: [150, 150, 151, 150, 0]})
    expected = 150 * STEPS_PER_NAT * np.log(151 / 150)
    assert np.abs(cells.energy(A) - np.array([expected, expected, 0, expected])).max() < 2.0


def test_the_highest_likelihood_of_any_image_is_kept():
    cells = SingleVoxels("distribution", dataclasses.replace(SMALL, fusion="max"))
    images = [[50, 100, 20, 10, 30], [80, 60, 20, 10, 200], [10, 10, 10, 10, 10]]
    for values in images:
        cells.show({A: values})
    highest = likelihood(images).max(axis=0)
    exact = STEPS_PER_NAT * np.log(highest[:N].max() / highest[:N])
    assert np.abs(cells.energy(A) - cells.energy(A).min() - exact).max() < 1.01
    assert 1.0 / (1.0 + np.exp(-cells.log_odds(A))) == pytest.approx(highest[N], abs=1e-3)
    agrees_with_its_codes(cells, A)


@pytest.mark.parametrize("ooi", [None, "keys"])
@pytest.mark.parametrize("kind", ["scores", "distribution"])
def test_a_common_label_is_the_object_of_interest_whatever_a_heatmap_was_made_for(kind, ooi):
    cells = SingleVoxels(kind, ooi="door")
    cells.show({A: [9, 200, 9, 9] + [9] * (ooi is not None)}, ooi=ooi)
    assert cells.log_odds(A) > -np.log(N - 1)

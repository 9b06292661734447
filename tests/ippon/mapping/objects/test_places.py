"""Properties of the fusion by places, on a wall that a camera looks at."""

from dataclasses import replace

import numpy as np
import pytest
from numba import njit

from ippon.mapping.arrays import NOT_MAPPED
from ippon.mapping.config import MapConfig
from ippon.mapping.goal_layers.goal_layers import GoalLayers, OoiTarget
from ippon.mapping.objects.places import (
    N_OPENED,
    N_ROWS,
    close_for_labels,
    close_for_ooi,
    make_place_accumulators,
    open_accumulator,
    place_of,
)
from ippon.mapping.objects.surface_voxels import N_USED, NO_LABEL, make_surface_voxels
from ippon.mapping.voxel_map import VoxelMap
from ippon.observation import Heatmap
from ippon.observation_model import (
    NOT_RECOGNISED,
    NOTHING_SAID,
    ObservationModel,
    ObservationModels,
    ScoreTable,
)

LABELS = ("wall", "floor", "cup")


def wall(tools, value, *, y=1.0, n=0):
    """A wall seen from 1.5 m before it, with one score for cup everywhere."""
    world = tools.World.room()

    def heat(seen):
        scores = np.full((*seen.shape, 1), value, np.uint8)
        return Heatmap(labels=("cup",), ooi=None, probabilities=scores, kind="scores", source="x")

    pose = tools.look(2.5, y, 1.2, 0.0)
    return replace(world.frame(pose, stamp_ns=n * 10**8, heatmap=heat), contact=False)


def cup_probability(frames, fusion="places"):
    voxel_map = VoxelMap(MapConfig(fusion=fusion, memory_limit_mb=64.0), LABELS)
    for frame in frames:
        voxel_map.integrate(frame)
    voxel_map.set_ooi("cup")
    arrays = voxel_map.arrays()
    codes = arrays.ooi[1 : int(voxel_map._pools.tally[3])]
    return np.sort(codes[codes != 255].astype(float) / 254.0)


@pytest.mark.slow
def test_a_place_is_one_direction_near_or_far():
    angles = np.radians(np.arange(0.5, 360.0, 1.0))
    places = [place_of(np.cos(a), np.sin(a), 0.2) for a in angles]
    changes = np.count_nonzero(np.diff([*places, places[0]]))
    assert len(set(places)) == 24
    assert changes == 24
    assert all(place_of(3 * np.cos(a), 3 * np.sin(a), 0.2) == p + 1
               for a, p in zip(angles, places, strict=True))  # fmt: skip
    assert place_of(0.1, 0.0, 1.0) != place_of(0.1, 0.0, -1.0)
    assert max(place_of(x, y, z) for x in (-9, 0, 9) for y in (-9, 0, 9) for z in (-9, 0, 9)) < 64


def test_a_higher_score_never_makes_a_label_less_probable(tools):
    medians = [np.median(cup_probability([wall(tools, v)])) for v in (0, 1, 13, 64, 90, 128, 255)]
    unseen, unsaid, *scored = medians
    assert unseen < unsaid
    assert scored == sorted(scored)
    assert medians[-1] > 0.9


@pytest.mark.slow
def test_weak_scores_from_one_place_never_make_a_find(tools):
    frames = [wall(tools, 85, n=n) for n in range(40)]
    one, many = cup_probability(frames[:1]), cup_probability(frames)
    assert many.max() < 0.8
    assert many == pytest.approx(one, abs=0.03)


def test_more_places_add_up(tools):
    here = cup_probability([wall(tools, 85)])
    around = cup_probability([wall(tools, 85, y=y, n=n) for n, y in enumerate((0.4, 1.4, 2.4))])
    assert np.median(around) > np.median(here) + 0.1


def test_the_order_of_images_within_a_place_does_not_matter(tools):
    frames = [wall(tools, v, n=n) for n, v in enumerate((0, 150, 90, 1, 110))]
    again = [replace(f, stamp_ns=n * 10**8) for n, f in enumerate(reversed(frames))]
    # Voxels become surface with the second image: the first two count where they are surface.
    assert cup_probability([frames[0], *frames]) == pytest.approx(
        cup_probability([frames[0], *again]), abs=0.05
    )


def test_images_from_a_closed_place_are_ignored(tools):
    there_and_back = [wall(tools, 100, y=1.0), wall(tools, 100, y=2.6, n=1)]
    twice = [*there_and_back, wall(tools, 100, y=1.0, n=2), wall(tools, 100, y=2.6, n=3)]
    once = cup_probability(there_and_back)
    assert np.median(cup_probability(twice)) <= np.median(once) + 0.03


def new_map():
    return VoxelMap(MapConfig(memory_limit_mb=64.0), LABELS)


def asked(frame, ooi, value):
    """The frame with a score for an object of interest beside that of the cup."""
    scores = frame.heatmap.probabilities
    scores = np.concatenate([scores, np.full_like(scores, value)], axis=2)
    return replace(frame, heatmap=replace(frame.heatmap, ooi=ooi, probabilities=scores))


def energies(voxel_map):
    """(M, N) of the voxels that have a label."""
    used = slice(1, int(voxel_map.surface.tally[N_USED]))
    seen = voxel_map.surface.label[used] != NO_LABEL
    return voxel_map.surface.energy[used][seen, : len(voxel_map.labels)].astype(int)


def against_cup(voxel_map):
    return energies(voxel_map)[:, LABELS.index("wall")]


def median_ooi(voxel_map):
    arrays = voxel_map.arrays()
    return float(np.median(arrays.ooi[arrays.ooi != NOT_MAPPED])) / 254.0


def test_another_goal_does_not_count_the_same_place_again_for_the_labels(tools):
    voxel_map = new_map()
    for goal in ("hat", "bag", None, "hat"):
        voxel_map.set_ooi(goal)
        for n in range(3):
            voxel_map.integrate(wall(tools, 100, n=n))
        if goal == "hat" and voxel_map.revision < 6:
            once = against_cup(voxel_map)
    assert once.min() > 0, "the images say cup"
    np.testing.assert_allclose(against_cup(voxel_map), once, atol=1)


def test_a_place_goes_on_when_a_goal_is_set(tools):
    """Two images before the goal and two after it are the four images of one place."""

    def seen(goal_after):
        voxel_map = new_map()
        for n, value in enumerate((150, 150, 60, 60)):
            if n == goal_after:
                voxel_map.set_ooi("hat")
            voxel_map.integrate(wall(tools, value, n=n))
        return against_cup(voxel_map)

    np.testing.assert_array_equal(seen(2), seen(None))


def test_each_object_is_seen_once_from_a_place(tools):
    voxel_map, medians = new_map(), []
    for goal in ("hat", "bag", "hat"):
        voxel_map.set_ooi(goal)
        assert voxel_map.best_ooi() == 0.0
        for n in range(3):
            voxel_map.integrate(asked(wall(tools, 1, n=n), goal, 150))
            medians.append(median_ooi(voxel_map))
    assert medians[0] > 0.5, "what was seen before was no image of the bag, or of this hat"
    assert medians == pytest.approx([medians[0]] * len(medians), abs=0.01)


@pytest.mark.parametrize("several", [False, True])
def test_a_label_that_becomes_the_goal_is_not_seen_again_from_the_same_place(tools, several):
    voxel_map = new_map()
    for n in range(2):
        voxel_map.integrate(wall(tools, 85, n=n))
    voxel_map.set_ooi("cup")
    from_label, most = median_ooi(voxel_map), voxel_map.best_ooi()
    if several:
        GoalLayers(voxel_map, [OoiTarget(label="cup"), OoiTarget(label="hat")])
    assert median_ooi(voxel_map) == from_label
    for n in range(2, 6):
        voxel_map.integrate(wall(tools, 85, n=n))
    assert median_ooi(voxel_map) == pytest.approx(from_label, abs=0.01)
    assert voxel_map.best_ooi() == pytest.approx(most, abs=0.01)
    voxel_map.integrate(wall(tools, 85, y=2.6, n=7))
    assert voxel_map.best_ooi() > most + 0.02, "another place is news"


def test_images_of_the_current_place_still_count_for_a_label_that_becomes_the_goal(tools):
    voxel_map = new_map()
    for n in range(2):
        voxel_map.integrate(wall(tools, 85, n=n))
    voxel_map.set_ooi("cup")
    before = median_ooi(voxel_map)
    for n in range(2, 12):
        voxel_map.integrate(wall(tools, 1, n=n))
    assert median_ooi(voxel_map) < before - 0.1, "the mean over the place has fallen"


def test_a_place_taken_back_is_not_counted_twice(tools):
    voxel_map = new_map()
    voxel_map.set_ooi("hat")
    for n in range(2):
        voxel_map.integrate(asked(wall(tools, 1, n=n), "hat", 85))
    before = voxel_map.best_ooi()
    ruled_out = voxel_map.suppress_ooi(np.array([4.0, 1.0, 1.2]), 3.0)
    voxel_map.integrate(asked(wall(tools, 1, y=2.6, n=2), "hat", 85))
    voxel_map.restore_ooi(ruled_out)
    voxel_map.integrate(asked(wall(tools, 1, n=3), "hat", 85))
    assert voxel_map.best_ooi() == pytest.approx(before, abs=0.01)
    voxel_map.integrate(asked(wall(tools, 1, y=2.6, n=4), "hat", 85))
    assert voxel_map.best_ooi() > before + 0.02, "what was seen meanwhile may be seen again"


@pytest.mark.parametrize("several", [False, True])
def test_a_label_taken_back_has_what_was_seen_meanwhile(tools, several):
    """It has as much evidence as if it had never been excluded."""

    def seen(excluded):
        voxel_map = new_map()
        voxel_map.set_ooi("cup")
        layer = voxel_map
        if several:
            targets = [OoiTarget(label="cup"), OoiTarget(label="hat")]
            layer = GoalLayers(voxel_map, targets).layer("cup")
        for n in range(2):
            voxel_map.integrate(wall(tools, 85, n=n))
        if excluded:
            ruled_out = layer.suppress_ooi(np.array([4.0, 1.0, 1.2]), 3.0)
        for n, y in enumerate((1.0, 2.6, 1.4, 0.4), start=2):
            voxel_map.integrate(wall(tools, 85, y=y, n=n))
        if excluded:
            layer.restore_ooi(ruled_out)
        for n, y in enumerate((1.4, 2.6, 1.0), start=6):
            voxel_map.integrate(wall(tools, 85, y=y, n=n))
        return voxel_map.best_ooi(), median_ooi(voxel_map)

    assert seen(True) == pytest.approx(seen(False), abs=0.02)
    assert seen(False)[0] > 0.8


def test_a_goal_of_a_tour_taken_back_counts_no_place_twice_for_another(tools):
    def seen(excluded):
        voxel_map = new_map()
        layers = GoalLayers(voxel_map, [OoiTarget(label="hat"), OoiTarget(label="bag")])

        def look(n, y=1.0):
            frame = asked(wall(tools, 1, y=y, n=n), "hat", 1)
            scores = frame.heatmap.probabilities
            scores = np.concatenate(
                [scores[..., :1], np.full_like(scores[..., :1], 85), scores[..., 1:]], 2
            )
            labels = (*frame.heatmap.labels, "bag")
            heatmap = replace(frame.heatmap, labels=labels, probabilities=scores)
            voxel_map.integrate(replace(frame, heatmap=heatmap))

        look(0)
        look(1)
        ruled_out = layers.suppress(0, np.array([4.0, 1.0, 1.2]), 3.0)
        look(2, 2.6)
        look(3)
        if excluded:
            layers.restore(0, ruled_out)
        look(4, 2.6)
        look(5)
        used = slice(1, int(voxel_map.surface.tally[N_USED]))
        return layers.log_odds(1)[used].copy()

    np.testing.assert_allclose(seen(True), seen(False), atol=0.01)


def test_a_new_label_is_seen_from_every_place_and_the_others_not_again(tools):
    voxel_map = new_map()
    frames = [wall(tools, 85, n=n) for n in range(3)]
    for frame in frames:
        voxel_map.integrate(frame)
    cup = against_cup(voxel_map)
    for label in ("mug", "bowl"):
        voxel_map.add_label(label)
    before = energies(voxel_map)
    scores = np.repeat(frames[0].heatmap.probabilities, 3, axis=2)
    heatmap = replace(frames[0].heatmap, labels=("cup", "mug", "bowl"), probabilities=scores)
    for frame in frames:
        voxel_map.integrate(replace(frame, heatmap=heatmap))
    told = energies(voxel_map)
    np.testing.assert_allclose(told[:, 0] - told[:, 2], cup, atol=1)
    for label in (3, 4):
        gained = (told[:, 0] - told[:, label]) - (before[:, 0] - before[:, label])
        np.testing.assert_allclose(gained, cup, atol=2)
    voxel_map.add_label("pot")
    voxel_map.integrate(replace(frames[0], heatmap=heatmap))
    np.testing.assert_allclose(energies(voxel_map)[:, :5], told, atol=1)


def test_a_goal_that_is_a_label_teaches_the_label(tools):
    """A detector's image has the channel of the goal behind those of the other labels."""
    voxel_map = new_map()
    voxel_map.set_ooi("cup")
    for n in range(2):
        frame = wall(tools, 1, n=n)
        heatmap = replace(frame.heatmap, labels=("floor",))
        voxel_map.integrate(asked(replace(frame, heatmap=heatmap), "cup", 150))
    found = voxel_map.best_ooi()
    assert found > 0.8
    assert np.median(against_cup(voxel_map)) > 0
    for goal in ("hat", "cup"):
        voxel_map.set_ooi(goal)
    assert voxel_map.best_ooi() == pytest.approx(found, abs=0.1), "the search starts from it"


def test_a_score_of_another_label_says_nothing_against_the_object(tools):
    def probability(table_value):
        voxel_map = VoxelMap(MapConfig(memory_limit_mb=64.0), ("wall", "table"))
        voxel_map.set_ooi("cup")
        for y in (1.0, 1.6):
            frame = wall(tools, 0, y=y)
            scores = np.full((*frame.heatmap.probabilities.shape[:2], 2), table_value, np.uint8)
            scores[..., 1] = 150
            heatmap = Heatmap(
                labels=("table",), ooi="cup", probabilities=scores, kind="scores", source="x"
            )
            voxel_map.integrate(replace(frame, heatmap=heatmap, stamp_ns=round(y * 1e9)))
        return voxel_map.best_ooi()

    assert probability(230) == probability(1) > 0.9


@pytest.mark.parametrize("value", [NOT_RECOGNISED, NOTHING_SAID, 50])
def test_what_is_too_small_in_the_image_is_neither_missed_nor_seen(tools, value):
    """1.5 m before the wall a side of 0.1 m is 3 % of the image or so; 1 m is ten times that."""

    def seen(value, small_m):
        voxel_map = VoxelMap(MapConfig(memory_limit_mb=64.0), ("wall",))
        voxel_map.set_ooi("cup", small_m=small_m)
        for n, y in enumerate((1.0, 1.1, 1.6)):
            frame = wall(tools, value, y=y, n=n)
            scores = np.full((*frame.heatmap.probabilities.shape[:2], 2), 1, np.uint8)
            scores[..., 1] = value
            heatmap = replace(frame.heatmap, labels=("wall",), ooi="cup", probabilities=scores)
            voxel_map.integrate(replace(frame, heatmap=heatmap))
        arrays = voxel_map.arrays()
        return arrays.ooi[arrays.ooi != NOT_MAPPED] / 254.0, arrays.ooi_clear_m

    small, clear_m = seen(value, 0.01)
    assert clear_m < 1.0
    assert small.size == 0, "nothing is known, so it remains to be looked at from nearby"
    large, clear_m = seen(value, 10.0)
    assert clear_m > 5.0
    assert large.size > 0
    assert large.max() <= 0.5, "no more than the prior"
    assert seen(200, 0.01)[0].max() > 0.9, "what speaks for it counts from any distance"


def test_a_place_from_which_nothing_counted_for_the_object_counts_when_it_is_there_again(tools):
    def believed(before, goal_after=0):
        """Number of voxels that are probably the cup, seen thrice, left, and seen again."""
        voxel_map = VoxelMap(MapConfig(memory_limit_mb=64.0), ("wall",))
        values = (before, before, before, 1, 1, 200, 200)
        for n, (y, value) in enumerate(zip((1, 1, 1, 2.6, 2.6, 1, 1), values, strict=True)):
            if n == goal_after:
                voxel_map.set_ooi("cup", small_m=0.01)
            frame = wall(tools, value, y=y, n=n)
            scores = np.full((*frame.heatmap.probabilities.shape[:2], 2), 1, np.uint8)
            scores[..., 1] = value
            heatmap = replace(frame.heatmap, labels=("wall",), ooi="cup", probabilities=scores)
            voxel_map.integrate(replace(frame, heatmap=heatmap))
        ooi = voxel_map.arrays().ooi
        return np.count_nonzero((ooi > 235) & (ooi != NOT_MAPPED))

    too_far_for_a_miss, seen = believed(1), believed(85)
    assert too_far_for_a_miss > 1.3 * seen, "what was seen from there does not count again"
    assert believed(1, goal_after=2) == too_far_for_a_miss, "the robot stood there before"


def test_a_camera_that_shakes_at_a_border_does_not_leave_the_place():
    surface, accumulators = make_surface_voxels(4, len(LABELS)), make_place_accumulators(8, 16)

    @njit
    def open_it(surface, accumulators, slot, place, left, right, labels):
        w = open_accumulator(
            surface, accumulators, slot, place, left, right, labels, labels, True, False
        )
        if w != 0:
            close_for_labels(surface, accumulators, slot, w)
        return w

    def opened(degrees):
        angles = np.radians([degrees, degrees - 5.0, degrees + 5.0])
        places = [place_of(np.cos(a), np.sin(a), 0.2) for a in angles]
        return open_it(surface, accumulators, 1, *places, len(LABELS))

    def places_opened():
        return accumulators.tally[N_OPENED]

    row = opened(14.0)
    assert [opened(angle) for angle in (16.0, 14.0, 19.0, 15.5)] == [row] * 4
    assert places_opened() == 1
    assert opened(21.0) == row
    assert places_opened() == 2
    assert opened(12.0) == row, "5 degrees back is not enough"
    assert opened(9.0) == 0, "a place that was left teaches no more"
    assert places_opened() == 2
    assert accumulators.tally[N_ROWS] == 1, "the voxel keeps its row"


def test_at_the_limit_the_oldest_row_is_given_to_another_voxel():
    surface, accumulators = make_surface_voxels(8, len(LABELS)), make_place_accumulators(2, 16)

    @njit
    def open_it(surface, accumulators, slot, place, labels):
        w = open_accumulator(
            surface, accumulators, slot, place, place, place, labels, labels, True, True
        )
        if w != 0:
            close_for_labels(surface, accumulators, slot, w)
            close_for_ooi(surface, accumulators, slot, w)
        return w

    def opened(slot, place):
        return open_it(surface, accumulators, slot, place, len(LABELS))

    assert [opened(slot, 4) for slot in (1, 2, 3)] == [1, 2, 1]
    assert surface.accumulator[1:4].tolist() == [0, 2, 1]
    assert opened(1, 4) == 0, "its place was closed"
    assert opened(1, 5) == 2
    assert surface.accumulator[1:4].tolist() == [2, 0, 1]


def test_another_observation_model_counts_from_now_on(tools):
    frames = [wall(tools, 230, n=n) for n in range(2)]
    deaf = ObservationModel(
        source="x", kind="scores", provenance="test",
        table=ScoreTable(scores=(0.0, 1.0), nats=(0.0, 0.0)),
    )  # fmt: skip

    def believed(models):
        voxel_map = VoxelMap(MapConfig(memory_limit_mb=64.0), LABELS)
        if models is not None:
            voxel_map.set_models(ObservationModels(models))
        for frame in frames:
            voxel_map.integrate(frame)
        voxel_map.set_ooi("cup")
        return voxel_map.best_ooi()

    assert believed(None) > 0.9
    assert believed([deaf]) < 0.5

"""Several objects of interest in one map, against maps that each have only one of them."""

import dataclasses

import numpy as np
import pytest

from ippon.mapping.arrays import NOT_MAPPED, OCCUPIED
from ippon.mapping.config import MapConfig
from ippon.mapping.goal_layers.goal_layers import GoalLayers, OoiTarget
from ippon.mapping.objects.ooi_voxels import OoiVoxels
from ippon.mapping.objects.posterior_arithmetic import LOG_ODDS_MAX
from ippon.mapping.voxel_map import VoxelMap
from ippon.observation import Heatmap

LABELS = ("wall", "floor", "chair", "sofa")
GOALS = ("hat", "chair", "keys", "mug", "clock", "lamp", "book", "shoe")
OTHERS = tuple(name for name in GOALS if name not in LABELS)
TARGETS = tuple(
    OoiTarget(label=name, highest_m=1.0 + 0.2 * n, lowest_m=0.05 * n, small_m=0.1 + 0.1 * n)
    for n, name in enumerate(GOALS)
)


def frames(tools, kind, n=10):
    """Frames of a room with random heatmaps of every label and goal."""
    rng = np.random.default_rng(4)
    world = tools.World.room(3.0, 3.0)
    for k in range(n):
        p = rng.integers(0, 256, (15, 20, len(LABELS) + len(OTHERS)), dtype=np.uint8)
        pose = tools.look(1.5, 1.5, 1.2, 2.4 * (k // 2), -0.4)
        yield world.frame(pose, stamp_ns=k * 10**9), p, kind


def with_heatmap(frame, p, kind, ooi, also):
    """The frame with the channels of the common labels, `also`, and `ooi`."""
    names = [*LABELS, *also, *(() if ooi in LABELS else (ooi,))]
    at = [(*LABELS, *OTHERS).index(name) for name in names]
    heatmap = Heatmap(
        labels=(*LABELS, *also), ooi=ooi, probabilities=np.ascontiguousarray(p[..., at]), kind=kind
    )
    return dataclasses.replace(frame, heatmap=heatmap)


def new_map(fusion):
    return VoxelMap(MapConfig(memory_limit_mb=64.0, fusion=fusion), LABELS)


def single(tools, target, fusion, kind, before=0):
    """A map of the same frames with one object of interest, set after the first few."""
    result = new_map(fusion)
    for k, (frame, p, of) in enumerate(frames(tools, kind)):
        if k == before:
            result.set_ooi(
                target.label,
                target.highest_m,
                lowest_m=target.lowest_m,
                small_m=target.small_m,
            )
        result.integrate(with_heatmap(frame, p, of, target.label, ()))
    return result


def several(tools, targets, fusion, kind, before=0):
    result, layers = new_map(fusion), None
    for k, (frame, p, of) in enumerate(frames(tools, kind)):
        if k == before:
            layers = GoalLayers(result, targets)
        result.integrate(with_heatmap(frame, p, of, "hat", OTHERS[1:]))
    return result, layers


def codes_of(voxel_map):
    """p(v in O) of the map's rows of surface voxels, as in the map's `ooi`."""
    used = int(voxel_map.surface.tally[0])
    at = voxel_map.surface.voxel[:used]
    codes = np.full(used, NOT_MAPPED, np.uint8)
    row = np.flatnonzero(at >= 0)
    codes[row] = voxel_map._pools.ooi[voxel_map._pools.slab[at[row] // 512], at[row] % 512]
    return codes, row


@pytest.mark.slow
@pytest.mark.parametrize("before", [0, 3])
@pytest.mark.parametrize(
    ("fusion", "kind"),
    [("places", "scores"), ("places", "distribution"), ("paper", "scores"), ("max", "scores")],
)
def test_each_of_eight_layers_is_the_map_of_that_goal_alone(tools, fusion, kind, before):
    tour, layers = several(tools, TARGETS, fusion, kind, before)
    highest = np.full(int(tour.surface.tally[0]), -1)
    for g, target in enumerate(TARGETS):
        alone = single(tools, target, fusion, kind, before)
        codes, row = codes_of(alone)
        assert (tour.surface.voxel[row] == alone.surface.voxel[row]).all()
        assert (layers.log_odds(g)[row] == alone.surface.log_odds[row]).all()
        assert (layers.codes(g)[row] == codes[row]).all()
        assert np.count_nonzero((codes[row] > 0) & (codes[row] < NOT_MAPPED)) > 100
        assert (tour.surface.energy[row] == alone.surface.energy[row]).all()
        highest[row] = np.maximum(
            highest[row], np.where(codes == NOT_MAPPED, -1, codes.astype(int))[row]
        )
        seen = layers.layer(target.label).voxels(0.3)
        expected = OoiVoxels(0.3).update(alone.arrays())
        for mine, theirs in zip(seen, expected, strict=True):
            assert sorted(mine.tolist()) == sorted(theirs.tolist())
    combined, row = codes_of(tour)
    assert (combined[row] == np.where(highest[row] < 0, NOT_MAPPED, highest[row])).all()
    best = [c[c != NOT_MAPPED].max(initial=0) for c in tour._pools.ooi[tour._pools.slab]]
    assert (tour._pools.best_ooi == best).all()


def test_a_goal_that_is_not_missing_leaves_the_combination_and_returns(tools):
    tour, layers = several(tools, TARGETS[:3], "places", "scores")
    before, row = codes_of(tour)
    layers.set_missing(0, missing=False)
    two = np.stack([layers.codes(g)[row].astype(int) for g in (1, 2)])
    two[two == NOT_MAPPED] = -1
    without, _ = codes_of(tour)
    assert (without[row] == np.where(two.max(axis=0) < 0, NOT_MAPPED, two.max(axis=0))).all()
    assert (without != before).any()
    layers.set_missing(0, missing=True)
    assert (codes_of(tour)[0] == before).all()
    assert tour.arrays().revision.max() == tour.revision


def test_an_ended_goal_is_no_longer_updated(tools):
    tour, layers = several(tools, TARGETS[:3], "places", "scores")
    layers.end(2)
    assert layers.asked == GOALS[:2]
    used = slice(1, int(tour.surface.tally[0]))
    kept, other = layers.log_odds(2)[used].copy(), layers.log_odds(0)[used].copy()
    _, p, kind = next(frames(tools, "scores"))
    pose = tools.look(0.6, 0.6, 1.2, 0.4, -0.4)
    moved = tools.World.room(3.0, 3.0).frame(pose, stamp_ns=20 * 10**9)
    tour.integrate(with_heatmap(moved, p, kind, "hat", OTHERS[1:]))
    assert (layers.log_odds(2)[used] == kept).all()
    assert (layers.log_odds(0)[used] != other).any()


def test_a_place_is_excluded_for_one_goal_and_taken_back(tools):
    tour, layers = several(tools, TARGETS[:2], "places", "scores")
    used = slice(1, int(tour.surface.tally[0]))
    state = [(layers.log_odds(g)[used].copy(), layers.codes(g)[used].copy()) for g in (0, 1)]
    centre, radius = np.array([1.0, 1.0, 0.2]), 0.8
    before = layers.layer("hat").suppress_ooi(centre, radius)
    suppressed = layers.log_odds(0)[used] == -LOG_ODDS_MAX
    assert np.count_nonzero(suppressed) >= len(before.voxel) > 20
    assert (layers.log_odds(1)[used] == state[1][0]).all()
    for frame, p, kind in frames(tools, "scores", 2):
        tour.integrate(with_heatmap(frame, p, kind, "hat", OTHERS[1:]))
    inside = layers.voxels(0, -1.0)[0]
    away = np.linalg.norm(inside - centre, axis=1)
    assert (away > radius).any()
    at = layers.voxels(0, 0.001)[0]
    assert not (np.linalg.norm(at - centre, axis=1) < radius - 1e-6).any()
    layers.layer("hat").restore_ooi(before)
    assert np.count_nonzero(layers.log_odds(0)[used] == -LOG_ODDS_MAX) < np.count_nonzero(
        suppressed
    )


def test_the_same_voxels_return_where_nothing_was_seen_in_between(tools):
    tour, layers = several(tools, TARGETS[:2], "paper", "distribution")
    used = slice(1, int(tour.surface.tally[0]))
    log_odds, codes = layers.log_odds(0)[used].copy(), layers.codes(0)[used].copy()
    combined = codes_of(tour)[0]
    layers.layer("hat").restore_ooi(
        layers.layer("hat").suppress_ooi(np.array([1.0, 1.0, 0.0]), 0.8)
    )
    assert (layers.log_odds(0)[used] == log_odds).all()
    assert (layers.codes(0)[used] == codes).all()
    assert (codes_of(tour)[0] == combined).all()


def test_another_object_of_interest_ends_the_layers(tools):
    tour, layers = several(tools, TARGETS[:2], "places", "scores")
    tour.set_ooi("hat")
    assert (tour.arrays().ooi == NOT_MAPPED).all()
    kept = layers.log_odds(0).copy()
    frame, p, kind = next(frames(tools, "scores"))
    tour.integrate(with_heatmap(frame, p, kind, "hat", ()))
    assert (layers.log_odds(0) == kept).all()
    assert (tour.arrays().state == OCCUPIED).any()


@pytest.mark.parametrize(
    ("names", "problem"),
    [
        ([], "got none"),
        (["hat", "hat"], "of different labels; got hat, hat"),
        ([f"thing_{n}" for n in range(9)], "takes 1 to 8 objects of interest"),
    ],
)
def test_other_numbers_of_goals_are_refused(names, problem):
    with pytest.raises(ValueError, match=problem):
        GoalLayers(new_map("places"), [OoiTarget(label=name) for name in names])


def test_a_ball_without_a_radius_is_refused(tools):
    _, layers = several(tools, TARGETS[:1], "places", "scores")
    with pytest.raises(ValueError, match="positive radius"):
        layers.suppress(0, np.zeros(3), 0.0)

"""The map as a whole, in a world of boxes whose truth is known."""

import dataclasses
import math

import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt

from ippon.errors import FrameRejectedError
from ippon.geometry import make_transform
from ippon.mapping.arrays import FREE, NOT_MAPPED, OCCUPIED, UNKNOWN
from ippon.mapping.blocks import N_ROWS
from ippon.mapping.objects.surface_voxels import N_USED
from ippon.mapping.voxel_map import MapConfig, VoxelMap
from ippon.observation import Heatmap

LABELS = ("floor", "wall", "chair", "table")


def heat_of(labels, ooi, box_label, share=0.9):
    """Make heatmaps of box numbers: `share` for the box's label, the rest spread evenly."""
    names = [*labels, *([ooi] if ooi is not None and ooi not in labels else [])]

    def make(seen):
        p = np.full((*seen.shape, len(names)), (1.0 - share) / (len(names) - 1))
        for number in np.unique(seen):
            p[seen == number, names.index(box_label(number))] = share
        return Heatmap(
            labels=tuple(labels), ooi=ooi, probabilities=np.round(p * 255).astype(np.uint8)
        )

    return make


def test_what_a_voxel_without_evidence_has_follows_from_the_number_of_labels():
    voxel_map = VoxelMap(MapConfig(), LABELS)
    assert voxel_map.arrays().ooi_prior_log_odds == math.inf, "nothing is searched for"
    for ooi, others in (("hat", 4), ("chair", 3)):
        voxel_map.set_ooi(ooi)
        assert voxel_map.arrays().ooi_prior_log_odds == pytest.approx(-math.log(others))


@pytest.fixture(scope="module")
def furnished(tools):
    world = tools.World.room()
    world.boxes.append((2.5, 2.5, 0.0, 3.1, 3.1, 0.5))
    return world


def mapped(tools, world, config=None, heatmap=None, stops=((1.0, 1.0), (3.0, 1.0), (1.5, 3.2))):
    voxel_map = VoxelMap(config or MapConfig(), LABELS)
    for n, pose in enumerate(tools.tour(list(stops))):
        voxel_map.integrate(world.frame(pose, stamp_ns=n * 10**9, heatmap=heatmap))
    return voxel_map


@pytest.mark.parametrize("voxel_size", [0.1, pytest.param(0.05, marks=pytest.mark.slow)])
def test_room_comes_out_closed_with_free_space_inside(tools, furnished, voxel_size):
    voxel_map = mapped(tools, furnished, MapConfig(voxel_size_m=voxel_size))
    v = voxel_size
    x, y = np.meshgrid(np.arange(0.3, 3.7, v), np.arange(0.3, 3.7, v), indexing="ij")
    open_floor = ~((x > 2.35) & (x < 3.25) & (y > 2.35) & (y < 3.25))
    x, y = x[open_floor], y[open_floor]
    floor = voxel_map.state_at(np.stack([x, y, np.full_like(x, -0.5 * v)], 1))
    above = voxel_map.state_at(np.stack([x, y, np.full_like(x, 0.5 * v)], 1))
    waist = voxel_map.state_at(np.stack([x, y, np.full_like(x, 1.0)], 1))
    assert np.mean(floor == OCCUPIED) > 0.995
    assert np.mean(above == FREE) > 0.98
    assert np.mean(waist == FREE) > 0.995
    inside = voxel_map.state_at(np.array([[2.8, 2.8, 0.25]]))
    outside = voxel_map.state_at(np.array([[5.5, 1.0, 1.0], [90.0, 0.0, 0.0]]))
    assert inside[0] == UNKNOWN
    assert (outside == UNKNOWN).all()


@pytest.mark.slow
def test_distance_is_exact_after_every_frame(tools, furnished):
    voxel_map = VoxelMap(MapConfig(), LABELS)
    for n, pose in enumerate(tools.tour([(1.0, 1.0), (3.0, 1.0)])):
        voxel_map.integrate(furnished.frame(pose, stamp_ns=n * 10**9))
        if n % 9:
            continue
        state, has_block = tools.dense(voxel_map.arrays(), "state")
        distance, _ = tools.dense(voxel_map.arrays(), "distance")
        exact = np.minimum(distance_transform_edt(state != OCCUPIED) * 0.1, 1.0)
        assert np.abs(exact - distance)[has_block].max() < 1e-6


@pytest.mark.slow
def test_rejected_frame_says_why_and_changes_nothing(tools, furnished):
    voxel_map = mapped(tools, furnished, stops=((1.0, 1.0),))
    before = voxel_map.arrays().state.copy()
    revision = voxel_map.revision
    good = furnished.frame(tools.look(1.0, 1.0, 1.2, 0.0), stamp_ns=18 * 10**9)
    nan = dataclasses.replace(good, depth=np.full_like(good.depth, np.nan))
    with pytest.raises(FrameRejectedError, match="no finite value"):
        voxel_map.integrate(nan)
    jump = furnished.frame(tools.look(61.0, 1.0, 1.2, 0.0), stamp_ns=17 * 10**9 + 10**8)
    with pytest.raises(FrameRejectedError, match=r"jumped 60\.00 m in 0\.100 s"):
        voxel_map.integrate(jump)
    away = furnished.frame(tools.look(9e3, 9e3, 1.2, 0.0), stamp_ns=0)
    with pytest.raises(FrameRejectedError, match="too far from the map"):
        voxel_map.integrate(away)
    assert voxel_map.revision == revision
    assert (voxel_map.arrays().state == before).all()
    voxel_map.integrate(good)
    assert voxel_map.revision == revision + 1


def test_explored_floor_is_that_of_the_storey_that_the_robot_is_on(tools):
    def look_around(voxel_map, z, side):
        room = tools.World.room(side, side)
        room.boxes = [(a, b, c + z, d, e, f + z) for a, b, c, d, e, f in room.boxes]
        for k in range(8):
            pose = tools.look(1.5, 1.5, z + 1.2, k * np.pi / 4.0)
            frame = room.frame(pose, stamp_ns=voxel_map.revision * 10**9)
            base = make_transform(np.eye(3), (1.5, 1.5, z))
            voxel_map.integrate(dataclasses.replace(frame, T_world_base=base))
        return voxel_map.explored_m2()

    voxel_map = VoxelMap(MapConfig(), LABELS)
    first = look_around(voxel_map, 0.0, 4.0)
    alone = look_around(VoxelMap(MapConfig(), LABELS), -3.1, 3.0)
    assert first > alone + 3.0
    assert look_around(voxel_map, -3.1, 3.0) == pytest.approx(alone, rel=0.02)
    assert look_around(voxel_map, 0.0, 4.0) == pytest.approx(first, rel=0.05)


def test_a_late_heatmap_updates_labels_but_not_depth_or_colour(tools, furnished):
    names = {0: "floor", 6: "hat"}
    heat = heat_of(LABELS, "hat", lambda n: names.get(int(n), "wall"))
    poses = tools.tour([(1.0, 1.0)], yaws=3)
    told = [furnished.frame(p, stamp_ns=n * 10**9, heatmap=heat) for n, p in enumerate(poses)]
    at_once, late = VoxelMap(MapConfig(), LABELS), VoxelMap(MapConfig(), LABELS)
    assert late.integrate_heatmap(told[0]) == 0
    for voxel_map in (at_once, late):
        voxel_map.set_ooi("hat")
    for frame in told:
        report = at_once.integrate(frame)
        late.integrate(dataclasses.replace(frame, heatmap=None))
        assert late.integrate_heatmap(frame) == report.labelled > 100
    used = slice(int(at_once._pools.tally[N_ROWS]))
    for name in ("tsdf", "weight", "evidence", "state", "squared_distance", "settled"):
        mine, theirs = getattr(late._pools, name), getattr(at_once._pools, name)
        np.testing.assert_array_equal(mine[used], theirs[used])
    used = slice(1, int(at_once.surface.tally[N_USED]))
    for name in ("voxel", "color", "color_count"):
        mine, theirs = getattr(late.surface, name), getattr(at_once.surface, name)
        np.testing.assert_array_equal(mine[used], theirs[used])
    # The rounding of a label's probability hangs on the number of the change.
    assert (late.surface.label[used] == at_once.surface.label[used]).mean() > 0.999
    steps = late.surface.energy[used].astype(int) - at_once.surface.energy[used]
    assert abs(steps).max() <= len(poses)
    np.testing.assert_allclose(
        late.surface.log_odds[used], at_once.surface.log_odds[used], atol=0.3
    )
    assert late.best_ooi() == pytest.approx(at_once.best_ooi(), abs=0.01)
    assert late.best_ooi() > 0.9
    with pytest.raises(ValueError, match="has no heatmap; use integrate"):
        late.integrate_heatmap(dataclasses.replace(told[0], heatmap=None))


@pytest.mark.slow
def test_labels_and_ooi_follow_the_images(tools, furnished):
    names = {0: "floor", 6: "hat", -1: "wall"}
    heat = heat_of(LABELS, "hat", lambda n: names.get(int(n), "wall"))
    voxel_map = VoxelMap(MapConfig(), LABELS)
    voxel_map.set_ooi("hat")
    voxel_map.set_levels(np.array([0, 1, 2, 3], np.uint8), np.array([0.02, 0.1, 0.25, 0.6], "f4"))
    for n, pose in enumerate(tools.tour([(1.0, 1.0)])):
        voxel_map.integrate(furnished.frame(pose, stamp_ns=n * 10**9, heatmap=heat))
    arrays = voxel_map.arrays()
    ooi, _ = tools.dense(arrays, "ooi")
    state, has_block = tools.dense(arrays, "state")
    level, _ = tools.dense(arrays, "level")
    centers = (np.argwhere(np.ones_like(state)) + 0.5 + 8 * arrays.origin_block) * 0.1
    on_box = ((centers > (2.45, 2.45, 0.05)) & (centers < (3.15, 3.15, 0.55))).all(axis=1)
    on_box &= (state == OCCUPIED).ravel()
    mapped_ooi = (ooi.ravel() != NOT_MAPPED) & has_block.ravel()
    assert np.mean(ooi.ravel()[on_box & mapped_ooi] > 200) > 0.95
    far_off = mapped_ooi & ((centers[:, :2] < 2.3).any(axis=1) | (centers[:, 2] > 0.7))
    assert np.mean(ooi.ravel()[far_off] < 20) > 0.99
    assert voxel_map.best_ooi() > 0.99
    labelled = (level != NOT_MAPPED) & has_block
    assert (state[labelled] == OCCUPIED).all()
    floor = labelled.ravel() & (centers[:, 2] < 0) & (centers[:, :2] < 2.2).all(axis=1)
    assert np.mean(level.ravel()[floor] == 0) > 0.95
    voxel_map.suppress_ooi(np.array([2.8, 2.8, 0.3]), 0.8)
    assert voxel_map.best_ooi() < 0.1
    voxel_map.integrate(
        furnished.frame(tools.look(1.0, 1.0, 1.2, 0.8, -0.3), stamp_ns=10**12, heatmap=heat)
    )
    assert voxel_map.best_ooi() < 0.1
    voxel_map.set_ooi("hat")
    assert voxel_map.best_ooi() == 0.0
    assert (voxel_map.arrays().ooi == NOT_MAPPED).all()

"""The view's deltas: they add up to the surface, and little changes send little."""

import dataclasses

import numpy as np
import pytest

from ippon.mapping.config import MapConfig
from ippon.mapping.objects.surface_changes import SurfaceThresholds, SurfaceTracker
from ippon.mapping.voxel_map import VoxelMap
from ippon.observation import Heatmap
from tests.reference import surface as plain

LABELS = ("wall", "floor", "chair")
COLUMNS = ("color", "ooi", "proximity", "level", "label", "confidence")


class CameraGeometry:
    """Applies deltas as a console does."""

    def __init__(self):
        self.voxels = {}

    def apply(self, delta):
        for n, index in enumerate(map(tuple, delta.index.tolist())):
            if delta.removed[n]:
                del self.voxels[index]
            else:
                self.voxels[index] = [getattr(delta, c)[n].tolist() for c in COLUMNS]
        assert len({tuple(i) for i in delta.index.tolist()}) == len(delta.index)


def heat(seen, rng):
    p = rng.integers(0, 120, (*seen.shape, 4)).astype(np.uint8)
    p[..., 1][seen == 0] = 250
    p[..., 3][seen == 6] = 250
    return Heatmap(labels=LABELS, ooi="hat", probabilities=p)


@pytest.fixture
def world(tools):
    world = tools.World.room(5.0, 4.0)
    world.boxes.append((2.5, 1.5, 0.0, 3.1, 2.1, 0.6))
    return world


def frames(tools, world, count=24, start=0):
    rng = np.random.default_rng(2)
    for n in range(count):
        pose = tools.look(1.0 + 0.05 * n, 1.2, 1.2, 2.4 * n, -0.3)
        yield world.frame(pose, stamp_ns=(start + n) * 10**9, heatmap=lambda s: heat(s, rng))


@pytest.mark.slow
def test_deltas_add_up_to_the_keyframe(tools, world):
    voxel_map = VoxelMap(MapConfig(), LABELS)
    voxel_map.set_ooi("hat")
    tracker, view = SurfaceTracker(voxel_map), CameraGeometry()
    for frame in frames(tools, world):
        voxel_map.integrate(frame)
        delta = tracker.update()
        view.apply(delta)
        assert delta.revision == voxel_map.revision
    world.boxes.pop()
    for frame in frames(tools, world, 40, 100):
        voxel_map.integrate(frame)
        view.apply(tracker.update())
    voxel_map.set_levels(np.array([0, 1, 3], np.uint8), np.array([0, 0.1, 0.3, 0.9], "f4"))
    voxel_map.suppress_ooi(np.array([2.8, 1.8, 0.3]), 1.0)
    view.apply(tracker.update())
    truth = CameraGeometry()
    truth.apply(SurfaceTracker(voxel_map).keyframe())
    assert view.voxels.keys() == truth.voxels.keys()
    assert len(truth.voxels) > 1000
    for index, shown in view.voxels.items():
        color, ooi, proximity, level, label, confidence = truth.voxels[index]
        assert np.abs(np.subtract(shown[0], color)).max() <= 10
        assert abs(shown[1] - ooi) <= 5
        assert abs(shown[2] - proximity) <= 5
        assert shown[3:5] == [level, label]
        assert abs(shown[5] - confidence) <= 12
    again = CameraGeometry()
    again.apply(tracker.keyframe())
    assert again.voxels == truth.voxels
    assert len(tracker.update().index) == 0


@pytest.mark.slow
def test_values_are_those_of_the_map(tools, world):
    voxel_map = VoxelMap(MapConfig(), LABELS)
    voxel_map.set_ooi("hat")
    voxel_map.set_levels(np.array([0, 2, 3], np.uint8), np.array([0.0, 0.1, 0.5, 0.9], "f4"))
    for frame in frames(tools, world):
        voxel_map.integrate(frame)
    delta = SurfaceTracker(voxel_map).update()
    centers = (delta.index + 0.5) * 0.1
    assert (voxel_map.state_at(centers) == 2).all()
    floor = (centers[:, 2] < 0) & (delta.label != 255)
    assert np.mean(delta.label[floor] == 1) > 0.9
    assert np.mean(delta.level[floor] == 2) > 0.9
    sure = floor & (delta.confidence > 250) & (delta.label == 1)
    assert np.abs(delta.proximity[sure] / 254.0 - 0.5).max() < 0.02
    rows = voxel_map.surface
    for n in range(0, len(delta.index), 97):
        row = np.flatnonzero((voxel_map._pools.coord == delta.index[n] >> 3).all(axis=1))
        row = next(r for r in row if voxel_map._pools.used[r])
        k = (delta.index[n] & 7) @ [64, 8, 1]
        slab = voxel_map._pools.slab[row]
        slot = voxel_map._pools.slot[slab, k]
        assert (rows.color[slot] == delta.color[n]).all()
        assert rows.label[slot] == delta.label[n]
        assert voxel_map._pools.ooi[slab, k] == delta.ooi[n]


def test_the_same_view_again_sends_almost_nothing(tools, world):
    voxel_map = VoxelMap(MapConfig(), LABELS)
    tracker = SurfaceTracker(voxel_map)
    frame = world.frame(tools.look(1.0, 2.0, 1.2, 0.3, -0.3))
    first = 0
    for n in range(6):
        voxel_map.integrate(dataclasses.replace(frame, stamp_ns=n))
        first = max(first, len(tracker.update().index))
    voxel_map.integrate(dataclasses.replace(frame, stamp_ns=9))
    assert len(tracker.update().index) == 0
    assert first > 300


@pytest.mark.slow
def test_dropped_blocks_are_removed_from_the_view(tools, world):
    voxel_map = VoxelMap(MapConfig(memory_limit_mb=25.0, max_range_m=3.0), LABELS)
    tracker, view = SurfaceTracker(voxel_map), CameraGeometry()
    dropped = most = 0
    for n in range(14):
        # The same furnished room again and again, each a room's length farther on.
        room = tools.World.room(5.0, 4.0)
        room.boxes = [
            (x0 + 5.2 * n, y0, z0, x1 + 5.2 * n, y1, z1) for x0, y0, z0, x1, y1, z1 in room.boxes
        ]
        for turn in range(3):
            pose = tools.look(2.0 + 5.2 * n, 2.0, 1.2, 2.1 * turn)
            frame = room.frame(pose, stamp_ns=(3 * n + turn) * 10**10)
            dropped += voxel_map.integrate(frame).blocks_dropped
            view.apply(tracker.update())
            most = max(most, np.count_nonzero(tracker._slab_of_row >= 0))
    assert dropped > 0
    assert tracker._slabs == most, "what was dropped is not kept"
    truth = CameraGeometry()
    truth.apply(SurfaceTracker(voxel_map).keyframe())
    assert view.voxels.keys() == truth.voxels.keys()


@pytest.mark.slow
def test_deltas_agree_with_the_plain_twin(tools, world):
    voxel_map = VoxelMap(MapConfig(), LABELS)
    voxel_map.set_ooi("hat")
    least = SurfaceThresholds()
    tracker, shown = SurfaceTracker(voxel_map, least), {}
    for n, frame in enumerate(frames(tools, world, 10)):
        if n == 6:
            # The box is taken away, and seen through from here on.
            world.boxes.pop()
        voxel_map.integrate(frame)
        if n == 4:
            voxel_map.set_ooi("chair")
        if n == 8:
            voxel_map.set_levels(np.array([0, 1, 3], np.uint8), np.array([0, 0.1, 0.3, 0.9], "f4"))
        delta = tracker.update()
        values = [delta.color, *(getattr(delta, c)[:, None] for c in COLUMNS[1:])]
        mine = {
            tuple(index): None if delta.removed[k] else tuple(row)
            for k, (index, row) in enumerate(
                zip(delta.index.tolist(), np.concatenate(values, axis=1).tolist(), strict=True)
            )
        }
        assert mine == plain.delta(shown, voxel_map, least)
    assert len(shown) > 500

"""What viewpoints promise, and when that is worked out again."""

import math

import numpy as np
import pytest

from ippon.geometry import base_pose
from ippon.guidance.levels import Level, LevelProbabilities
from ippon.mapping.arrays import FREE, OCCUPIED
from ippon.planning.visibility.region_weights import Stroke, WeightGrid
from ippon.planning.visibility.view_config import ViewConfig
from ippon.planning.visibility.viewpoint_store import ViewpointStore
from ippon.robot import ZED

POSE = base_pose(2.8, 2.8, 0.0, 0.0)
XY = np.array([[2.85, 2.85], [1.25, 1.25], [4.45, 2.85]])


def make(volume, **config) -> ViewpointStore:
    viewpoints = ViewpointStore(ViewConfig(**config), ZED, 10, 0.8)
    viewpoints.set_probabilities(LevelProbabilities().as_array())
    viewpoints.update(volume.arrays(), 0.0, POSE, 0.0)
    return viewpoints


def stale(viewpoints, nodes) -> list[bool]:
    return viewpoints.stale(np.array(nodes), XY, 0.1).tolist()


def room_with_door(dense_map):
    volume = dense_map((8.0, 5.6, 2.4)).room((0.8, 0.8), (4.8, 4.8))
    return volume.fill((4.8, 2.3, 0.0), (4.9, 3.3, 2.0), FREE)


def test_a_viewpoint_faces_what_it_would_gain_from(dense_map):
    volume = room_with_door(dense_map)
    viewpoints = make(volume)
    viewpoints.evaluate(0, XY[0], volume.arrays())
    assert viewpoints.gain[0] > 1.0
    assert abs(math.remainder(float(viewpoints.yaw[0]), 2 * math.pi)) < ZED.horizontal_fov_rad / 2
    towards = int(np.argmin(np.abs(viewpoints.geometry.orientations.yaws - 0.0)))
    away = int(np.argmin(np.abs(viewpoints.geometry.orientations.yaws - math.pi)))
    assert viewpoints.by_heading[0, away] < 0.2 * viewpoints.by_heading[0, towards]


def test_only_viewpoints_that_saw_the_change_are_evaluated_again(dense_map):
    volume = room_with_door(dense_map)
    # A wall hides the far corner from viewpoint 0, not from viewpoint 2.
    volume.fill((3.6, 3.6, 0.0), (4.8, 3.7, 2.0), OCCUPIED, ooi=0.0, level=1)
    viewpoints = make(volume, unknown_views=200)
    assert stale(viewpoints, [0, 1]) == [True, True], "never evaluated"
    for node in range(3):
        viewpoints.evaluate(node, XY[node], volume.arrays())
    viewpoints.update(volume.arrays(), 0.0, POSE, 0.0)
    assert stale(viewpoints, [0, 1, 2]) == [False, False, False]
    volume.fill((1.6, 1.6, 0.0), (2.4, 2.4, 0.8), OCCUPIED, ooi=0.0, level=1)
    viewpoints.update(volume.arrays(), 0.0, POSE, 0.0)
    assert stale(viewpoints, [0, 1]) == [True, True]
    for node in range(3):
        viewpoints.evaluate(node, XY[node], volume.arrays())
    volume.fill((6.4, 1.6, 0.0), (7.2, 2.4, 0.8), OCCUPIED, ooi=0.0, level=1)
    viewpoints.update(volume.arrays(), 0.0, POSE, 0.0)
    assert stale(viewpoints, [1]) == [False], "the wall hides it"


def test_a_promising_level_raises_gain_but_not_potential(dense_map):
    volume = room_with_door(dense_map)
    volume.fill((4.4, 3.6, 0.0), (4.8, 4.4, 1.0), OCCUPIED, ooi=0.0, level=Level.AVERAGE)
    viewpoints = make(volume)
    viewpoints.evaluate(0, XY[0], volume.arrays())
    gain, potential = float(viewpoints.gain[0]), float(viewpoints.potential[0])
    volume.fill((4.4, 3.6, 0.0), (4.8, 4.4, 1.0), OCCUPIED, ooi=0.0, level=Level.CERTAIN)
    viewpoints.recount_levels(volume.arrays())
    assert viewpoints.level[0] == Level.CERTAIN
    assert viewpoints.gain[0] > 2.0 * gain
    assert viewpoints.potential[0] == pytest.approx(potential)


def test_a_room_where_the_object_is_not_lowers_the_gain_but_not_what_is_left_to_explore(dense_map):
    volume = room_with_door(dense_map)
    viewpoints = make(volume)
    viewpoints.evaluate(0, XY[0], volume.arrays())
    gain, potential = float(viewpoints.gain[0]), float(viewpoints.potential[0])
    denied = WeightGrid(cell_m=8.0, origin=np.zeros(2, np.int64), weights=np.full((1, 1), 0.05))
    viewpoints.set_regions((), denied)
    assert viewpoints.gain[0] == pytest.approx(0.05 * gain)
    assert viewpoints.potential[0] == pytest.approx(potential)
    stroke = Stroke(kind="not_here", points=((4.0, 2.8),), radius_m=6.0)
    viewpoints.set_regions((stroke,), denied)
    avoided = viewpoints.config.regions.avoided_weight
    assert viewpoints.potential[0] == pytest.approx(avoided * potential)


def test_a_viewpoint_loses_its_gain_while_the_robot_stands_there(dense_map):
    volume = room_with_door(dense_map)
    viewpoints = make(volume)
    viewpoints.evaluate(0, XY[0], volume.arrays())
    before = float(viewpoints.gain[0])
    aside = base_pose(2.7, 2.8, 0.0, 0.0)
    for _ in range(ViewConfig().unknown_views):
        viewpoints.update(volume.arrays(), 0.0, aside, 0.0, XY[0])
    viewpoints.evaluate(0, XY[0], volume.arrays())
    assert viewpoints.gain[0] < 0.3 * before


def test_object_voxels_make_a_viewpoint_terminate_and_frame_them(dense_map):
    volume = room_with_door(dense_map)
    volume.fill((3.3, 2.6, 0.3), (3.5, 3.1, 0.7), OCCUPIED, ooi=0.95)
    viewpoints = make(volume)
    viewpoints.evaluate(0, XY[0], volume.arrays())
    assert viewpoints.termination[0] >= 8
    yaw, tilt = viewpoints.framing(0)
    assert abs(math.remainder(yaw, 2 * math.pi)) < 0.4
    assert tilt < -0.3
    viewpoints.evaluate(1, XY[1], volume.arrays())
    assert viewpoints.termination[1] == 0, "too far away"
    assert viewpoints.framing(1) == (viewpoints.yaw[1], viewpoints.tilt[1])


def test_large_objects_are_approached_more_closely(dense_map):
    volume = room_with_door(dense_map)
    # 0.85 to 0.95 m ahead of the viewpoint.
    volume.fill((3.7, 2.6, 0.3), (3.8, 3.1, 0.7), OCCUPIED, ooi=0.95)
    viewpoints = make(volume)

    def counted(termination_min: float) -> float:
        arrays = volume.arrays()
        viewpoints.update(arrays, 0.0, POSE, 0.0, termination_min=termination_min)
        viewpoints.evaluate(0, XY[0], arrays)
        return float(viewpoints.termination[0])

    small, large = counted(1.0), counted(18.0)
    assert small >= 8 > large
    assert counted(1.0) == small


def test_surfaces_have_gain_only_from_where_a_miss_is_evidence(dense_map):
    volume = dense_map().room((0.8, 0.8), (4.8, 4.8), ooi=None)

    def gain(clear_m: float) -> float:
        arrays = volume.arrays()._replace(ooi_clear_m=clear_m)
        viewpoints = make(volume)
        viewpoints.update(arrays, 0.0, POSE, 0.0)
        viewpoints.evaluate(0, XY[0], arrays)
        return float(viewpoints.potential[0])

    assert gain(math.inf) == gain(5.0) > 2.0 * gain(2.3) > gain(1.0) == 0.0


def test_forgetting_a_node_clears_its_row(dense_map):
    volume = room_with_door(dense_map)
    viewpoints = make(volume)
    viewpoints.evaluate(0, XY[0], volume.arrays())
    viewpoints.forget(0)
    assert viewpoints.gain[0] == 0.0
    assert stale(viewpoints, [0]) == [True]


class Fading:
    """FarEvidence straight ahead that get fainter little by little."""

    def __init__(self):
        self.revision, self.nat = 1, 3.0

    def ahead(self, xy, headings, reach_m):
        near = np.abs((headings + math.pi) % (2.0 * math.pi) - math.pi) < 0.3
        return np.tile(np.where(near, np.float32(self.nat), np.float32(0.0)), (len(xy), 1))

    def cued(self, xy, headings, reach_m):
        return np.zeros((len(xy), len(headings)), np.bool_)

    def fade(self, nat):
        self.nat -= nat
        self.revision += 1


def test_far_evidence_raises_the_gain_and_the_gain_falls_as_it_fades(dense_map):
    volume = room_with_door(dense_map)
    viewpoints, far_evidence = make(volume), Fading()
    viewpoints.evaluate(0, XY[0], volume.arrays())
    plain, potential = float(viewpoints.gain[0]), float(viewpoints.potential[0])
    viewpoints.set_far_evidence(far_evidence)
    viewpoints.update(volume.arrays(), 0.0, POSE, 0.0)
    assert viewpoints.gain[0] > 3.0 * plain
    assert viewpoints.far_evidence_at(0) == (pytest.approx(3.0), False)
    assert viewpoints.potential[0] == pytest.approx(potential), (
        "levels and cues do not end a search"
    )
    for _ in range(30):
        far_evidence.fade(0.1)
        viewpoints.update(volume.arrays(), 0.0, POSE, 0.0)
    assert viewpoints.gain[0] == pytest.approx(plain, rel=0.3)
    viewpoints.set_far_evidence(None)
    assert viewpoints.gain[0] == pytest.approx(plain)

"""What viewpoints promise, and when that is worked out again."""

import math

import numpy as np
import pytest

from ippon.geometry import base_pose
from ippon.guidance.levels import Level, LevelProbabilities
from ippon.mapping.arrays import FREE, OCCUPIED
from ippon.planning.visibility.viewpoints import ViewConfig, Viewpoints
from ippon.robot import ZED

POSE = base_pose(2.8, 2.8, 0.0, 0.0)
XY = np.array([[2.85, 2.85], [1.25, 1.25], [4.45, 2.85]])


def make(volume, **config) -> Viewpoints:
    views = Viewpoints(ViewConfig(**config), ZED, 10, 0.8)
    views.set_probabilities(LevelProbabilities().as_array())
    views.follow(volume.arrays(), 0.0, POSE, 0.0)
    return views


def stale(views, nodes) -> list[bool]:
    return views.stale(np.array(nodes), XY, 0.1).tolist()


def room_with_door(dense_map):
    volume = dense_map((8.0, 5.6, 2.4)).room((0.8, 0.8), (4.8, 4.8))
    return volume.fill((4.8, 2.3, 0.0), (4.9, 3.3, 2.0), FREE)


def test_a_viewpoint_faces_what_it_would_gain_from(dense_map):
    volume = room_with_door(dense_map)
    views = make(volume)
    views.evaluate(0, XY[0], volume.arrays())
    assert views.gain[0] > 1.0
    assert abs(math.remainder(float(views.yaw[0]), 2 * math.pi)) < ZED.horizontal_fov_rad / 2
    towards = int(np.argmin(np.abs(views.headings - 0.0)))
    away = int(np.argmin(np.abs(views.headings - math.pi)))
    assert views.by_heading[0, away] < 0.2 * views.by_heading[0, towards]


def test_only_viewpoints_that_saw_the_change_are_evaluated_again(dense_map):
    volume = room_with_door(dense_map)
    # A wall hides the far corner from viewpoint 0, not from viewpoint 2.
    volume.fill((3.6, 3.6, 0.0), (4.8, 3.7, 2.0), OCCUPIED, ooi=0.0, level=1)
    views = make(volume, unknown_looks=200)
    assert stale(views, [0, 1]) == [True, True], "never evaluated"
    for node in range(3):
        views.evaluate(node, XY[node], volume.arrays())
    views.follow(volume.arrays(), 0.0, POSE, 0.0)
    assert stale(views, [0, 1, 2]) == [False, False, False]
    volume.fill((1.6, 1.6, 0.0), (2.4, 2.4, 0.8), OCCUPIED, ooi=0.0, level=1)
    views.follow(volume.arrays(), 0.0, POSE, 0.0)
    assert stale(views, [0, 1]) == [True, True]
    for node in range(3):
        views.evaluate(node, XY[node], volume.arrays())
    volume.fill((6.4, 1.6, 0.0), (7.2, 2.4, 0.8), OCCUPIED, ooi=0.0, level=1)
    views.follow(volume.arrays(), 0.0, POSE, 0.0)
    assert stale(views, [1]) == [False], "the wall hides it"


def test_a_promising_level_raises_gain_but_not_potential(dense_map):
    volume = room_with_door(dense_map)
    volume.fill((4.4, 3.6, 0.0), (4.8, 4.4, 1.0), OCCUPIED, ooi=0.0, level=Level.AVERAGE)
    views = make(volume)
    views.evaluate(0, XY[0], volume.arrays())
    gain, potential = float(views.gain[0]), float(views.potential[0])
    volume.fill((4.4, 3.6, 0.0), (4.8, 4.4, 1.0), OCCUPIED, ooi=0.0, level=Level.CERTAIN)
    views.recount(volume.arrays())
    assert views.level[0] == Level.CERTAIN
    assert views.gain[0] > 2.0 * gain
    assert views.potential[0] == pytest.approx(potential)


def test_standing_by_a_viewpoint_wears_out_what_it_sees(dense_map):
    volume = room_with_door(dense_map)
    views = make(volume)
    views.evaluate(0, XY[0], volume.arrays())
    before = float(views.gain[0])
    aside = base_pose(2.7, 2.8, 0.0, 0.0)
    for _ in range(ViewConfig().unknown_looks):
        views.follow(volume.arrays(), 0.0, aside, 0.0, XY[0])
    views.evaluate(0, XY[0], volume.arrays())
    assert views.gain[0] < 0.3 * before


def test_object_voxels_make_a_viewpoint_terminate_and_frame_them(dense_map):
    volume = room_with_door(dense_map)
    volume.fill((3.3, 2.6, 0.3), (3.5, 3.1, 0.7), OCCUPIED, ooi=0.95)
    views = make(volume)
    views.evaluate(0, XY[0], volume.arrays())
    assert views.termination[0] >= 8
    yaw, tilt = views.frames_object(0)
    assert abs(math.remainder(yaw, 2 * math.pi)) < 0.4
    assert tilt < -0.3
    views.evaluate(1, XY[1], volume.arrays())
    assert views.termination[1] == 0, "too far away"
    assert views.frames_object(1) == (views.yaw[1], views.tilt[1])


def test_forgetting_a_node_clears_its_row(dense_map):
    volume = room_with_door(dense_map)
    views = make(volume)
    views.evaluate(0, XY[0], volume.arrays())
    views.forget(0)
    assert views.gain[0] == 0.0
    assert stale(views, [0]) == [True]


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ({"yaw_bins": 50}, "multiple of heading_stride"),
        ({"unknown_occupied": 0.0}, "in \\(0, 1]"),
        ({"termination_depth_m": -0.1}, "at least 0"),
        ({"termination_depth_m": math.inf}, "finite"),
    ],
)
def test_rasters_and_probabilities_that_cannot_work_are_refused(values, text):
    with pytest.raises(ValueError, match=text):
        ViewConfig(**values)


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
    views, far_evidence = make(volume), Fading()
    views.evaluate(0, XY[0], volume.arrays())
    plain, potential = float(views.gain[0]), float(views.potential[0])
    views.set_far_evidence(far_evidence)
    views.follow(volume.arrays(), 0.0, POSE, 0.0)
    assert views.gain[0] > 3.0 * plain
    assert views.far_evidence_at(0) == (pytest.approx(3.0), False)
    assert views.potential[0] == pytest.approx(potential), "what ends a search is not moved by it"
    for _ in range(30):
        far_evidence.fade(0.1)
        views.follow(volume.arrays(), 0.0, POSE, 0.0)
    assert views.gain[0] == pytest.approx(plain, rel=0.3)
    views.set_far_evidence(None)
    assert views.gain[0] == pytest.approx(plain)

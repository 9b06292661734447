import numpy as np
import pytest

from app.messages.driving import DriveStatus
from app.view.camera.overlays import CameraScene, lines_of
from app.view.drawing.find_layer import ObjectMark
from ippon.camera import PinholeCamera
from ippon.geometry import base_pose
from ippon.robot import ZED

CAMERA = PinholeCamera.from_horizontal_fov(640, 480, 1.4)
BASE = base_pose(0.0, 0.0, 0.0, 0.0)
MOUNTED = BASE @ ZED.T_base_camera(-0.35)
AHEAD = np.array([[0.0, 0.0, 0.0], [3.0, 0.0, 0.0]])


def _scene(**changes):
    scene = {
        "camera": CAMERA,
        "poses": ((1_000, MOUNTED),),
        "T_world_base": BASE,
        "path_world": AHEAD,
        "drive": DriveStatus(body_half_width_m=0.25, stop_within_m=0.4, slow_within_m=1.6),
    }
    return CameraScene(**(scene | changes))


def _find(center, found=True):
    return ObjectMark(center_world=center, size_m=(0.3, 0.3, 0.2), text="hat 93%", found=found)


def _of(lines, kind):
    return [line for line in lines if line.kind == kind]


def test_the_way_runs_up_the_middle_of_the_picture():
    lines = lines_of(_scene(), 1_000, 0, None)
    (way,) = _of(lines, "way")
    xs, ys = np.array(way.points).T
    np.testing.assert_allclose(xs, 0.5, atol=0.01)
    assert (np.diff(ys) < 0.0).all(), "farther is higher"
    left, right = _of(lines, "edge")
    assert left.points[-1][0] < 0.5 < right.points[-1][0]


def test_an_object_is_outlined_round_its_projection():
    center = (2.0, 0.3, 0.4)
    (outline,) = _of(lines_of(_scene(objects=(_find(center),)), 1_000, 0, None), "find")
    assert outline.text == "hat 93%"
    assert outline.points[0] == outline.points[-1]
    inverse = np.linalg.inv(MOUNTED)
    point = inverse[:3, :3] @ np.array(center) + inverse[:3, 3]
    u, v = CAMERA.project(point[None])
    xs, ys = np.array(outline.points).T
    assert xs.min() < u[0] / 640 < xs.max()
    assert ys.min() < v[0] / 480 < ys.max()


@pytest.mark.parametrize("center", [(-2.0, 0.0, 0.4), (1.0, 6.0, 0.4)])
def test_what_is_behind_or_beside_the_image_is_not_drawn(center):
    assert not _of(lines_of(_scene(objects=(_find(center),)), 1_000, 0, None), "find")


def test_candidates_far_away_are_not_outlined():
    near, far = _find((4.0, 0.0, 0.4), found=False), _find((20.0, 0.0, 0.4), found=False)
    assert len(_of(lines_of(_scene(objects=(near, far)), 1_000, 0, None), "candidate")) == 1


def test_limits_are_drawn_while_somebody_drives():
    auto = lines_of(_scene(), 1_000, 0, None)
    assert not _of(auto, "stop")
    drive = DriveStatus(mode="manual", body_half_width_m=0.25, stop_within_m=1.1, slow_within_m=1.6)
    lines = lines_of(_scene(drive=drive), 1_000, 0, (0.3, 0.0))
    (stop,), (slow,) = _of(lines, "stop"), _of(lines, "slow")
    assert stop.points[8][1] > slow.points[8][1], "nearer is lower"


def test_a_turning_command_bends_the_way():
    drive = DriveStatus(mode="manual")
    (way,) = _of(lines_of(_scene(drive=drive), 1_000, 0, (0.5, 0.25)), "way")
    assert way.points[-1][0] < 0.45, "to the left"


def test_lines_turn_with_the_picture():
    upright = lines_of(_scene(), 1_000, 0, None)
    turned = lines_of(_scene(), 1_000, 1, None)
    (x, y), (u, v) = _of(upright, "way")[0].points[3], _of(turned, "way")[0].points[3]
    assert (u, v) == pytest.approx((y, 1.0 - x))


def test_the_pose_nearest_to_the_image_counts():
    elsewhere = base_pose(5.0, 5.0, 0.0, 3.0) @ ZED.T_base_camera(-0.35)
    scene = _scene(poses=((1_000, MOUNTED), (90_000, elsewhere)))
    assert _of(lines_of(scene, 2_000, 0, None), "way")
    assert scene.pose_at(80_000) is elsewhere


def test_nothing_is_drawn_before_the_pose_is_known():
    assert lines_of(_scene(poses=()), 1_000, 0, None) == []
    assert lines_of(CameraScene(), 1_000, 0, None) == []

"""What contradicts a robot's profile is said with both values."""

import dataclasses
import math

import numpy as np
import pytest

from app.nodes.navigator import profile_check
from app.nodes.navigator.profile_check import (
    ProfileCheck,
    depth_unit_mismatch,
    profile_mismatches,
)
from ippon.camera import PinholeCamera
from ippon.frame import Frame
from ippon.geometry import make_transform, rotation_z
from ippon.robot import HABITAT, ZED
from ippon.simulation.robot.mobile_base import camera_of


def frame_of(profile, tilt_rad=-0.2, T_base_camera=None, camera=None):
    T_world_base = make_transform(rotation_z(2.0), (4.0, -3.0, 0.7))
    mount = profile.T_base_camera(tilt_rad) if T_base_camera is None else T_base_camera
    if camera is None:
        camera = camera_of(profile, 160)
    return Frame(
        stamp_ns=0,
        color=np.zeros((camera.height, camera.width, 3), np.uint8),
        depth=np.ones((camera.height, camera.width), np.float32),
        camera=camera,
        T_world_camera=T_world_base @ mount,
        T_world_base=T_world_base,
        tilt_rad=tilt_rad,
        heatmap=None,
    )


@pytest.mark.parametrize("profile", [ZED, HABITAT])
@pytest.mark.parametrize("tilt_rad", [-1.1, 0.0, 0.4])
def test_a_robot_that_is_what_its_profile_says(profile, tilt_rad):
    assert profile_mismatches(profile, frame_of(profile, tilt_rad)) == ()


def test_another_mast():
    lower = dataclasses.replace(ZED, camera_height_m=0.6)
    (text,) = profile_mismatches(lower, frame_of(ZED))
    assert "1.20 m above the base, the profile says 0.60 m" in text


def test_a_camera_elsewhere():
    forward = dataclasses.replace(ZED, camera_forward_m=0.5)
    (text,) = profile_mismatches(ZED, frame_of(forward))
    assert "0.50 m ahead and 0.00 m to the left of the base, the profile says 0.00 m" in text


def test_a_camera_that_looks_aside():
    aside = make_transform(rotation_z(math.pi / 2), (0.0, 0.0, 0.0)) @ ZED.T_base_camera(0.0)
    (text,) = profile_mismatches(ZED, frame_of(ZED, T_base_camera=aside))
    assert "looks 90 degrees to the left of where the base drives" in text


def test_a_frame_that_is_not_the_optical_one():
    link = make_transform(np.eye(3), (0.0, 0.0, 1.2))
    texts = profile_mismatches(ZED, frame_of(ZED, T_base_camera=link))
    (text,) = texts
    assert "tilted by 90 degrees, the profile says -69 to 25: does camera_info name the opt" in text


def test_a_rolled_camera():
    rolled = ZED.T_base_camera(0.0) @ make_transform(rotation_z(0.5), (0.0, 0.0, 0.0))
    (text,) = profile_mismatches(ZED, frame_of(ZED, T_base_camera=rolled))
    assert "optical frame" in text


def test_a_camera_upside_down():
    turned = ZED.T_base_camera(0.0) @ make_transform(rotation_z(math.pi), (0.0, 0.0, 0.0))
    (text,) = profile_mismatches(ZED, frame_of(ZED, T_base_camera=turned))
    assert "rolled by 180 degrees" in text


def test_another_lens_and_other_images():
    camera = PinholeCamera.from_horizontal_fov(160, 120, math.radians(90.0))
    wide, shape = profile_mismatches(ZED, frame_of(ZED, camera=camera))
    assert "camera_info says 90 degrees from left to right, the profile 74" in wide
    assert "images are 160 x 120, the profile says 1.6 times as wide as high" in shape


@pytest.mark.parametrize("is_turned", [False, True])
def test_a_camera_that_is_mounted_upside_down_is_told_once(monkeypatch, is_turned):
    monkeypatch.setattr(profile_check, "CHECK_EVERY_S", 0.0)
    said = []
    check = ProfileCheck(ZED, lambda _, text: said.append(text))
    seen = floor_depth(ZED.T_base_camera(-0.35))
    for k in range(8):
        frame = frame_of(ZED, tilt_rad=-0.35)
        turn = make_transform(rotation_z(0.8 * k), (0.0, 0.0, 0.0))
        check.check(
            dataclasses.replace(
                frame,
                depth=np.ascontiguousarray(seen[::-1, ::-1]) if is_turned else seen,
                T_world_camera=turn @ frame.T_world_camera,
                T_world_base=turn @ frame.T_world_base,
            )
        )
    upside_down = [text for text in said if "upside down" in text]
    assert len(upside_down) == is_turned
    assert any("upside down" in note for note in check.notes()) == is_turned


@pytest.mark.parametrize("away_m", [0.32, 0.36, 0.4, 0.45, 0.5])
@pytest.mark.parametrize("tilt_rad", [-0.1, 0.0, 0.05, 0.1, 0.2])
@pytest.mark.parametrize("turned_rad", [0.0, 0.5, 1.0])
def test_what_is_right_before_a_level_camera_is_no_other_unit(away_m, tilt_rad, turned_rad):
    """A wall, straight ahead or aslant, beside the floor that shows below it."""
    mount = ZED.T_base_camera(tilt_rad)
    towards = camera_of(ZED, 160).rays() @ mount[:3, :3].T
    ahead = np.maximum(towards @ (math.cos(turned_rad), math.sin(turned_rad), 0.0), 1e-3)
    wall = np.minimum(away_m / ahead, 5.0)
    seen = floor_depth(mount)
    depth = np.where((seen > 0.0) & (seen < wall), seen, wall).astype(np.float32)
    frame = dataclasses.replace(frame_of(ZED, tilt_rad), depth=depth)
    assert depth_unit_mismatch(frame) is None


@pytest.mark.parametrize(
    ("factor", "wrong"), [(0.1, "10 times too short"), (1000.0, "1000 times too long")]
)
def test_another_unit_is_told_by_the_floor_of_three_views(monkeypatch, factor, wrong):
    monkeypatch.setattr(profile_check, "CHECK_EVERY_S", 0.0)
    said = []
    check = ProfileCheck(ZED, lambda _, text: said.append(text))
    for k in range(4):
        assert bool(said) == (k > 2)
        for _ in range(3):  # A robot that stands still shows the same view again.
            check.check(floor_frame(factor, turned_rad=0.4 * k))
    (text,) = said
    assert f"depth is {wrong} for a floor 1.20 m below the camera" in text


def test_a_shelf_at_the_height_of_the_camera_is_no_other_unit(monkeypatch):
    monkeypatch.setattr(profile_check, "CHECK_EVERY_S", 0.0)
    said = []
    check = ProfileCheck(ZED, lambda _, text: said.append(text))
    # A level surface 12 cm below the camera has the depth of a floor in centimetres.
    for k in range(9):
        check.check(floor_frame(0.1 if k % 3 else 1.0, turned_rad=0.4 * k))
    assert said == []
    assert check.notes() == ()


def floor_frame(factor, turned_rad):
    """Return a frame of an endless floor with depth that is wrong by a factor."""
    frame = frame_of(ZED, tilt_rad=-0.35)
    turn = make_transform(rotation_z(turned_rad), (0.0, 0.0, 0.0))
    return dataclasses.replace(
        frame,
        depth=floor_depth(ZED.T_base_camera(-0.35)) * np.float32(factor),
        T_world_camera=turn @ frame.T_world_camera,
        T_world_base=turn @ frame.T_world_base,
    )


def floor_depth(T_base_camera):
    """Depth of an endless floor, seen by a camera that looks down."""
    camera = camera_of(ZED, 160)
    down = -(camera.rays() @ T_base_camera[2, :3])
    depth = np.where(down > 0.05, T_base_camera[2, 3] / np.maximum(down, 0.05), 0.0)
    return depth.astype(np.float32)

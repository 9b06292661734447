"""Images that are upside down are told, others are not."""

import dataclasses
import math

import numpy as np
import pytest

from ippon.camera import PinholeCamera
from ippon.frame import Frame
from ippon.geometry import R_BASE_CAMERA_LEVEL, make_transform, rotation_y, rotation_z
from ippon.tracking.upright import UprightCheck

CAMERA = PinholeCamera.from_horizontal_fov(160, 120, 1.2)
ROOM = ((-3.0, -3.0, 0.0), (3.0, 3.0, 2.5))
UPSIDE_DOWN = np.diag([-1.0, -1.0, 1.0])
"""The camera's frame, turned about its optical axis."""


def view(yaw, tilt_deg):
    """A frame of an empty room of 6 x 6 x 2.5 m, from its middle."""
    R = rotation_z(yaw) @ rotation_y(-math.radians(tilt_deg)) @ R_BASE_CAMERA_LEVEL
    at = np.array((0.0, 0.0, 1.2))
    rays = CAMERA.rays() @ R.T
    with np.errstate(divide="ignore"):
        faces = (np.where(rays > 0.0, ROOM[1], ROOM[0]) - at) / rays
    return Frame(
        stamp_ns=0,
        color=np.zeros((120, 160, 3), np.uint8),
        depth=faces.min(axis=2).astype(np.float32),
        camera=CAMERA,
        T_world_camera=make_transform(R, at),
        T_world_base=make_transform(rotation_z(yaw), (0.0, 0.0, 0.0)),
        tilt_rad=math.radians(tilt_deg),
    )


def turned_images(frame):
    """A camera that is mounted upside down, which its transform does not say."""
    return dataclasses.replace(
        frame,
        depth=np.ascontiguousarray(frame.depth[::-1, ::-1]),
        camera=dataclasses.replace(CAMERA, cx=159.0 - CAMERA.cx, cy=119.0 - CAMERA.cy),
    )


def posed(frame, rotation):
    pose = make_transform(rotation, frame.T_world_camera[:3, 3])
    return dataclasses.replace(frame, T_world_camera=pose)


def turned_camera(frame):
    """A camera that is mounted upside down, as its transform says."""
    return posed(turned_images(frame), frame.T_world_camera[:3, :3] @ UPSIDE_DOWN)


def turned_world(frame):
    """The same in a world whose up was taken from this camera."""
    R = np.diag([1.0, -1.0, -1.0]) @ frame.T_world_camera[:3, :3] @ UPSIDE_DOWN
    return posed(turned_images(frame), R)


def world_turned_over(frame):
    """The same in a world whose z axis points down."""
    return posed(frame, np.diag([1.0, -1.0, -1.0]) @ frame.T_world_camera[:3, :3])


def check_of(change, tilt_deg, views=6):
    check = UprightCheck()
    for k in range(views):
        check.add(change(view(k * math.pi / 3.0, tilt_deg)))
    return check


def looked(change, tilt_deg, views=6):
    return check_of(change, tilt_deg, views).is_upside_down


@pytest.mark.parametrize("tilt_deg", [-45.0, -20.0, -5.0])
def test_images_that_are_upside_down_are_told(tilt_deg):
    assert not looked(lambda frame: frame, tilt_deg)
    assert looked(turned_images, tilt_deg)
    assert looked(turned_camera, tilt_deg)
    assert looked(turned_world, tilt_deg)


@pytest.mark.parametrize("tilt_deg", [-40.0, -20.0, -5.0])
def test_a_world_that_is_upside_down_is_told_from_its_images(tilt_deg):
    check = check_of(world_turned_over, tilt_deg)
    assert (check.is_world_upside_down, check.is_upside_down) == (True, False)
    for right in (lambda frame: frame, turned_images, turned_camera, turned_world):
        assert not check_of(right, tilt_deg).is_world_upside_down
    assert not check_of(world_turned_over, tilt_deg, views=4).is_world_upside_down


def test_one_view_does_not_tell():
    assert not looked(turned_images, -20.0, views=4)
    check = UprightCheck()
    for _ in range(10):
        check.add(turned_images(view(0.0, -20.0)))
    assert not check.is_upside_down


def test_frames_without_depth_do_not_count():
    nothing = np.zeros((120, 160), np.float32)
    assert not looked(lambda frame: dataclasses.replace(frame, depth=nothing), -20.0)

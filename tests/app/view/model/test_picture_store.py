"""Pictures are kept when the camera has moved on, and found by what they show."""

import numpy as np

from app.messages.images import CompressedColor
from app.view.model.picture_store import KEPT, PictureStore
from ippon.camera import PinholeCamera

CAMERA = PinholeCamera(width=100, height=80, fx=50.0, fy=50.0, cx=50.0, cy=40.0)


def pose(x: float = 0.0):
    T = np.eye(4)
    T[0, 3] = x
    return T


def test_a_camera_that_stands_gives_one_picture():
    pictures = PictureStore()
    for n in range(5):
        pictures.add(n, b"jpeg", CAMERA, pose(0.01 * n))
    assert [p.number for p, *_ in pictures.showing(np.array([0.0, 0.0, 2.0]), 5.0)] == [0]


def test_the_closest_picture_that_shows_a_point_comes_first():
    pictures = PictureStore()
    near = pose(0.5)
    near[2, 3] = 1.0
    pictures.add(0, b"far", CAMERA, pose())
    pictures.add(1, b"near", CAMERA, near)
    away = pose(30.0)
    pictures.add(2, b"elsewhere", CAMERA, away)
    shown = pictures.showing(np.array([0.0, 0.0, 3.0]), 5.0)
    assert [(p.encoded, u, v, depth) for p, u, v, depth in shown] == [
        (b"near", 37, 40, 2.0),
        (b"far", 50, 40, 3.0),
    ]
    assert pictures.showing(np.array([0.0, 0.0, -3.0]), 5.0) == [], "behind the camera"


def test_an_album_does_not_grow_without_end():
    pictures = PictureStore()
    for n in range(KEPT + 20):
        pictures.add(n, b"", CAMERA, pose(float(n)))
    assert pictures.find(0) is None
    assert pictures.find(KEPT + 19) is not None
    pictures.clear()
    assert pictures.find(KEPT + 19) is None


def test_a_picture_has_the_pose_of_its_time_and_of_another_clock_the_last_one():
    poses = [(1_000_000_000 + 100_000_000 * n, pose(float(n))) for n in range(5)]
    stamps_ns = (900_000_000, 1_140_000_000, 60_000_000, 9_000_000_000)
    for stamp_ns, x in zip(stamps_ns, (0.0, 1.0, 4.0, 4.0), strict=True):
        pictures = PictureStore()
        image = CompressedColor(stamp_ns=stamp_ns, frame_id="camera", encoded=b"jpeg")
        pictures.hold(image, CAMERA)
        pictures.place(poses)
        assert pictures.find(0).T_world_camera[0, 3] == x

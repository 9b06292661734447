"""Pictures are kept when the camera has moved on, and found by what they show."""

import numpy as np

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

"""The averaged surface, and which of it a camera has in view."""

import numpy as np

from ippon.camera import PinholeCamera
from ippon.tracking.depth_points import SurfacePoints
from ippon.tracking.surface_model import MOST_COUNTED, SurfaceModel

CAMERA = PinholeCamera.from_horizontal_fov(160, 120, 1.2)
TOWARDS = np.array([[0.0, 0.0, -1.0]])


def points(*rows, normal=TOWARDS):
    return SurfacePoints(np.array(rows, float), np.repeat(normal, len(rows), axis=0))


def in_view(model):
    return model.in_view(CAMERA, np.eye(4), 5.0)


def test_points_of_one_cell_are_averaged_until_it_is_settled():
    model = SurfaceModel(0.05)
    model.add(points((0.01, 0.01, 2.01)))
    model.add(points((0.01, 0.01, 2.03)))
    assert len(model) == 1
    assert np.allclose(in_view(model).points, [[0.01, 0.01, 2.02]])
    for _ in range(2 * MOST_COUNTED):
        model.add(points((0.01, 0.01, 2.03)))
    before = in_view(model).points
    model.add(points((0.04, 0.01, 2.03)))
    assert np.array_equal(in_view(model).points, before)


def test_it_grows_in_any_order():
    rng = np.random.default_rng(2)
    cloud = rng.uniform((-0.5, -0.4, 1.5), (0.5, 0.4, 2.5), (500, 3))
    at_once, parts = SurfaceModel(0.05), SurfaceModel(0.05)
    at_once.add(SurfacePoints(cloud, np.repeat(TOWARDS, 500, axis=0)))
    for part in np.array_split(cloud[rng.permutation(500)], 7):
        parts.add(SurfacePoints(part, np.repeat(TOWARDS, len(part), axis=0)))
    assert len(parts) == len(at_once)
    assert (np.diff(parts._cells) > 0).all()


def test_only_what_faces_the_camera_ahead_of_it_is_in_view():
    model = SurfaceModel(0.05)
    model.add(points((0.0, 0.0, 2.0), (0.0, 0.0, -2.0), (4.0, 0.0, 2.0), (0.0, 0.0, 6.0)))
    model.add(points((0.3, 0.0, 2.0), normal=-TOWARDS))
    assert np.allclose(in_view(model).points, [[0.0, 0.0, 2.0]])

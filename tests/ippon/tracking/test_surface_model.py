"""The averaged surface, and which of it a camera has in view."""

import numpy as np
import pytest

from ippon.camera import PinholeCamera
from ippon.geometry import R_BASE_CAMERA_LEVEL, make_transform, rotation_y, rotation_z
from ippon.tracking.depth_points import SurfacePoints, cells
from ippon.tracking.surface_model import MARGIN, MOST_COUNTED, SurfaceModel

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
    assert (np.diff(parts._cells.numbers) > 0).all()


def test_many_frames_give_the_mean_of_each_cell():
    """The twin keeps every point."""
    rng = np.random.default_rng(3)
    model, twin = SurfaceModel(0.05), {}
    for _ in range(200):
        cloud = rng.uniform((-0.2, -0.2, 1.5), (0.2, 0.2, rng.uniform(1.6, 2.5)), (100, 3))
        seen = points(*cloud).thinned(0.05)
        model.add(seen)
        for number, point in zip(cells(seen.points, 0.05).tolist(), seen.points, strict=True):
            twin.setdefault(number, []).append(point)
    assert len(model) == len(twin)
    assert len(model._cells.numbers) < len(twin), "some wait to be merged"
    assert max(map(len, twin.values())) > MOST_COUNTED
    expected = [np.mean(twin[number][:MOST_COUNTED], axis=0) for number in sorted(twin)]
    assert np.allclose(in_view(model).points, expected)


def test_a_frame_that_shows_little_new_surface_does_not_copy_the_rest():
    model = SurfaceModel(0.05)
    room = [(0.1 * k, 0.0, 2.0) for k in range(100)]
    model.add(points(*room))
    before = model._cells.points
    model.add(points(*room))
    model.add(points(*room, (0.0, 1.0, 2.0)))
    assert model._cells.points is before
    assert len(model) == 101


def test_only_what_faces_the_camera_ahead_of_it_is_in_view():
    model = SurfaceModel(0.05)
    model.add(points((0.0, 0.0, 2.0), (0.0, 0.0, -2.0), (4.0, 0.0, 2.0), (0.0, 0.0, 6.0)))
    model.add(points((0.3, 0.0, 2.0), normal=-TOWARDS))
    assert np.allclose(in_view(model).points, [[0.0, 0.0, 2.0]])


@pytest.mark.parametrize("seed", range(5))
def test_of_a_large_place_the_same_is_in_view_as_of_all_of_it(seed):
    """The twin projects every point."""
    rng = np.random.default_rng(seed)
    count = 20_000
    cloud = rng.uniform((-20.0, -20.0, -2.0), (20.0, 20.0, 2.0), (count, 3))
    normals = rng.normal(size=(count, 3))
    model = SurfaceModel(0.05)
    model.add(SurfacePoints(cloud, normals / np.linalg.norm(normals, axis=1)[:, None]))
    pose = make_transform(
        rotation_z(rng.uniform(-3, 3)) @ rotation_y(rng.uniform(-0.5, 0.5)) @ R_BASE_CAMERA_LEVEL,
        rng.uniform((-18, -18, -1), (18, 18, 1)),
    )
    at = SurfacePoints(model._cells.points, model._cells.normals).moved(np.linalg.inv(pose))
    z = at.points[:, 2]
    u, v = CAMERA.fx * at.points[:, 0] / z + CAMERA.cx, CAMERA.fy * at.points[:, 1] / z + CAMERA.cy
    expected = (z > 0.0) & (z < 5.0) & ((at.points * at.normals).sum(axis=1) < 0.0)
    expected &= (u > -MARGIN * 160) & (u < (1 + MARGIN) * 160)
    expected &= (v > -MARGIN * 120) & (v < (1 + MARGIN) * 120)
    assert expected.sum() > 5
    found = model.in_view(CAMERA, pose, 5.0)
    assert np.array_equal(found.points, model._cells.points[expected])
    assert np.array_equal(found.normals, model._cells.normals[expected])
    assert len(model._cells.around(pose[:3, 3], 8.0, 0.05)) < 0.3 * count

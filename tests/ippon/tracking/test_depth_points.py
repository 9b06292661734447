"""Points and normals of planes whose depth is known."""

import numpy as np

from ippon.camera import PinholeCamera
from ippon.tracking.depth_points import SurfacePoints, cells, points_of

CAMERA = PinholeCamera.from_horizontal_fov(160, 120, 1.2)


def slanted(slope=0.5, distance=2.0):
    """Depth of the plane z = distance + slope * x."""
    rays = CAMERA.rays()
    return (distance / (1.0 - slope * rays[..., 0])).astype(np.float32)


def test_points_of_a_slanted_plane_lie_on_it_with_its_normal_towards_the_camera():
    seen = points_of(slanted(), CAMERA, 0.3, 5.0)
    x, _, z = seen.points.T
    assert np.abs(z - 2.0 - 0.5 * x).max() < 1e-4
    expected = np.array([0.5, 0.0, -1.0]) / np.hypot(0.5, 1.0)
    assert np.abs(seen.normals - expected).max() < 1e-3
    assert (np.sum(seen.points * seen.normals, axis=1) < 0.0).all()


def test_edges_holes_and_other_ranges_are_left_out():
    depth = slanted(0.0)
    depth[:, 80:] = 3.0
    depth[50:54, 20:24] = 0.0
    depth[0, 0] = np.nan
    seen = points_of(depth, CAMERA, 0.3, 2.5)
    assert 0 < len(seen) < 80 * 120
    assert np.abs(seen.points[:, 2] - 2.0).max() < 1e-6
    assert (seen.normals[:, 2] < -0.999).all()


def test_each_cell_keeps_one_point_also_at_negative_coordinates():
    points = np.array([[-0.01, 0.0, 0.0], [0.01, 0.0, 0.0], [0.02, 0.0, 0.0]])
    assert len(set(cells(points, 0.05).tolist())) == 2
    assert len(SurfacePoints(points, points).thinned(0.05)) == 2

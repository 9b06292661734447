import math

import numpy as np
import pytest

from ippon.camera import PinholeCamera


def test_field_of_view_is_kept_when_scaled() -> None:
    camera = PinholeCamera.from_horizontal_fov(400, 250, math.radians(74.0))
    half = camera.scaled_to(200, 125)
    assert math.isclose(camera.horizontal_fov, math.radians(74.0), rel_tol=1e-12)
    assert math.isclose(half.horizontal_fov, camera.horizontal_fov, rel_tol=1e-12)
    assert half.cx == (200 - 1) / 2


def test_back_projection_is_the_inverse_of_projection() -> None:
    camera = PinholeCamera(width=8, height=6, fx=7.0, fy=7.5, cx=3.2, cy=2.9)
    rng = np.random.default_rng(0)
    depth = rng.uniform(0.5, 4.0, (6, 8)).astype(np.float32)
    depth[2, 3] = 0.0
    points = camera.back_project(depth)
    assert points.shape == (47, 3)
    v, u = np.nonzero(depth > 0)
    assert np.allclose(points[:, 0] / points[:, 2] * 7.0 + 3.2, u, atol=1e-5)
    assert np.allclose(points[:, 1] / points[:, 2] * 7.5 + 2.9, v, atol=1e-5)


def test_rays_pass_through_pixel_centres() -> None:
    camera = PinholeCamera.from_horizontal_fov(5, 3, 1.0)
    rays = camera.rays()
    assert np.allclose(rays[1, 2], [0.0, 0.0, 1.0])
    assert rays[0, 0, 0] < 0 < rays[0, 4, 0]
    assert rays[0, 0, 1] < 0 < rays[2, 0, 1]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"width": 0}, "image size"),
        ({"fx": -1.0}, "focal lengths"),
        ({"fy": math.nan}, "focal lengths"),
        ({"cx": 1e6}, "principal point"),
    ],
)
def test_absurd_intrinsics_are_refused(change: dict[str, float], message: str) -> None:
    good = {"width": 64, "height": 48, "fx": 60.0, "fy": 60.0, "cx": 31.5, "cy": 23.5}
    with pytest.raises(ValueError, match=message):
        PinholeCamera(**{**good, **change})  # type: ignore[arg-type]


def test_depth_of_another_size_is_refused() -> None:
    camera = PinholeCamera.from_horizontal_fov(5, 3, 1.0)
    with pytest.raises(ValueError, match=r"depth is \(5, 3\)"):
        camera.back_project(np.ones((5, 3), dtype=np.float32))


def test_a_point_falls_on_the_pixel_that_it_was_lifted_from():
    camera = PinholeCamera.from_horizontal_fov(8, 6, 1.2)
    depth = np.linspace(0.5, 4.0, 48, dtype=np.float32).reshape(6, 8)
    u, v = camera.project(camera.back_project(depth).astype(np.float64))
    rows, columns = np.indices(depth.shape)
    np.testing.assert_allclose(u, columns.ravel(), atol=1e-5)
    np.testing.assert_allclose(v, rows.ravel(), atol=1e-5)


def test_pixels_lifted_by_their_depth_project_onto_themselves():
    camera = PinholeCamera.from_horizontal_fov(64, 48, 1.2)
    u, v = np.array([0, 40, 63]), np.array([47.0, 10.5, 0.0])
    points = camera.lift(u, v, np.array([0.5, 2.0, 3.0]))
    assert points[:, 2].tolist() == [0.5, 2.0, 3.0]
    assert np.allclose(camera.project(points), (u, v))

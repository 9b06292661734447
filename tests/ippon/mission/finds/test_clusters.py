import numpy as np
import pytest

from ippon.camera import PinholeCamera
from ippon.geometry import R_BASE_CAMERA_LEVEL, make_transform
from ippon.mission.finds.clusters import cluster_finds, project_box

CAMERA = PinholeCamera.from_horizontal_fov(200, 100, 1.5)
T_WORLD_CAMERA = make_transform(R_BASE_CAMERA_LEVEL, (0.0, 0.0, 1.0))


def test_voxels_that_touch_are_one_find_and_the_largest_comes_first() -> None:
    near = np.array([[2.0, 0.0, 1.0], [2.0, 0.1, 1.0], [2.0, 0.2, 1.1]])
    far = np.array([[4.0, 1.0, 1.0]])
    finds = cluster_finds(
        np.concatenate([far, near]),
        np.array([0.9, 0.6, 0.7, 0.8]),
        0.1,
        camera=CAMERA,
        T_world_camera=T_WORLD_CAMERA,
    )
    assert [f.voxels for f in finds] == [3, 1]
    assert finds[0].probability == pytest.approx(0.7)
    assert finds[0].size_m == pytest.approx((0.1, 0.3, 0.2))
    box = finds[0].box_px
    assert box is not None
    u0, v0, u1, v1 = box
    assert u0 < 99.5 < u1
    assert v0 < 49.5 < v1


def test_no_voxels_no_finds() -> None:
    none = cluster_finds(
        np.empty((0, 3)), np.empty(0), 0.1, camera=CAMERA, T_world_camera=T_WORLD_CAMERA
    )
    assert none == ()


def test_a_find_that_is_too_large_is_reduced_to_what_is_sure_of_it() -> None:
    row = np.array([[2.0, 0.1 * k, 1.0] for k in range(10)])
    p = np.where(np.arange(10) < 3, 0.995, 0.9)

    def finds(longest_m: float, p: np.ndarray):
        return cluster_finds(
            row, p, 0.1, camera=CAMERA, T_world_camera=T_WORLD_CAMERA,
            is_too_large=lambda find: max(find.size_m) > longest_m, sure=0.99,
        )  # fmt: skip

    (whole,) = finds(1.1, p)
    assert whole.voxels == 10
    (part,) = finds(0.5, p)
    assert (part.voxels, part.position_world) == (3, pytest.approx((2.0, 0.1, 1.0)))
    assert [f.voxels for f in finds(0.2, p)] == [10], "its sure part is too large, too"
    assert [f.voxels for f in finds(0.5, np.full(10, 0.9))] == [10], "nothing of it is sure"
    assert [f.voxels for f in finds(0.5, np.full(10, 0.995))] == [10]
    ends = np.where((np.arange(10) < 3) | (np.arange(10) > 7), 0.995, 0.9)
    assert [f.voxels for f in finds(0.5, ends)] == [3, 2]


def test_what_lies_behind_has_no_box() -> None:
    assert project_box(np.array([[-2.0, 0.0, 1.0]]), 0.1, CAMERA, T_WORLD_CAMERA) is None

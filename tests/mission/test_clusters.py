import numpy as np
import pytest

from ippon.camera import PinholeCamera
from ippon.geometry import R_BASE_CAMERA_LEVEL, make_transform
from ippon.mapping.arrays import FREE, NOT_MAPPED, OCCUPIED, MapArrays
from ippon.mission.clusters import OoiVoxels, cluster_finds, project_box

CAMERA = PinholeCamera.from_horizontal_fov(200, 100, 1.5)
T_WORLD_CAMERA = make_transform(R_BASE_CAMERA_LEVEL, (0.0, 0.0, 1.0))


@pytest.fixture
def arrays() -> MapArrays:
    directory = np.full((2, 2, 1), -1, np.int32)
    directory[0, 0, 0], directory[1, 1, 0] = 0, 1
    state = np.full((2, 512), FREE, np.uint8)
    ooi = np.full((2, 512), NOT_MAPPED, np.uint8)
    return MapArrays(
        voxel_size=0.1,
        origin_block=np.array([-1, 0, 2], np.int64),
        directory=directory,
        state=state,
        slab=np.array([0, 1], np.int32),
        ooi=ooi,
        level=np.full((2, 512), NOT_MAPPED, np.uint8),
        squared_distance=np.full((2, 512), 100, np.uint16),
        revision=np.array([1, 1], np.int64),
    )


def put(arrays: MapArrays, row: int, voxel: tuple[int, int, int], p: float) -> None:
    c = (voxel[0] * 8 + voxel[1]) * 8 + voxel[2]
    arrays.state[row, c] = OCCUPIED
    arrays.ooi[row, c] = round(p * 254)
    arrays.revision[row] += 1


def test_centres_and_probabilities_of_the_voxels_above_the_threshold(arrays: MapArrays) -> None:
    put(arrays, 0, (7, 0, 3), 0.9)
    put(arrays, 1, (1, 2, 3), 0.7)
    put(arrays, 1, (1, 2, 4), 0.5)
    centres, p = OoiVoxels(0.6).update(arrays)
    assert np.allclose(centres, [[-0.05, 0.05, 1.95], [0.15, 1.05, 1.95]])
    assert np.allclose(p, [0.9, 0.7], atol=0.003)


def test_only_changed_blocks_are_counted_again(arrays: MapArrays) -> None:
    voxels = OoiVoxels(0.6)
    put(arrays, 0, (0, 0, 0), 0.9)
    assert len(voxels.update(arrays)[0]) == 1
    arrays.ooi[0, :] = 0
    arrays.revision[0] += 5
    assert len(voxels.update(arrays)[0]) == 0


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


def test_what_lies_behind_has_no_box() -> None:
    assert project_box(np.array([[-2.0, 0.0, 1.0]]), 0.1, CAMERA, T_WORLD_CAMERA) is None

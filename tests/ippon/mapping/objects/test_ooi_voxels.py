import numpy as np
import pytest

from ippon.mapping.arrays import FREE, NOT_MAPPED, OCCUPIED, MapArrays
from ippon.mapping.objects.ooi_voxels import OoiVoxels, nearest_voxels


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


def test_a_voxel_must_be_above_the_threshold_and_occupied(arrays: MapArrays) -> None:
    voxels = OoiVoxels(0.85)
    put(arrays, 0, (0, 0, 0), 216 / 254)
    put(arrays, 0, (0, 0, 1), 215 / 254)
    put(arrays, 1, (0, 0, 0), 0.9)
    arrays.state[1, 0] = FREE
    assert np.allclose(voxels.update(arrays)[0], [[-0.75, 0.05, 1.65]])


def test_a_block_that_was_dropped_has_no_voxels(arrays: MapArrays) -> None:
    voxels = OoiVoxels(0.6)
    put(arrays, 0, (0, 0, 0), 0.9)
    put(arrays, 1, (0, 0, 0), 0.9)
    assert len(voxels.update(arrays)[0]) == 2
    arrays.directory[1, 1, 0] = -1
    arrays.revision[1] = 0
    centres, p = voxels.update(arrays)
    assert np.allclose(centres, [[-0.75, 0.05, 1.65]])
    assert np.allclose(p, [0.9], atol=0.003)


def test_the_nearest_voxels_keep_their_order() -> None:
    voxels = np.array([[4.0, 0.0, 0.0], [1.0, 0.0, 9.0], [3.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    assert nearest_voxels(voxels, 0.0, 0.0, 3).tolist() == voxels[1:].tolist()
    assert nearest_voxels(voxels, 0.0, 0.0, 4) is voxels

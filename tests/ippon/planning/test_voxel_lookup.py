"""Look-ups agree with the dense volume they came from."""

import numpy as np

from ippon.mapping.arrays import UNKNOWN
from ippon.planning.voxel_lookup import block_row, voxel_column


def test_every_voxel_is_found_where_the_volume_has_it(speckled):
    volume = speckled(3)
    arrays = volume.arrays()
    rng = np.random.default_rng(0)
    shape = np.array(volume.state.shape)
    for index in rng.integers(-6, shape + 6, size=(400, 3)):
        i, j, k = index + volume.origin * 8
        inside = (index >= 0).all() and (index < shape).all()
        expected = UNKNOWN
        if inside and not volume.missing[tuple(index // 8)]:
            expected = volume.state[tuple(index)]
        row = block_row(arrays, i, j, k)
        state = UNKNOWN if row < 0 else arrays.state[row, voxel_column(i, j, k)]
        assert state == expected


def test_columns_of_a_block_are_numbered_once():
    numbers = {voxel_column(i, j, k) for i in range(8) for j in range(-8, 0) for k in range(8)}
    assert numbers == set(range(512))


def test_outside_the_directory_there_is_no_block(dense_map):
    arrays = dense_map().arrays()
    assert block_row(arrays, -1, 0, 0) == -1
    assert block_row(arrays, 10_000, 0, 0) == -1

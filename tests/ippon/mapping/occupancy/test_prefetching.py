"""Requests for voxels ahead of their use."""

import numpy as np
import pytest
from numpy.typing import NDArray

from ippon.compiling import njit
from ippon.mapping.occupancy.prefetching import prefetch_block


@njit()
def _ask(values: NDArray[np.generic], row: int) -> None:
    prefetch_block(values, row)


@pytest.mark.parametrize("kind", [np.uint8, np.int16, np.float32])
def test_every_line_of_a_block_is_asked_for(kind: type[np.generic]) -> None:
    values = np.arange(3 * 512).astype(kind).reshape(3, 512)
    before = values.copy()
    for row in range(3):
        _ask(values, row)
    np.testing.assert_array_equal(values, before)
    (code,) = [c for s, c in _ask.inspect_asm().items() if s[0].dtype.name == np.dtype(kind).name]
    wanted = [line for line in code.splitlines() if line.strip().startswith(("prefetch", "prfm"))]
    assert len(wanted) % (512 * values.itemsize // 64) == 0
    assert wanted


def test_uncompiled_it_does_nothing() -> None:
    values = np.zeros((2, 512), np.int32)
    _ask.py_func(values, 1)
    assert not values.any()

"""Voxels that probably belong to the object, found without reading the whole map."""

import math

import numpy as np
from numpy.typing import NDArray

from ippon.compiling import njit
from ippon.geometry import Float64Array
from ippon.mapping.arrays import BLOCK_EDGE, BLOCK_VOLUME, NOT_MAPPED, OCCUPIED, MapArrays


class OoiVoxels:
    """Per-block counts of the occupied voxels above p_T; updated for changed blocks only."""

    def __init__(self, threshold: float) -> None:
        self._threshold = math.floor(threshold * 254.0)
        self._counts = np.zeros(0, dtype=np.int32)
        self._revision = -1

    def update(self, arrays: MapArrays) -> tuple[Float64Array, NDArray[np.float64]]:
        """Return centres (M, 3) in metres and p(v in O) (M,) of the voxels above the threshold."""
        rows = arrays.revision.shape[0]
        if rows > self._counts.shape[0]:
            self._counts = np.concatenate(
                [self._counts, np.zeros(rows - self._counts.shape[0], dtype=np.int32)]
            )
        total = _count_kernel(
            arrays.state,
            arrays.slab,
            arrays.ooi,
            arrays.revision,
            self._revision,
            self._threshold,
            self._counts,
        )
        self._revision = int(arrays.revision.max(initial=-1))
        index = np.empty((total, 3), dtype=np.int64)
        value = np.empty(total, dtype=np.uint8)
        _gather_kernel(
            arrays.directory,
            arrays.origin_block,
            arrays.state,
            arrays.slab,
            arrays.ooi,
            self._counts,
            self._threshold,
            index,
            value,
        )
        centres: Float64Array = (index.astype(np.float64) + 0.5) * arrays.voxel_size
        return centres, value.astype(np.float64) / 254.0


def nearest_voxels(voxels: Float64Array, x: float, y: float, most: int) -> Float64Array:
    """Return the `most` of (M, 3) centres that are nearest to (x, y) over the floor, in order."""
    if len(voxels) <= most:
        return voxels
    away = np.hypot(voxels[:, 0] - x, voxels[:, 1] - y)
    return voxels[np.sort(np.argsort(away, kind="stable")[:most])]


@njit(cache=True, nogil=True)
def _count_kernel(state, slab, ooi, revision, since, threshold, counts):
    total = 0
    for row in range(revision.shape[0]):
        if revision[row] == 0:
            # A dropped block.
            counts[row] = 0
        elif revision[row] > since:
            n, codes = 0, ooi[slab[row]]
            for c in range(BLOCK_VOLUME):
                if state[row, c] == OCCUPIED and threshold < codes[c] < NOT_MAPPED:
                    n += 1
            counts[row] = n
        total += counts[row]
    return total


@njit(cache=True, nogil=True)
def _gather_kernel(directory, origin_block, state, slab, ooi, counts, threshold, index, value):
    m = 0
    for bx in range(directory.shape[0]):
        for by in range(directory.shape[1]):
            for bz in range(directory.shape[2]):
                row = directory[bx, by, bz]
                if row < 0 or counts[row] == 0:
                    continue
                codes = ooi[slab[row]]
                for c in range(BLOCK_VOLUME):
                    if state[row, c] == OCCUPIED and threshold < codes[c] < NOT_MAPPED:
                        index[m, 0] = (origin_block[0] + bx) * BLOCK_EDGE + c // 64
                        index[m, 1] = (origin_block[1] + by) * BLOCK_EDGE + (c // 8) % 8
                        index[m, 2] = (origin_block[2] + bz) * BLOCK_EDGE + c % 8
                        value[m] = codes[c]
                        m += 1

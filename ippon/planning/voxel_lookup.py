"""Lookup of single voxels of the map, for compiled code."""

from ippon.compiling import njit
from ippon.mapping.arrays import MapArrays


@njit(cache=True, nogil=True)
def block_row(arrays: MapArrays, i: int, j: int, k: int) -> int:
    """Return the pool row of the block that holds voxel (i, j, k), -1 if there is none."""
    bx = (i >> 3) - arrays.origin_block[0]
    by = (j >> 3) - arrays.origin_block[1]
    bz = (k >> 3) - arrays.origin_block[2]
    directory = arrays.directory
    if (
        bx < 0
        or by < 0
        or bz < 0
        or bx >= directory.shape[0]
        or by >= directory.shape[1]
        or bz >= directory.shape[2]
    ):
        return -1
    return int(directory[bx, by, bz])


@njit(cache=True, nogil=True)
def voxel_column(i: int, j: int, k: int) -> int:
    """Return the column of voxel (i, j, k) within its block's row of a pool."""
    return ((i & 7) << 6) | ((j & 7) << 3) | (k & 7)

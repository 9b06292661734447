"""Evidence for the object of interest that comes from memory, not from images."""

import numpy as np
from numpy.typing import NDArray

from ippon.mapping.arrays import BLOCK_EDGE, BLOCK_VOLUME, NOT_MAPPED, OCCUPIED, MapArrays
from ippon.mapping.blocks import NO_SLAB, BlockDirectory, Pools
from ippon.mapping.objects.posterior_arithmetic import ooi_code
from ippon.mapping.objects.surface_voxels import SurfaceVoxels

_HALF_VOXEL = 0.5


def recall_evidence(
    pools: Pools,
    surface: SurfaceVoxels,
    directory: BlockDirectory,
    box: tuple[NDArray[np.float64], NDArray[np.float64]],
    log_odds: float,
    revision: int,
) -> NDArray[np.int64]:
    """Give the surface voxels in a box at least some log-odds of being the object of interest.

    Images weigh in afterwards, as they do on any evidence: they confirm it or wear it off.

    Args:
        pools: Of the map, updated.
        surface: Its surface rows, updated.
        directory: Finds the blocks.
        box: Lower and upper corner, (3,) in voxels.
        log_odds: Natural logarithm.
        revision: The map's, for what changes.

    Returns:
        (M, 3) the voxels, as indices.
    """
    low, high = box
    first = np.floor(low / BLOCK_EDGE).astype(np.int64)
    last = np.floor(high / BLOCK_EDGE).astype(np.int64)
    rows = directory.part(first, last + 1)[1].ravel()
    rows = rows[rows >= 0]
    rows = rows[pools.slab[rows] != NO_SLAB]
    k = np.arange(BLOCK_VOLUME)
    inner = np.stack([k >> 6, (k >> 3) & 7, k & 7], axis=1)
    voxel = pools.coord[rows][:, None] * BLOCK_EDGE + inner
    centre = voxel + _HALF_VOXEL
    slots = pools.slot[pools.slab[rows]]
    inside = ((centre >= low) & (centre <= high)).all(axis=2)
    inside &= (slots != 0) & (pools.state[rows] == OCCUPIED)
    at = slots[inside]
    surface.log_odds[at] = np.maximum(surface.log_odds[at], np.float32(log_odds))
    code = np.uint8(ooi_code(np.float32(log_odds)))
    codes = pools.ooi[pools.slab[rows]]
    codes[inside] = np.where(codes[inside] == NOT_MAPPED, code, np.maximum(codes[inside], code))
    pools.ooi[pools.slab[rows]] = codes
    pools.best_ooi[rows] = np.where(codes == NOT_MAPPED, 0, codes).max(axis=1, initial=0)
    changed = rows[inside.any(axis=1)]
    pools.revision[changed] = pools.appearance[changed] = revision
    return voxel[inside]


def posterior_of(arrays: MapArrays, voxels: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return (M,) p(v in O) of (M, 3) voxels; 0 where there is no surface or no evidence."""
    block = (voxels >> 3) - arrays.origin_block
    inside = ((block >= 0) & (block < arrays.directory.shape)).all(axis=1)
    rows = np.full(len(voxels), -1, np.int64)
    x, y, z = block[inside].T
    rows[inside] = arrays.directory[x, y, z]
    i, j, k = (voxels & 7).T
    column = (i << 6) | (j << 3) | k
    codes = arrays.ooi[arrays.slab[rows], column]
    there = (rows >= 0) & (arrays.state[rows, column] == OCCUPIED) & (codes != NOT_MAPPED)
    return np.where(there, codes / 254.0, 0.0)

"""Evidence for the object of interest that comes from memory, not from images."""

import numpy as np
from numpy.typing import NDArray

from ippon.mapping.arrays import BLOCK_EDGE, BLOCK_VOLUME, NOT_MAPPED, OCCUPIED, MapArrays
from ippon.mapping.blocks import NO_SLAB
from ippon.mapping.objects.posterior_arithmetic import ooi_code
from ippon.mapping.voxel_map import VoxelMap

_HALF_VOXEL = 0.5


def recall_evidence(
    voxel_map: VoxelMap,
    centre_world: NDArray[np.float64],
    size_m: NDArray[np.float64],
    log_odds: float,
) -> NDArray[np.int64]:
    """Give the surface voxels in a box at least some log-odds of being the object of interest.

    Images weigh in afterwards, as they do on any evidence: they confirm it or wear it off.

    Args:
        voxel_map: The map.
        centre_world: (3,) metres.
        size_m: (3,) of the box.
        log_odds: Natural logarithm.

    Returns:
        (M, 3) the voxels, as indices.
    """
    pools, surface = voxel_map._pools, voxel_map.surface  # noqa: SLF001 - one package
    directory = voxel_map._directory  # noqa: SLF001 - one package
    voxel_map.revision += 1
    edge, half = voxel_map.config.voxel_size_m, 0.5 * size_m
    low, high = (centre_world - half) / edge, (centre_world + half) / edge
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
    pools.revision[changed] = pools.appearance[changed] = voxel_map.revision
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

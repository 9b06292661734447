"""Evidence for the object of interest that comes from memory, not from images."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ippon.mapping.arrays import BLOCK_EDGE, BLOCK_VOLUME, FREE, NOT_MAPPED, OCCUPIED, MapArrays
from ippon.mapping.blocks import NO_SLAB
from ippon.mapping.objects.places import current_places
from ippon.mapping.objects.posterior_arithmetic import ooi_code
from ippon.mapping.queries import places_of
from ippon.mapping.voxel_map import VoxelMap

_HALF_VOXEL = 0.5
_BESIDE = np.array([(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)])


class RecalledEvidence(NamedTuple):
    """What memory has added to a map."""

    voxels: NDArray[np.int64]
    """(M, 3) indices."""
    log_odds: np.float32
    """What each has at least."""
    before: NDArray[np.float32]
    """(M,) log-odds before."""
    codes: NDArray[np.uint8]
    """(M,) codes of the posterior before."""


def recall_evidence(
    voxel_map: VoxelMap,
    centre_world: NDArray[np.float64],
    size_m: NDArray[np.float64],
    log_odds: float,
) -> RecalledEvidence:
    """Give the surface voxels in a box at least some log-odds of being the object of interest.

    Images weigh in afterwards, as they do on any evidence: they confirm it or wear it off. Voxels
    without free space beside them are left out, because no image would ever show them.

    Args:
        voxel_map: The map.
        centre_world: (3,) metres.
        size_m: (3,) of the box.
        log_odds: Natural logarithm.

    Returns:
        The voxels, for `posterior_of` and `withdraw_evidence`.
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
    inside[inside] = _beside_free(voxel_map.arrays(), voxel[inside])
    at = slots[inside]
    before = surface.log_odds[at].copy()
    surface.log_odds[at] = np.maximum(before, np.float32(log_odds))
    _add_to_current_places(voxel_map, at, surface.log_odds[at] - before)
    code = np.uint8(ooi_code(np.float32(log_odds)))
    codes = pools.ooi[pools.slab[rows]]
    codes_before = codes[inside]
    codes[inside] = np.where(codes[inside] == NOT_MAPPED, code, np.maximum(codes[inside], code))
    pools.ooi[pools.slab[rows]] = codes
    pools.best_ooi[rows] = np.where(codes == NOT_MAPPED, 0, codes).max(axis=1, initial=0)
    changed = rows[inside.any(axis=1)]
    pools.revision[changed] = pools.appearance[changed] = voxel_map.revision
    return RecalledEvidence(voxel[inside], np.float32(log_odds), before, codes_before)


def withdraw_evidence(voxel_map: VoxelMap, recalled: RecalledEvidence) -> None:
    """Take back what memory has added to voxels that no image has shown since."""
    pools, surface = voxel_map._pools, voxel_map.surface  # noqa: SLF001 - one package
    rows, column = places_of(voxel_map.arrays(), recalled.voxels)
    slabs = pools.slab[rows]
    slots = np.where((rows >= 0) & (slabs != NO_SLAB), pools.slot[slabs, column], 0)
    kept = (slots != 0) & (surface.log_odds[slots] == recalled.log_odds)
    kept &= recalled.before < recalled.log_odds
    voxel_map.revision += 1
    surface.log_odds[slots[kept]] = recalled.before[kept]
    added = recalled.log_odds - recalled.before[kept]
    _add_to_current_places(voxel_map, slots[kept], -added)
    pools.ooi[slabs[kept], column[kept]] = recalled.codes[kept]
    changed = np.unique(rows[kept])
    codes = pools.ooi[pools.slab[changed]]
    pools.best_ooi[changed] = np.where(codes == NOT_MAPPED, 0, codes).max(axis=1, initial=0)
    pools.revision[changed] = pools.appearance[changed] = voxel_map.revision


def _add_to_current_places(
    voxel_map: VoxelMap, slots: NDArray[np.int32], log_odds: NDArray[np.float32]
) -> None:
    """Add evidence to what was known before the current places of some voxels."""
    rows, at = current_places(voxel_map.surface, slots)
    held = voxel_map._layers.accumulators  # noqa: SLF001 - one package
    held.base_log_odds[rows] += log_odds[at]


def posterior_of(arrays: MapArrays, voxels: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return (M,) p(v in O) of (M, 3) voxels; 0 where there is no surface or no evidence."""
    rows, column = places_of(arrays, voxels)
    codes = arrays.ooi[arrays.slab[rows], column]
    there = (rows >= 0) & (arrays.state[rows, column] == OCCUPIED) & (codes != NOT_MAPPED)
    return np.where(there, codes / 254.0, 0.0)


def _beside_free(arrays: MapArrays, voxels: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return (M,) whether one of the six neighbours of (M, 3) voxels is free."""
    around = (voxels[:, None] + _BESIDE).reshape(-1, 3)
    rows, column = places_of(arrays, around)
    free = (rows >= 0) & (arrays.state[rows, column] == FREE)
    return free.reshape(-1, len(_BESIDE)).any(axis=1)

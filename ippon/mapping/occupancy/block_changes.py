"""What follows from a block's changed states: its counters, revisions and surface voxels."""

import numpy as np

from ippon.compiling import njit
from ippon.mapping.arrays import FREE, INNER, NOT_MAPPED, OCCUPIED
from ippon.mapping.blocks import N_LAYER_FREE, NO_SLAB, release_slab
from ippon.mapping.occupancy.free_space import OCCUPIED_CHANGED, SURFACE_LOST


@njit(cache=True, nogil=True, inline="always")
def note_change(pools, surface, row, flag, layer, revision):
    """Update a block's counters and revisions for its new states."""
    if flag & OCCUPIED_CHANGED:
        pools.occupied[row] = _count(pools.state[row], OCCUPIED)
    if flag & SURFACE_LOST and pools.slab[row] != NO_SLAB:
        _drop_surface(pools, surface, row)
    layer -= 8 * pools.coord[row, 2]
    if 0 <= layer < 8:
        free = _count_layer(pools.state[row], layer)
        pools.tally[N_LAYER_FREE] += free - pools.layer_free[row]
        pools.layer_free[row] = free
    pools.revision[row] = revision
    pools.appearance[row] = revision


@INNER
def _count(state, wanted):
    n = 0
    for k in range(512):
        n += np.int32(state[k] == wanted)
    return n


@INNER
def _count_layer(state, layer):
    n = 0
    for c in range(64):
        n += np.int32(state[c * 8 + layer] == FREE)
    return n


@INNER
def _drop_surface(pools, surface, row):
    """Release the surface voxels of a block that are no longer occupied."""
    slab = pools.slab[row]
    state, slot, ooi = pools.state[row], pools.slot[slab], pools.ooi[slab]
    best, left = 0, 0
    for k in range(512):
        if slot[k] == 0:
            continue
        if state[k] == OCCUPIED:
            left += 1
            if ooi[k] != NOT_MAPPED:
                best = max(best, ooi[k])
            continue
        surface.free[surface.tally[1]] = slot[k]
        surface.tally[1] += 1
        surface.voxel[slot[k]] = -1
        slot[k] = 0
        ooi[k] = NOT_MAPPED
        pools.level[slab, k] = NOT_MAPPED
    pools.best_ooi[row] = best
    if left == 0:
        release_slab(pools, row)

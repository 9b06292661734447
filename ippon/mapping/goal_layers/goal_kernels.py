"""Kernels over every surface voxel: start of the goals, their combination, voxels of one goal."""

import numpy as np

from ippon.compiling import njit
from ippon.mapping.arrays import NOT_MAPPED, OCCUPIED
from ippon.mapping.goal_layers.goal_arrays import highest_code
from ippon.mapping.objects.layer_kernels import label_odds
from ippon.mapping.objects.posterior_arithmetic import LOG_ODDS_MAX, ooi_code
from ippon.mapping.objects.surface_fusion import best_of
from ippon.mapping.objects.surface_voxels import NO_LABEL


@njit(allocates=True, cache=True, nogil=True)
def begin_goal_kernel(pools, surface, layers, goals, g, slots, labels):
    """Set the prior of a goal in some voxels; one that is a common label starts from that label."""
    no_weights = np.zeros(labels, np.float32)
    floor_code, bounds, alias = ooi_code(-LOG_ODDS_MAX), goals.bounds, goals.alias[g]
    for slot in slots:
        at = surface.voxel[slot]
        layers.log_odds[slot, g] = goals.prior[g]
        layers.code[slot, g] = NOT_MAPPED
        if alias < 0 or at < 0 or surface.label[slot] == NO_LABEL:
            continue
        odds, code = label_odds(surface.energy, surface.log_norm, slot, alias, labels, no_weights)
        if odds > -LOG_ODDS_MAX:
            layer = pools.coord[at // 512, 2] * 8 + (at & 7)
            if layer >= bounds[g, 2] or bounds[g, 0] <= layer < bounds[g, 1]:
                odds, code = -LOG_ODDS_MAX, floor_code
        layers.log_odds[slot, g], layers.code[slot, g] = odds, code


@njit(cache=True, nogil=True)
def combine_goals_kernel(pools, surface, layers, revision):
    """Write the highest posterior of the missing goals of each voxel to the map."""
    for slot in range(1, surface.tally[0]):
        at = surface.voxel[slot]
        if at < 0:
            continue
        row, k = at // 512, at % 512
        code = highest_code(layers.code, slot, layers.missing)
        if code != pools.ooi[pools.slab[row], k]:
            pools.ooi[pools.slab[row], k] = code
            pools.revision[row] = pools.appearance[row] = revision
    for row in range(pools.tally[0]):
        if pools.revision[row] == revision:
            pools.best_ooi[row] = best_of(pools.ooi[pools.slab[row]])


@njit(cache=True, nogil=True)
def goal_voxels_kernel(pools, surface, code, goal, threshold, index, value):
    """List the occupied voxels of a goal above a threshold; return how many there are.

    Args:
        pools: The map's pools.
        surface: Surface rows.
        code: `GoalArrays.code`.
        goal: Its column.
        threshold: In units of 1/254.
        index: (M, 3) voxel indices, written as far as they fit.
        value: (M,) codes, likewise.
    """
    n = 0
    for slot in range(1, surface.tally[0]):
        at = surface.voxel[slot]
        if at < 0 or not threshold < code[slot, goal] < NOT_MAPPED:
            continue
        row, k = at // 512, at % 512
        if pools.state[row, k] != OCCUPIED:
            continue
        if n < len(value):
            index[n, 0] = pools.coord[row, 0] * 8 + (k >> 6)
            index[n, 1] = pools.coord[row, 1] * 8 + ((k >> 3) & 7)
            index[n, 2] = pools.coord[row, 2] * 8 + (k & 7)
            value[n] = code[slot, goal]
        n += 1
    return n

"""Update of blocks that lie entirely before the surfaces in view: free wherever there is depth."""

from typing import Final

import numpy as np

from ippon.compiling import njit
from ippon.mapping.arrays import FREE, INNER_OPTIONS, OCCUPIED

TSDF_ONE: Final = 32767
# Flags of a block after an update.
STATE_CHANGED: Final = 1
OCCUPIED_CHANGED: Final = 2
OBSERVED: Final = 4
SURFACE_LOST: Final = 8
"""A voxel is no longer occupied."""
VECTORS: Final = njit(
    **INNER_OPTIONS,
    error_model="numpy",
    fastmath={"nnan", "ninf", "nsz", "contract", "arcp", "reassoc"},
)
"""Options for vectorised loops: numba's check for division by zero would prevent vectorisation."""


@VECTORS
def _fuse_free(tsdf, weight, read, rules):
    """Average the truncation distance into the voxels with depth.

    Returns:
        Number of voxels that can still become more free, a float.
    """
    zero, one, top = np.float32(0.0), np.float32(1.0), np.float32(TSDF_ONE)
    # With integers the mean would stop below its limit.
    near_top = np.float32(TSDF_ONE - 64)
    w_max = np.float32(rules.weight_max)
    left = zero
    for k in range(512):
        w = np.float32(weight[k])
        t = np.float32(tsdf[k])
        mean = t + (top - t) / (w + one)
        mean = mean + (np.float32(0.5) if mean > zero else np.float32(-0.5))
        mean = mean if t < near_top else top
        valid = read[k] > zero
        new = min(mean, top) if valid else t
        tsdf[k] = np.int16(new)
        weight[k] = np.uint8(min(w + one, w_max) if valid else w)
        left += one if new < near_top else zero
    return left


@VECTORS
def _weigh_free(evidence, state, read, rules):
    """Count the voxels with depth as seen free; return counts of the changes.

    Returns:
        Numbers of voxels observed, that can still become more free, whose state changed, and that
        ceased to be occupied, all floats.
    """
    zero, one = np.float32(0.0), np.float32(1.0)
    miss, e_min = np.float32(rules.miss), np.float32(rules.evidence_min)
    free, occupied = np.float32(FREE), np.float32(OCCUPIED)
    observed, left, changed, ceased = zero, zero, zero, zero
    for k in range(512):
        valid = one if read[k] > zero else zero
        e = max(np.float32(evidence[k]) - miss * valid, e_min)
        old = np.float32(state[k])
        new = free if e < zero else old
        evidence[k] = np.int8(e)
        state[k] = np.uint8(new)
        observed += valid
        left += one if e > e_min else zero
        was = one if old == occupied else zero
        changed += one if new != old else zero
        ceased += was * (one if new != old else zero)
    return observed, left, changed, ceased


@njit(cache=True, nogil=True, inline="always")
def update_clear_block(tsdf, weight, evidence, state, rules, read):
    """Mark the voxels with depth as free and at least the truncation distance from surfaces."""
    left = _fuse_free(tsdf, weight, read, rules)
    observed, unsure, changed, ceased = _weigh_free(evidence, state, read, rules)
    flags = OBSERVED if observed > 0 else 0
    if changed > 0:
        flags |= STATE_CHANGED
    if ceased > 0:
        flags |= OCCUPIED_CHANGED | SURFACE_LOST
    return flags, left + unsure == 0

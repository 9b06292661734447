"""Kernels that rewrite the object probabilities of every surface voxel at once."""

import numpy as np
from numpy.typing import NDArray

from ippon.compiling import njit
from ippon.mapping.arrays import INNER, NOT_MAPPED
from ippon.mapping.blocks import NO_SLAB, Pools
from ippon.mapping.objects.places import (
    PlaceAccumulators,
    begin_in_places,
    close_counted,
    current_places,
)
from ippon.mapping.objects.posterior_arithmetic import (
    LOG_ODDS_MAX,
    exp_of_steps,
    may_be_ooi,
    ooi_code,
    summarise_row,
)
from ippon.mapping.objects.surface_voxels import (
    ENERGY_MAX,
    N_USED,
    NO_LABEL,
    NORM_STEPS,
    STEPS_PER_NAT,
    SurfaceVoxels,
    norm_code,
)


@njit(cache=True, nogil=True)
def reset_ooi_kernel(pools, surface, rows, prior, revision):
    """Reset the object of interest to its prior."""
    for row in range(rows):
        slab = pools.slab[row]
        if slab != NO_SLAB and _count_mapped(pools.ooi[slab]) > 0:
            pools.ooi[slab, :] = NOT_MAPPED
            pools.best_ooi[row] = 0
            pools.revision[row] = revision
            pools.appearance[row] = revision
    for slot in range(1, surface.tally[0]):
        surface.log_odds[slot] = prior


def start_ooi(
    pools: Pools,
    surface: SurfaceVoxels,
    accumulators: PlaceAccumulators,
    slots: NDArray[np.int64],
    labels: int,
    alias: int,
    bounds: tuple[int, int, int],
    revision: int,
) -> None:
    """Start the object of interest in some voxels, the current places of which go on.

    Args:
        pools: The map's pools, updated.
        surface: Surface voxels; their log-odds are the prior.
        accumulators: Images of the current places, updated.
        slots: (M,) the voxels.
        labels: Number of labels.
        alias: Label that is the object itself, from which it starts, or `NONE`.
        bounds: See `FusionInput.ooi_bounds`.
        revision: Map revision of this change.
    """
    if alias >= 0:
        start_from_label_kernel(pools, surface, slots, labels, alias, bounds, revision)
    held = accumulators
    rows, at = current_places(surface, slots)
    held.ooi_sum[rows], held.ooi_images[rows], held.base_log_odds[rows] = begin_in_places(
        held, rows, surface.log_odds[slots[at]], alias
    )
    close_counted(surface, held, slots[at], rows, held.ooi_images[rows])


@njit(allocates=True, cache=True, nogil=True)
def start_from_label_kernel(pools, surface, slots, labels, alias, bounds, revision):
    """Let an object of interest that is common label `alias` start from it in some voxels."""
    floor_code = ooi_code(-LOG_ODDS_MAX)
    no_weights = np.zeros(labels, np.float32)
    for slot in slots:
        at = surface.voxel[slot]
        if at < 0 or surface.label[slot] == NO_LABEL:
            continue
        odds, code = label_odds(surface.energy, surface.log_norm, slot, alias, labels, no_weights)
        if odds > -LOG_ODDS_MAX:
            # Reading `coord` misses the cache; few voxels get here.
            layer = pools.coord[at // 512, 2] * 8 + (at & 7)
            if not may_be_ooi(layer, bounds):
                odds, code = -LOG_ODDS_MAX, floor_code
        surface.log_odds[slot] = odds
        row, k = at // 512, at % 512
        pools.ooi[pools.slab[row], k] = code
        pools.best_ooi[row] = max(pools.best_ooi[row], code)
        pools.revision[row] = revision
        pools.appearance[row] = revision


@INNER
def label_odds(energy, log_norm, slot, label, labels, no_weights):
    """Return the log-odds and code of an object of interest that is a common label."""
    log_q = -np.float32(energy[slot, label]) / STEPS_PER_NAT
    log_q -= log_norm[slot] / NORM_STEPS
    if log_q > -1.0:
        # Near 1 the odds depend on the small rest; the stored normaliser is too coarse for it.
        exact = summarise_row(energy, slot, no_weights, labels)[3]
        log_q = -np.float32(energy[slot, label]) / STEPS_PER_NAT - exact
    if log_q <= -LOG_ODDS_MAX:
        return -LOG_ODDS_MAX, ooi_code(-LOG_ODDS_MAX)
    q = exp_of_steps(np.float32(min(log_q, 0.0) * -STEPS_PER_NAT))
    # The odds of q, to 1e-5: q is small for most labels, so most need no logarithm.
    rest = q * (1.0 + q * (0.5 + q / 3.0))
    if log_q > -3.0:
        rest = -np.log(max(1.0 - np.exp(log_q), 1e-9))
    odds = min(max(log_q + rest, -LOG_ODDS_MAX), LOG_ODDS_MAX)
    return odds, np.uint8(254.0 * q + 0.5)


@INNER
def _count_mapped(codes):
    n = 0
    for k in range(512):
        n += np.int32(codes[k] != NOT_MAPPED)
    return n


@njit(cache=True, nogil=True)
def relevel_kernel(pools, surface, labels, levels, level_probability, revision):
    """Recompute level and proximity of every labelled voxel; marks blocks that change."""
    for slot in range(1, surface.tally[0]):
        at = surface.voxel[slot]
        if at < 0 or surface.label[slot] == NO_LABEL:
            continue
        best, confidence, proximity, log_norm = summarise_row(
            surface.energy, slot, level_probability, labels
        )
        row, k = at // 512, at % 512
        was = surface.label[slot], surface.confidence[slot], surface.proximity[slot]
        surface.label[slot], surface.confidence[slot] = best, confidence
        surface.proximity[slot], surface.log_norm[slot] = proximity, norm_code(log_norm)
        if was != (surface.label[slot], surface.confidence[slot], surface.proximity[slot]):
            pools.appearance[row] = revision
        level = levels[surface.label[slot]]
        if pools.level[pools.slab[row], k] != level:
            pools.level[pools.slab[row], k] = level
            pools.revision[row] = pools.appearance[row] = revision


def give_prior_share(surface: SurfaceVoxels, labels: int) -> None:
    """Give label number `labels` its prior share, 1 / (labels + 1), in every row."""
    used = slice(1, int(surface.tally[N_USED]))
    # x / (Z + x) = 1 / (N + 1) for x = Z / N.
    log_norm = surface.log_norm[used] / NORM_STEPS
    energy = np.log(max(labels, 1)) - log_norm
    steps = np.clip(np.round(energy * STEPS_PER_NAT), 0.0, ENERGY_MAX)
    surface.energy[used, labels] = steps
    log_sum = np.logaddexp(log_norm, -steps / STEPS_PER_NAT)
    surface.log_norm[used] = np.floor(log_sum * NORM_STEPS + 0.5)

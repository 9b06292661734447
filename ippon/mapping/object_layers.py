"""Changes of what is searched for: passes over the surface rows, not over the map."""

import numpy as np
from numba import njit

from ippon.mapping.arrays import NOT_MAPPED
from ippon.mapping.object_filter import (
    LOG_ODDS_MAX,
    best_of,
    describe_row,
    ooi_code,
)
from ippon.mapping.surface_rows import ENERGY_MAX, NO_LABEL, STEPS_PER_NAT


@njit(cache=True, nogil=True)
def reset_ooi_kernel(pools, surface, rows, labels, alias, revision):
    """Forget the object of interest; where the new one is common label `alias`, start from it."""
    for row in range(rows):
        if pools.best_ooi[row] > 0:
            pools.revision[row] = revision
            pools.appearance[row] = revision
        pools.best_ooi[row] = 0
        pools.ooi[row, :] = NOT_MAPPED
    prior = np.float32(-np.log(max(labels, 1)))
    for slot in range(1, surface.tally[0]):
        surface.log_odds[slot] = prior
        at = surface.voxel[slot]
        if alias < 0 or at < 0 or surface.label[slot] == NO_LABEL:
            continue
        q = np.exp(-surface.energy[slot, alias] / STEPS_PER_NAT - surface.log_norm[slot])
        odds = min(max(np.log(q / max(1.0 - q, 1e-9)), -LOG_ODDS_MAX), LOG_ODDS_MAX)
        surface.log_odds[slot] = odds
        row, k = at // 512, at % 512
        code = ooi_code(odds)
        pools.ooi[row, k] = code
        pools.best_ooi[row] = max(pools.best_ooi[row], code)
        pools.revision[row] = revision
        pools.appearance[row] = revision


@njit(cache=True, nogil=True)
def relevel_kernel(pools, surface, labels, levels, level_probability, revision):
    """Derive level and proximity of every labelled voxel again."""
    for slot in range(1, surface.tally[0]):
        at = surface.voxel[slot]
        if at < 0 or surface.label[slot] == NO_LABEL:
            continue
        describe_row(surface, slot, labels, level_probability)
        row, k = at // 512, at % 512
        pools.appearance[row] = revision
        level = levels[surface.label[slot]]
        if pools.level[row, k] != level:
            pools.level[row, k] = level
            pools.revision[row] = revision


@njit(cache=True, nogil=True)
def suppress_kernel(pools, surface, directory, origin, ball, voxel_size, revision):
    """Put the OOI's probability of every mapped voxel in a ball to its floor."""
    edge = 8.0 * voxel_size
    code = ooi_code(-LOG_ODDS_MAX)
    for bx in range(
        int(np.floor((ball[0] - ball[3]) / edge)), int(np.floor((ball[0] + ball[3]) / edge)) + 1
    ):
        for by in range(
            int(np.floor((ball[1] - ball[3]) / edge)), int(np.floor((ball[1] + ball[3]) / edge)) + 1
        ):
            for bz in range(
                int(np.floor((ball[2] - ball[3]) / edge)),
                int(np.floor((ball[2] + ball[3]) / edge)) + 1,
            ):
                i, j, l = bx - origin[0], by - origin[1], bz - origin[2]  # noqa: E741
                if (
                    i < 0
                    or j < 0
                    or l < 0
                    or i >= directory.shape[0]
                    or j >= directory.shape[1]
                    or l >= directory.shape[2]
                ):
                    continue
                row = directory[i, j, l]
                if row < 0:
                    continue
                for k in range(512):
                    x = (bx * 8 + (k >> 6) + 0.5) * voxel_size - ball[0]
                    y = (by * 8 + ((k >> 3) & 7) + 0.5) * voxel_size - ball[1]
                    z = (bz * 8 + (k & 7) + 0.5) * voxel_size - ball[2]
                    if x * x + y * y + z * z > ball[3] * ball[3]:
                        continue
                    slot = pools.slot[row, k]
                    if slot != 0:
                        surface.log_odds[slot] = -LOG_ODDS_MAX
                    if pools.ooi[row, k] != NOT_MAPPED:
                        pools.ooi[row, k] = code
                        pools.revision[row] = revision
                        pools.appearance[row] = revision
                pools.best_ooi[row] = best_of(pools, row)


@njit(cache=True, nogil=True)
def new_label_kernel(surface, labels):
    """Give label number `labels` the share of its prior, 1 / (labels + 1), in every row."""
    for slot in range(1, surface.tally[0]):
        # x / (Z + x) = 1 / (N + 1) for x = Z / N.
        energy = np.log(max(labels, 1)) - surface.log_norm[slot]
        steps = min(max(np.round(energy * STEPS_PER_NAT), 0.0), float(ENERGY_MAX))
        surface.energy[slot, labels] = np.int16(steps)
        surface.log_norm[slot] += np.float32(np.log1p(1.0 / max(labels, 1)))

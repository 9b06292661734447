"""One image into the surface voxels that it hit: colour and label probabilities."""

from typing import Final

import numpy as np
from numba import njit

from ippon.mapping.arrays import NOT_MAPPED
from ippon.mapping.blocks import NO_SLAB, take_slab
from ippon.mapping.object_filter import (
    LOG_ODDS_MAX,
    MAXIMUM,
    fill_missing,
    fuse_bayes,
    fuse_maximum,
    gather,
    least_energy,
    maximum_log_odds,
    observe,
    ooi_code,
    prior_log_odds,
    rounding_of,
    share_code,
)
from ippon.mapping.surface_rows import (
    ENERGY_MAX,
    NORM_STEPS,
    STEPS_PER_NAT,
    norm_code,
    take_surface_row,
)

COLOR_MEMORY: Final = 8
"""Observations that the running mean of the colour remembers."""


@njit(cache=True, nogil=True)
def _is_suppressed(coord, k, suppressed, voxel_size):
    for s in range(suppressed.shape[0]):
        x = (coord[0] * 8 + (k >> 6) + 0.5) * voxel_size - suppressed[s, 0]
        y = (coord[1] * 8 + ((k >> 3) & 7) + 0.5) * voxel_size - suppressed[s, 1]
        z = (coord[2] * 8 + (k & 7) + 0.5) * voxel_size - suppressed[s, 2]
        if x * x + y * y + z * z <= suppressed[s, 3] * suppressed[s, 3]:
            return True
    return False


@njit(cache=True, nogil=True)
def _sample_places(size, stride, heat_size):
    """Return each sample's pixel along one image axis, and the heatmap's pixel there."""
    n = (size + stride - 1) // stride
    pixel, heat = np.empty(n, np.int64), np.empty(n, np.int64)
    for s in range(n):
        pixel[s] = min(s * stride + stride // 2, size - 1)
        heat[s] = ((2 * pixel[s] + 1) * heat_size) // (2 * size)
    return pixel, heat


@njit(cache=True, nogil=True)
def _blend_color(mean, count, color):
    """Move a voxel's colour towards a pixel's; returns the observations now behind it."""
    count = min(int(count) + 1, COLOR_MEMORY)
    share = np.float32(1.0) / np.float32(count)
    for c in range(3):
        old = np.float32(mean[c])
        mean[c] = np.uint8(old + (np.float32(color[c]) - old) * share + np.float32(0.5))
    return count


@njit(cache=True, nogil=True)
def fuse_kernel(
    entries,
    n_entries,
    strides,
    depth,
    color,
    fusion,
    labels,
    voxel_size,
    pools,
    surface,
    revision,
):
    """Give each listed surface voxel this image's colour and label probabilities, once.

    Args:
        entries: (n, 3) pool row, voxel, sample (see `update_kernel`).
        n_entries: Rows of `entries`.
        strides: Pixels between samples along u and v.
        depth: (H + 2, W + 2) padded depth.
        color: (H, W, 3) RGB.
        fusion: The heatmap, or none.
        labels: Number of common labels.
        voxel_size: Metres.
        pools: The map's pools, updated.
        surface: Surface rows, updated.
        revision: Map revision of this image.

    Returns:
        Number of voxels that a heatmap updated.
    """
    h, w = fusion.probabilities.shape[0], fusion.probabilities.shape[1]
    image_v, heat_v = _sample_places(color.shape[0], strides[1], h)
    image_u, heat_u = _sample_places(color.shape[1], strides[0], w)
    samples_u = len(image_u)
    start = ENERGY_MAX if fusion.mode == MAXIMUM else 0
    prior = prior_log_odds(labels, fusion.ooi_alias)
    after = np.zeros(surface.energy.shape[1], np.float32)
    bits = after.view(np.int32)
    per_norm_step = np.float32(1.0 / NORM_STEPS)
    gathered = np.zeros(surface.energy.shape[1], np.uint8)
    table, weights, alias = fusion.energy_of, fusion.level_probability, fusion.ooi_alias
    bayes = fusion.mode != MAXIMUM
    fused = 0
    for e in range(n_entries):
        row, k, sample = entries[e, 0], entries[e, 1], entries[e, 2]
        sv = sample // samples_u
        su = sample - sv * samples_u
        v, u = image_v[sv], image_u[su]
        slab = pools.slab[row]
        if slab == NO_SLAB:
            slab = take_slab(pools, row)
        slot = pools.slot[slab, k]
        if slot == 0:
            slot = take_surface_row(surface, row * 512 + k, labels, start, prior)
            if slot == 0:
                # Bound reached; the blocks' share of rows makes room before the next frame.
                continue
            pools.slot[slab, k] = slot
        surface.color_count[slot] = _blend_color(
            surface.color[slot], surface.color_count[slot], color[v, u]
        )
        pools.appearance[row] = revision
        if not fusion.has_heatmap:
            continue
        d = depth[v + 1, u + 1]
        common, ooi = d <= fusion.common_max_m, d <= fusion.ooi_max_m and fusion.ooi_channel >= 0
        if not common and not ooi:
            continue
        fused += 1
        heat = fusion.probabilities[heat_v[sv], heat_u[su]]
        energy = surface.energy[slot]
        missing = False
        seen = heat
        if not fusion.in_order:
            missing = gather(heat, fusion.channel, gathered, labels)
            seen = gathered
        low = observe(energy, seen, table, after, bits, labels)
        if missing:
            low = fill_missing(energy, fusion.channel, after, labels)
        log_mean, total, weighted = np.float32(0.0), np.float32(1.0), np.float32(0.0)
        if bayes:
            total, weighted, log_mean = fuse_bayes(
                energy, after, low, rounding_of(revision, k), weights, labels,
                surface.log_norm[slot] * per_norm_step, alias, common, ooi,
            )  # fmt: skip
        elif common:
            total, weighted = fuse_maximum(energy, after, weights, labels)
        if common:
            best = least_energy(energy, labels)
            top = np.exp(np.float32(energy[best]) * np.float32(-1.0 / STEPS_PER_NAT))
            surface.log_norm[slot] = norm_code(np.log(total))
            surface.label[slot] = best
            surface.confidence[slot] = share_code(top, total)
            surface.proximity[slot] = share_code(weighted, total)
            if fusion.levels[best] != pools.level[slab, k]:
                pools.level[slab, k] = fusion.levels[best]
                pools.revision[row] = revision
        if ooi:
            log_h = table[heat[fusion.ooi_channel]] * np.float32(-1.0 / STEPS_PER_NAT)
            odds = surface.log_odds[slot] + log_h - log_mean
            if not bayes:
                is_first = pools.ooi[slab, k] == NOT_MAPPED
                odds = maximum_log_odds(log_h, surface.log_odds[slot], is_first)
            if len(fusion.suppressed) > 0 and _is_suppressed(
                pools.coord[row], k, fusion.suppressed, voxel_size
            ):
                odds = np.float32(-LOG_ODDS_MAX)
            odds = min(max(odds, np.float32(-LOG_ODDS_MAX)), np.float32(LOG_ODDS_MAX))
            surface.log_odds[slot] = odds
            code = ooi_code(odds)
            if code != pools.ooi[slab, k]:
                _show_ooi(pools.ooi[slab], pools.best_ooi, row, k, code)
                pools.revision[row] = revision
    return fused


@njit(cache=True, nogil=True)
def _show_ooi(codes, best_ooi, row, k, code):
    """Take a voxel's new OOI code over to its block."""
    old = codes[k]
    codes[k] = code
    if old != NOT_MAPPED and old == best_ooi[row] and code < old:
        best_ooi[row] = best_of(codes)
    else:
        best_ooi[row] = max(best_ooi[row], code)


@njit(cache=True, nogil=True)
def best_of(codes):
    """Return the highest OOI code of a block's voxels, 0 for none."""
    best = 0
    for k in range(512):
        if codes[k] != NOT_MAPPED and codes[k] > best:
            best = codes[k]
    return best

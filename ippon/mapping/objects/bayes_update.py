"""Bayes update of surface voxels by one image: per image (the paper's), or per place."""

from typing import Final

import numpy as np

from ippon.mapping.arrays import INNER, NOT_MAPPED
from ippon.mapping.objects.place_pooling import likelihoods, pool
from ippon.mapping.objects.places import (
    TAN_MARGIN,
    close_for_labels,
    close_for_ooi,
    open_accumulator,
    place_of,
)
from ippon.mapping.objects.posterior_arithmetic import (
    MAXIMUM,
    add_energies,
    alias_log_mean,
    exp_of_steps,
    fill_missing,
    fuse_maximum,
    maximum_log_odds,
    may_be_ooi,
    reorder_channels,
    rounding_of,
    store_energies,
    sum_after,
)
from ippon.mapping.objects.surface_voxels import NORM_STEPS, STEPS_PER_NAT

COLOR_MEMORY: Final = 8
"""Cap on the weight of the running mean of the colour."""
NEVER: Final = np.float32(-1e9)
"""Log-odds of what cannot be the object of interest, before clamping."""


@INNER
def _is_suppressed(coord, row, k, suppressed, voxel_size):
    for s in range(suppressed.shape[0]):
        if is_suppressed_by(coord, row, k, suppressed, s, voxel_size):
            return True
    return False


@INNER
def is_suppressed_by(coord, row, k, suppressed, s, voxel_size):
    """Tell whether the centre of a voxel lies in ball number s."""
    x = (coord[row, 0] * 8 + (k >> 6) + 0.5) * voxel_size - suppressed[s, 0]
    y = (coord[row, 1] * 8 + ((k >> 3) & 7) + 0.5) * voxel_size - suppressed[s, 1]
    z = (coord[row, 2] * 8 + (k & 7) + 0.5) * voxel_size - suppressed[s, 2]
    return x * x + y * y + z * z <= suppressed[s, 3] * suppressed[s, 3]


@INNER
def _blend_color(mean, count, row, pixels, at):
    """Move a surface row's colour towards a pixel's."""
    n = min(int(count[row]) + 1, COLOR_MEMORY)
    share = np.float32(1.0) / np.float32(n)
    for c in range(3):
        old = np.float32(mean[row, c])
        new = old + (np.float32(pixels[at, c]) - old) * share + np.float32(0.5)
        mean[row, c] = np.uint8(new)
    count[row] = n


@INNER
def update_by_images(
    entries, first, ahead, work, fusion, labels, voxel_size, pools, surface, revision
):
    """Update the entries' rows by the paper's filter; return how many the heatmap updated."""
    after, bits, gathered = work.after, work.bits, work.gathered
    per_norm_step = np.float32(1.0 / NORM_STEPS)
    table, weights, alias = fusion.energy_of, fusion.level_probability, fusion.ooi_alias
    bayes, heat, ooi_channel = fusion.mode != MAXIMUM, fusion.probabilities, fusion.ooi_channel
    energy, log_odds, log_norm = surface.energy, surface.log_odds, surface.log_norm
    colors, color_count = surface.color, surface.color_count
    slab_of, codes = pools.slab, pools.ooi
    channel, suppressed = fusion.channel, fusion.suppressed
    has_heatmap, in_order = fusion.has_heatmap, fusion.in_order
    common_max, ooi_max, bounds = fusion.common_max_m, fusion.ooi_max_m, fusion.ooi_bounds
    appearance, coord = pools.appearance, pools.coord
    asked, measured, pixels = work.ahead, work.measured, work.pixels
    # A literal 0 has its own type, for which `add_energies` would be compiled again.
    only = np.int64(0)
    batch = work.batch
    number, is_common, is_ooi, best = batch.number, batch.is_common, batch.is_ooi, batch.best
    top, total, weighted = batch.top, batch.total, batch.weighted
    mean, shift = batch.mean, batch.shift
    per_step = np.float32(-1.0 / STEPS_PER_NAT)
    n = 0
    for a in range(ahead):
        slot = asked[a, 0]
        if slot == 0:
            # Limit reached; blocks are dropped before the next frame.
            continue
        row, k = entries[first + a, 0], entries[first + a, 1]
        _blend_color(colors, color_count, slot, pixels, a)
        appearance[row] = revision
        if not has_heatmap:
            continue
        d, v, u = measured[a], asked[a, 1], asked[a, 2]
        common, ooi = d <= common_max, d <= ooi_max and ooi_channel >= 0
        if not common and not ooi:
            continue
        missing = False
        if in_order:
            low = add_energies(energy, slot, heat, v, u, table, after, bits, labels)
        else:
            missing = reorder_channels(heat, v, u, channel, gathered, labels)
            low = add_energies(energy, slot, gathered, only, only, table, after, bits, labels)
        if missing:
            low = fill_missing(energy, slot, channel, after, labels)
        if ooi:
            log_h = table[heat[v, u, ooi_channel]] * per_step
            mean[n] = np.float32(1.0)
            if not bayes:
                is_first = codes[slab_of[row], k] == NOT_MAPPED
                shift[n] = maximum_log_odds(log_h, log_odds[slot], is_first)
            elif alias >= 0:
                likelihood = alias_log_mean(energy, slot, after, labels, alias)
                shift[n] = log_odds[slot] + log_h - likelihood
            else:
                mean[n] = sum_after(after, low, labels)
                before = log_norm[slot] * per_norm_step
                shift[n] = log_odds[slot] + log_h - low * per_step + before
            layer = coord[row, 2] * 8 + (k & 7)
            if not may_be_ooi(layer, bounds) or (
                len(suppressed) > 0 and _is_suppressed(coord, row, k, suppressed, voxel_size)
            ):
                shift[n] = NEVER
        if common:
            if bayes:
                rounding = rounding_of(revision, k)
                total[n], weighted[n], least = store_energies(
                    energy, slot, after, low, rounding, weights, labels
                )
            else:
                total[n], weighted[n], least = fuse_maximum(energy, slot, after, weights, labels)
            top[n] = np.float32(1.0)
            if least > 255:
                top[n] = exp_of_steps(np.float32(least >> 8))
            best[n] = least & 255
        number[n], is_common[n], is_ooi[n] = a, common, ooi
        n += 1
    return n


@INNER
def update_by_places(
    entries, first, ahead, work, fusion, labels, voxel_size, pools, surface, accumulators, revision
):
    """Update the entries' rows with images pooled by place; return how many were updated."""
    after, bits, likelihood = work.after, work.bits, work.likelihood
    mantissa, mantissa_bits = work.mantissa, work.mantissa_bits
    weights, ooi_channel = fusion.level_probability, fusion.ooi_channel
    heat, channel, in_order = fusion.probabilities, fusion.channel, fusion.in_order
    table, table_of = fusion.likelihood_of, fusion.table_of
    sums, base, count = accumulators.sums, accumulators.base, accumulators.images
    ooi_sum, ooi_count = accumulators.ooi_sum, accumulators.ooi_images
    base_log_odds = accumulators.base_log_odds
    first_label, for_ooi = accumulators.first_label, accumulators.for_ooi
    settled = fusion.settled
    energy, colors, color_count = surface.energy, surface.color, surface.color_count
    suppressed, common_max, ooi_max = fusion.suppressed, fusion.common_max_m, fusion.ooi_max_m
    appearance, coord, bounds = pools.appearance, pools.coord, fusion.ooi_bounds
    asked, measured, pixels = work.ahead, work.measured, work.pixels
    x, y, z = fusion.camera_at
    clear_m = fusion.ooi_clear_m
    half = np.float32(0.5)
    batch = work.batch
    n = 0
    for a in range(ahead):
        slot = asked[a, 0]
        if slot == 0:
            # Limit reached; blocks are dropped before the next frame.
            continue
        row, k = entries[first + a, 0], entries[first + a, 1]
        _blend_color(colors, color_count, slot, pixels, a)
        appearance[row] = revision
        if not fusion.has_heatmap:
            continue
        d, v, u = measured[a], asked[a, 1], asked[a, 2]
        common, ooi = d <= common_max, d <= ooi_max and ooi_channel >= 0
        if ooi and d > clear_m:
            # The object is too small in the image for a miss to be evidence.
            ooi = table[table_of[labels], heat[v, u, ooi_channel]] > np.float32(1.0)
        if not common and not ooi:
            continue
        dx = x - (coord[row, 0] * 8 + (k >> 6) + 0.5) * voxel_size
        dy = y - (coord[row, 1] * 8 + ((k >> 3) & 7) + 0.5) * voxel_size
        dz = z - (coord[row, 2] * 8 + (k & 7) + 0.5) * voxel_size
        place = place_of(dx, dy, dz)
        left = place_of(dx + TAN_MARGIN * dy, dy - TAN_MARGIN * dx, dz)
        right = place_of(dx - TAN_MARGIN * dy, dy + TAN_MARGIN * dx, dz)
        w = open_accumulator(
            surface, accumulators, slot, place, left, right, settled, labels, common, ooi
        )
        # Row 0 is for none.
        common, ooi = common and first_label[w] < labels, ooi and for_ooi[w]
        if not common and not ooi:
            continue
        if ooi:
            ooi_sum[w] += table[table_of[labels], heat[v, u, ooi_channel]]
            ooi_count[w] += 1
            if ooi_count[w] == 1:
                close_for_ooi(surface, accumulators, slot, w)
            batch.mean[n] = np.float32(ooi_count[w])
            batch.shift[n] = base_log_odds[w] + np.log(ooi_sum[w])
            layer = coord[row, 2] * 8 + (k & 7)
            if not may_be_ooi(layer, bounds) or (
                len(suppressed) > 0 and _is_suppressed(coord, row, k, suppressed, voxel_size)
            ):
                batch.shift[n], batch.mean[n] = NEVER, np.float32(1.0)
        if common:
            count[w] += 1
            if count[w] == 1:
                close_for_labels(surface, accumulators, slot, w)
            likelihoods(
                heat, v, u, channel, in_order, table, table_of, first_label[w], likelihood, labels
            )
            low = pool(
                sums, base, w, count[w], likelihood, after, bits, mantissa, mantissa_bits, labels
            )
            batch.total[n], batch.weighted[n], least = store_energies(
                energy, slot, after, low, half, weights, labels
            )
            batch.top[n] = np.float32(1.0)
            if least > 255:
                batch.top[n] = exp_of_steps(np.float32(least >> 8))
            batch.best[n] = least & 255
        batch.number[n], batch.is_common[n], batch.is_ooi[n] = a, common, ooi
        n += 1
    return n

"""One image into the surface voxels that it hit: colour and label probabilities."""

from typing import Final, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ippon.mapping.arrays import INNER, NOT_MAPPED
from ippon.mapping.blocks import NO_SLAB, take_slab
from ippon.mapping.objects.bayes_filter import (
    MAXIMUM,
    PLACES,
    alias_log_mean,
    exp_of_steps,
    fill_missing,
    fuse_maximum,
    gather,
    maximum_log_odds,
    may_be_ooi,
    observe,
    rounding_of,
    store,
    sum_after,
)
from ippon.mapping.objects.fusion_chunk import (
    FusionChunk,
    finish_common,
    finish_ooi,
    make_fusion_chunk,
)
from ippon.mapping.objects.place_filter import likelihoods, pool
from ippon.mapping.objects.places import open_place, place_of
from ippon.mapping.objects.surface_rows import (
    ENERGY_MAX,
    NORM_STEPS,
    STEPS_PER_NAT,
    take_surface_row,
)

COLOR_MEMORY: Final = 8
"""Observations that the running mean of the colour remembers."""
_NEVER: Final = np.float32(-1e9)
"""Log-odds of what is not the object of interest, before they are cut off."""
AHEAD: Final = 64
"""Surface voxels whose memory is asked for before the first of them is updated."""


class FusionWork(NamedTuple):
    """Memory of `fuse_kernel`, made outside it: numba takes long to compile what makes arrays."""

    image_v: NDArray[np.int64]
    """(SV,) pixel of each sample along v, and `heat_v` the heatmap's pixel there."""
    heat_v: NDArray[np.int64]
    image_u: NDArray[np.int64]
    """(SU,) likewise along u."""
    heat_u: NDArray[np.int64]
    after: NDArray[np.float32]
    """(M + 1,) a row's energies plus the image's, see `observe`."""
    bits: NDArray[np.int32]
    """`after` seen as whole numbers."""
    gathered: NDArray[np.uint8]
    """(1, 1, M) a pixel's channels in the map's order."""
    likelihood: NDArray[np.float32]
    """(M,) a pixel's likelihood of each label."""
    mantissa: NDArray[np.float32]
    """(M,) and the same seen as whole numbers, see `pool`."""
    mantissa_bits: NDArray[np.int32]
    ahead: NDArray[np.int64]
    """(AHEAD, 3) surface row and pixel of the heatmap of each entry that is asked for."""
    measured: NDArray[np.float32]
    """(AHEAD,) its depth."""
    pixels: NDArray[np.uint8]
    """(AHEAD, 3) its colour."""
    touched: NDArray[np.float32]
    """(AHEAD, 2) what was read only to have it in the cache."""
    chunk: FusionChunk
    """Of `AHEAD` voxels."""


def make_fusion_work(
    image_size: tuple[int, int],
    strides: tuple[int, int],
    heat_size: tuple[int, int],
    row_length: int,
) -> FusionWork:
    """Reserve what one image needs.

    Args:
        image_size: (H, W) in pixels.
        strides: Pixels between samples along u and v.
        heat_size: (h, w) of the heatmap in pixels.
        row_length: M of `SurfaceRows.energy`.
    """
    image_v, heat_v = _sample_places(image_size[0], strides[1], heat_size[0])
    image_u, heat_u = _sample_places(image_size[1], strides[0], heat_size[1])
    after = np.zeros(row_length + 1, np.float32)
    mantissa = np.ones(row_length, np.float32)
    return FusionWork(
        image_v=image_v,
        heat_v=heat_v,
        image_u=image_u,
        heat_u=heat_u,
        after=after,
        bits=after.view(np.int32),
        gathered=np.zeros((1, 1, row_length), np.uint8),
        likelihood=np.zeros(row_length, np.float32),
        mantissa=mantissa,
        mantissa_bits=mantissa.view(np.int32),
        ahead=np.zeros((AHEAD, 3), np.int64),
        measured=np.zeros(AHEAD, np.float32),
        pixels=np.zeros((AHEAD, 3), np.uint8),
        touched=np.zeros((AHEAD, 2), np.float32),
        chunk=make_fusion_chunk(AHEAD),
    )


def _sample_places(
    size: int, stride: int, heat_size: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return each sample's pixel along one image axis, and the heatmap's pixel there."""
    pixel = np.minimum(np.arange(0, size, stride) + stride // 2, size - 1)
    return pixel, ((2 * pixel + 1) * heat_size) // (2 * size)


@INNER
def _is_suppressed(coord, row, k, suppressed, voxel_size):
    for s in range(suppressed.shape[0]):
        x = (coord[row, 0] * 8 + (k >> 6) + 0.5) * voxel_size - suppressed[s, 0]
        y = (coord[row, 1] * 8 + ((k >> 3) & 7) + 0.5) * voxel_size - suppressed[s, 1]
        z = (coord[row, 2] * 8 + (k & 7) + 0.5) * voxel_size - suppressed[s, 2]
        if x * x + y * y + z * z <= suppressed[s, 3] * suppressed[s, 3]:
            return True
    return False


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


@njit(cache=True, nogil=True)
def fuse_kernel(
    entries,
    n_entries,
    work,
    depth,
    color,
    fusion,
    labels,
    voxel_size,
    pools,
    surface,
    witnesses,
    revision,
):
    """Give each listed surface voxel this image's colour and label probabilities, once.

    Args:
        entries: (n, 3) pool row, voxel, sample (see `update_kernel`).
        n_entries: Rows of `entries`.
        work: Of this image.
        depth: (H + 2, W + 2) padded depth.
        color: (H, W, 3) RGB.
        fusion: The heatmap, or none.
        labels: Number of common labels.
        voxel_size: Metres.
        pools: The map's pools, updated.
        surface: Surface rows, updated.
        witnesses: What the present places say, updated.
        revision: Map revision of this image.

    Returns:
        Number of voxels that a heatmap updated.
    """
    start = ENERGY_MAX if fusion.mode == MAXIMUM else 0
    chunk = work.chunk
    fused = 0
    for first in range(0, n_entries, AHEAD):
        ahead = min(AHEAD, n_entries - first)
        _fetch(entries, first, ahead, work, depth, color, fusion, labels, start, pools, surface)
        if fusion.mode == PLACES:
            n = _update_places(
                entries, first, ahead, work, fusion, labels, voxel_size, pools, surface, witnesses,
                revision,
            )  # fmt: skip
        else:
            n = _update(
                entries, first, ahead, work, fusion, labels, voxel_size, pools, surface, revision
            )
        fused += n
        finish_common(chunk, n)
        finish_ooi(chunk, n)
        _write(entries, first, n, work, fusion, pools, surface, revision)
    return fused


@INNER
def _fetch(entries, first, ahead, work, depth, color, fusion, labels, start, pools, surface):
    """Find the surface row and the pixel of a number of entries.

    What an entry needs lies far apart: it is asked for at once for all of them, so that one waits
    for memory while the others' arrives.
    """
    image_v, heat_v, image_u, heat_u = work.image_v, work.heat_v, work.image_u, work.heat_u
    asked, measured, pixels, touched = work.ahead, work.measured, work.pixels, work.touched
    samples_u = len(image_u)
    heat, last = fusion.probabilities, max(fusion.ooi_channel, 0)
    slab_of, slot_of = pools.slab, pools.slot
    energy, log_odds = surface.energy, surface.log_odds
    for a in range(ahead):
        row, k, sample = entries[first + a, 0], entries[first + a, 1], entries[first + a, 2]
        sv = sample // samples_u
        su = sample - sv * samples_u
        v, u = image_v[sv], image_u[su]
        for c in range(3):
            pixels[a, c] = color[v, u, c]
        measured[a] = depth[v + 1, u + 1]
        asked[a, 1], asked[a, 2] = heat_v[sv], heat_u[su]
        slot = slot_of[slab_of[row], k]
        if slot == 0:
            if slab_of[row] == NO_SLAB:
                take_slab(pools, row)
            slot = take_surface_row(surface, row * 512 + k, labels, start, fusion.prior)
            slot_of[slab_of[row], k] = slot
        asked[a, 0] = slot
        touched[a, 0] = log_odds[slot]
        touched[a, 1] = energy[slot, 0] + heat[heat_v[sv], heat_u[su], last]


@INNER
def _update(entries, first, ahead, work, fusion, labels, voxel_size, pools, surface, revision):
    """Update the entries' rows, every image for itself; return how many a heatmap updated."""
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
    # A plain 0 is a type of its own, for which `observe` would be compiled again.
    only = np.int64(0)
    chunk = work.chunk
    number, is_common, is_ooi, best = chunk.number, chunk.is_common, chunk.is_ooi, chunk.best
    top, total, weighted = chunk.top, chunk.total, chunk.weighted
    mean, shift = chunk.mean, chunk.shift
    per_step = np.float32(-1.0 / STEPS_PER_NAT)
    n = 0
    for a in range(ahead):
        slot = asked[a, 0]
        if slot == 0:
            # Bound reached; the blocks' share of rows makes room before the next frame.
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
            low = observe(energy, slot, heat, v, u, table, after, bits, labels)
        else:
            missing = gather(heat, v, u, channel, gathered, labels)
            low = observe(energy, slot, gathered, only, only, table, after, bits, labels)
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
                shift[n] = _NEVER
        if common:
            if bayes:
                rounding = rounding_of(revision, k)
                total[n], weighted[n], least = store(
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
def _update_places(
    entries, first, ahead, work, fusion, labels, voxel_size, pools, surface, witnesses, revision
):
    """Update the entries' rows by places; return how many a heatmap updated."""
    after, bits, likelihood = work.after, work.bits, work.likelihood
    mantissa, mantissa_bits = work.mantissa, work.mantissa_bits
    weights, alias, ooi_channel = fusion.level_probability, fusion.ooi_alias, fusion.ooi_channel
    heat, channel, unsaid = fusion.probabilities, fusion.channel, fusion.unsaid
    table, table_of = fusion.likelihood_of, fusion.table_of
    sums, base, count = witnesses.sums, witnesses.base, witnesses.count
    ooi_sum, other_sum = witnesses.ooi_sum, witnesses.other_sum
    base_log_odds = witnesses.base_log_odds
    energy, colors, color_count = surface.energy, surface.color, surface.color_count
    suppressed, common_max, ooi_max = fusion.suppressed, fusion.common_max_m, fusion.ooi_max_m
    appearance, coord, bounds = pools.appearance, pools.coord, fusion.ooi_bounds
    asked, measured, pixels = work.ahead, work.measured, work.pixels
    x, y, z = fusion.camera_at
    half = np.float32(0.5)
    chunk = work.chunk
    n = 0
    for a in range(ahead):
        slot = asked[a, 0]
        if slot == 0:
            # Bound reached; the blocks' share of rows makes room before the next frame.
            continue
        row, k = entries[first + a, 0], entries[first + a, 1]
        _blend_color(colors, color_count, slot, pixels, a)
        appearance[row] = revision
        if not fusion.has_heatmap:
            continue
        d, v, u = measured[a], asked[a, 1], asked[a, 2]
        common, ooi = d <= common_max, d <= ooi_max and ooi_channel >= 0
        if not common and not ooi:
            continue
        place = place_of(
            x - (coord[row, 0] * 8 + (k >> 6) + 0.5) * voxel_size,
            y - (coord[row, 1] * 8 + ((k >> 3) & 7) + 0.5) * voxel_size,
            z - (coord[row, 2] * 8 + (k & 7) + 0.5) * voxel_size,
        )
        w = open_place(surface, witnesses, slot, place, labels)
        if w == 0:
            continue
        others = likelihoods(
            heat, v, u, channel, fusion.in_order, table, table_of, unsaid, base, w, alias,
            likelihood, labels,
        )  # fmt: skip
        if ooi:
            ooi_sum[w] += table[table_of[labels], heat[v, u, ooi_channel]]
            other_sum[w] += others
            chunk.mean[n] = other_sum[w]
            chunk.shift[n] = base_log_odds[w] + np.log(ooi_sum[w])
            layer = coord[row, 2] * 8 + (k & 7)
            if not may_be_ooi(layer, bounds) or (
                len(suppressed) > 0 and _is_suppressed(coord, row, k, suppressed, voxel_size)
            ):
                chunk.shift[n], chunk.mean[n] = _NEVER, np.float32(1.0)
        if common:
            count[w] += 1
            low = pool(
                sums, base, w, count[w], likelihood, after, bits, mantissa, mantissa_bits, labels
            )
            chunk.total[n], chunk.weighted[n], least = store(
                energy, slot, after, low, half, weights, labels
            )
            chunk.top[n] = np.float32(1.0)
            if least > 255:
                chunk.top[n] = exp_of_steps(np.float32(least >> 8))
            chunk.best[n] = least & 255
        chunk.number[n], chunk.is_common[n], chunk.is_ooi[n] = a, common, ooi
        n += 1
    return n


@INNER
def _write(entries, first, n, work, fusion, pools, surface, revision):
    """Take over what `finish_common` and `finish_ooi` worked out for n entries."""
    chunk, asked = work.chunk, work.ahead
    codes, level_of, slab_of = pools.ooi, pools.level, pools.slab
    changed, best_ooi, levels = pools.revision, pools.best_ooi, fusion.levels
    number, is_common, is_ooi, best = chunk.number, chunk.is_common, chunk.is_ooi, chunk.best
    label_of, confidence, proximity = surface.label, surface.confidence, surface.proximity
    log_norm, log_odds = surface.log_norm, surface.log_odds
    for i in range(n):
        a = number[i]
        slot = asked[a, 0]
        row, k = entries[first + a, 0], entries[first + a, 1]
        slab = slab_of[row]
        if is_common[i]:
            label = best[i]
            log_norm[slot], label_of[slot] = chunk.norm[i], label
            confidence[slot], proximity[slot] = chunk.confidence[i], chunk.proximity[i]
            if levels[label] != level_of[slab, k]:
                level_of[slab, k] = levels[label]
                changed[row] = revision
        if is_ooi[i]:
            log_odds[slot] = chunk.shift[i]
            if chunk.ooi[i] != codes[slab, k]:
                _show_ooi(codes, slab, best_ooi, row, k, chunk.ooi[i])
                changed[row] = revision


@INNER
def _show_ooi(codes, slab, best_ooi, row, k, code):
    """Take a voxel's new OOI code over to its block."""
    old = codes[slab, k]
    codes[slab, k] = code
    if old != NOT_MAPPED and old == best_ooi[row] and code < old:
        best_ooi[row] = best_of(codes[slab])
    else:
        best_ooi[row] = max(best_ooi[row], code)


@INNER
def best_of(codes):
    """Return the highest OOI code of a block's voxels, 0 for none."""
    best = 0
    for k in range(512):
        if codes[k] != NOT_MAPPED and codes[k] > best:
            best = codes[k]
    return best

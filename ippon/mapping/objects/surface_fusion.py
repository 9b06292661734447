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
)
from ippon.mapping.objects.fusion_chunk import (
    FusionChunk,
    finish_common,
    finish_ooi,
    make_fusion_chunk,
)
from ippon.mapping.objects.surface_rows import (
    ENERGY_MAX,
    take_surface_row,
)
from ippon.mapping.objects.voxel_update import update_by_images, update_by_places

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
            n = update_by_places(
                entries, first, ahead, work, fusion, labels, voxel_size, pools, surface, witnesses,
                revision,
            )  # fmt: skip
        else:
            n = update_by_images(
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

"""Fusion of one image into the surface voxels: colour and label probabilities."""

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ippon.compiling import njit
from ippon.mapping.arrays import INNER, NOT_MAPPED
from ippon.mapping.blocks import NO_SLAB, allocate_slab
from ippon.mapping.objects.bayes_update import update_by_images, update_by_places
from ippon.mapping.objects.posterior_arithmetic import (
    MAXIMUM,
    PLACES,
)
from ippon.mapping.objects.posterior_batch import (
    PosteriorBatch,
    encode_common_posteriors,
    encode_ooi_posteriors,
    make_posterior_batch,
)
from ippon.mapping.objects.surface_voxels import (
    ENERGY_MAX,
    allocate_surface_voxel,
)

AHEAD: Final = 64
"""Surface voxels that are prefetched before the first of them is updated."""


class FusionWork(NamedTuple):
    """Working memory of `fuse_kernel`; kernels that allocate it themselves compile slowly."""

    image_v: NDArray[np.int64]
    """(SV,) pixel of each sample along v, and `heat_v` the heatmap's pixel there."""
    heat_v: NDArray[np.int64]
    image_u: NDArray[np.int64]
    """(SU,) likewise along u."""
    heat_u: NDArray[np.int64]
    after: NDArray[np.float32]
    """(M + 1,) a row's energies plus the image's, see `add_energies`."""
    bits: NDArray[np.int32]
    """`after` reinterpreted as int32."""
    gathered: NDArray[np.uint8]
    """(1, 1, M) a pixel's channels in the map's order."""
    likelihood: NDArray[np.float32]
    """(M,) a pixel's likelihood of each label."""
    mantissa: NDArray[np.float32]
    """(M,) and the same seen as whole numbers, see `pool`."""
    mantissa_bits: NDArray[np.int32]
    ahead: NDArray[np.int64]
    """(AHEAD, 3) surface voxel and heatmap pixel of each prefetched entry."""
    measured: NDArray[np.float32]
    """(AHEAD,) its depth."""
    pixels: NDArray[np.uint8]
    """(AHEAD, 3) its colour."""
    touched: NDArray[np.float32]
    """(AHEAD, 2) values read only to load them into the cache."""
    batch: PosteriorBatch
    """Batch of `AHEAD` voxels."""


def make_fusion_work(
    image_size: tuple[int, int],
    strides: tuple[int, int],
    heat_size: tuple[int, int],
    row_length: int,
) -> FusionWork:
    """Allocate working memory for one image.

    Args:
        image_size: (H, W) in pixels.
        strides: Pixels between samples along u and v.
        heat_size: (h, w) of the heatmap in pixels.
        row_length: M of `SurfaceVoxels.energy`.
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
        batch=make_posterior_batch(AHEAD),
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
    accumulators,
    revision,
):
    """Update colour and label probabilities of each listed surface voxel from one image.

    Args:
        entries: (n, 3) pool row, voxel, sample (see `update_kernel`).
        n_entries: Rows of `entries`.
        work: Working memory.
        depth: (H + 2, W + 2) padded depth.
        color: (H, W, 3) RGB.
        fusion: The heatmap, or none.
        labels: Number of common labels.
        voxel_size: Metres.
        pools: The map's pools, updated.
        surface: Surface rows, updated.
        accumulators: Images of the current places, updated.
        revision: Map revision of this image.

    Returns:
        Number of voxels that a heatmap updated.
    """
    start = ENERGY_MAX if fusion.mode == MAXIMUM else 0
    batch = work.batch
    fused = 0
    for first in range(0, n_entries, AHEAD):
        ahead = min(AHEAD, n_entries - first)
        fetch(entries, first, ahead, work, depth, color, fusion, labels, start, pools, surface)
        if fusion.mode == PLACES:
            n = update_by_places(
                entries, first, ahead, work, fusion, labels, voxel_size, pools, surface,
                accumulators, revision,
            )  # fmt: skip
        else:
            n = update_by_images(
                entries, first, ahead, work, fusion, labels, voxel_size, pools, surface, revision
            )
        fused += n
        encode_common_posteriors(batch, n)
        encode_ooi_posteriors(batch, n)
        _write(entries, first, n, work, fusion, pools, surface, revision)
    return fused


@INNER
def fetch(entries, first, ahead, work, depth, color, fusion, labels, start, pools, surface):
    """Find surface voxel and pixel of a number of entries.

    Their data are scattered in memory; reading all of them first overlaps the cache misses.
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
                allocate_slab(pools, row)
            slot = allocate_surface_voxel(surface, row * 512 + k, labels, start, fusion.prior)
            slot_of[slab_of[row], k] = slot
        asked[a, 0] = slot
        touched[a, 0] = log_odds[slot]
        touched[a, 1] = energy[slot, 0] + heat[heat_v[sv], heat_u[su], last]


@INNER
def _write(entries, first, n, work, fusion, pools, surface, revision):
    """Write the results of the batch for n entries."""
    batch, asked = work.batch, work.ahead
    codes, level_of, slab_of = pools.ooi, pools.level, pools.slab
    changed, best_ooi, levels = pools.revision, pools.best_ooi, fusion.levels
    number, is_common, is_ooi, best = batch.number, batch.is_common, batch.is_ooi, batch.best
    label_of, confidence, proximity = surface.label, surface.confidence, surface.proximity
    log_norm, log_odds = surface.log_norm, surface.log_odds
    for i in range(n):
        a = number[i]
        slot = asked[a, 0]
        row, k = entries[first + a, 0], entries[first + a, 1]
        slab = slab_of[row]
        if is_common[i]:
            label = best[i]
            log_norm[slot], label_of[slot] = batch.norm[i], label
            confidence[slot], proximity[slot] = batch.confidence[i], batch.proximity[i]
            if levels[label] != level_of[slab, k]:
                level_of[slab, k] = levels[label]
                changed[row] = revision
        if is_ooi[i]:
            log_odds[slot] = batch.shift[i]
            if batch.ooi[i] != codes[slab, k]:
                show_ooi(codes, slab, best_ooi, row, k, batch.ooi[i])
                changed[row] = revision


@INNER
def show_ooi(codes, slab, best_ooi, row, k, code):
    """Write a voxel's OOI code and update the highest code of its block."""
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

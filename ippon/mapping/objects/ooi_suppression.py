"""Balls in which the object of interest was rejected: its probability there is minimal."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ippon.mapping.arrays import BLOCK_EDGE, BLOCK_VOLUME, NOT_MAPPED
from ippon.mapping.blocks import NO_SLAB, BlockDirectory, Pools
from ippon.mapping.objects.places import PlaceAccumulators, close_counted, reopen_for_ooi
from ippon.mapping.objects.posterior_arithmetic import LOG_ODDS_MAX, ooi_code
from ippon.mapping.objects.surface_voxels import SurfaceVoxels


class SuppressedRegion(NamedTuple):
    """A ball in which the object of interest was rejected, with the map's values before that."""

    ball: NDArray[np.float64]
    """(4,) centre in the world and radius, metres."""
    voxel: NDArray[np.int64]
    """(M, 3) index of each surface voxel in the ball."""
    log_odds: NDArray[np.float32]
    """(M,) log-odds of the object of interest."""
    code: NDArray[np.uint8]
    """(M,) its probability as in `MapArrays.ooi`."""
    places: NDArray[np.uint64]
    """(M,) places whose images the values contain, see `SurfaceVoxels.ooi_places`."""


def ball_at(centre_world: NDArray[np.float64], radius_m: float) -> NDArray[np.float64]:
    """Return (4,) centre and radius of a ball; raises ValueError if it is none."""
    ball = np.array([*centre_world, radius_m], np.float64)
    if ball.shape != (4,) or not np.isfinite(ball).all() or radius_m <= 0.0:
        raise ValueError(
            f"a ball is a finite (3,) centre and a positive radius; got {centre_world}, {radius_m}"
        )
    return ball


def suppress(
    ball: NDArray[np.float64],
    others: NDArray[np.float64],
    pools: Pools,
    surface: SurfaceVoxels,
    directory: BlockDirectory,
    voxel_size_m: float,
    revision: int,
) -> SuppressedRegion:
    """Set the object's probability in a ball to the least possible.

    Args:
        ball: (4,) centre in the world and radius, metres.
        others: (K, 4) balls that are suppressed already: what lies in them has no values.
        pools: The map's pools, updated.
        surface: Surface voxels, updated.
        directory: Rows of the blocks.
        voxel_size_m: Edge of a voxel.
        revision: Map revision of this change.

    Returns:
        The values before, for `restore`.
    """
    rows, voxel, inside = surface_in(ball, pools, directory, voxel_size_m)
    slabs = pools.slab[rows]
    slots = pools.slot[slabs]
    with_row = inside & (slots != 0) & outside(voxel, others, voxel_size_m)
    before = SuppressedRegion(
        ball,
        voxel[with_row],
        surface.log_odds[slots[with_row]],
        pools.ooi[slabs][with_row],
        surface.ooi_places[slots[with_row]],
    )
    surface.log_odds[slots[inside & (slots != 0)]] = -LOG_ODDS_MAX
    mapped = inside & (pools.ooi[slabs] != NOT_MAPPED)
    _set_codes(pools, rows, mapped, int(ooi_code(-LOG_ODDS_MAX)), revision)
    return before


def restore(
    region: SuppressedRegion,
    others: NDArray[np.float64],
    pools: Pools,
    surface: SurfaceVoxels,
    accumulators: PlaceAccumulators,
    directory: BlockDirectory,
    voxel_size_m: float,
    prior_log_odds: np.float32,
    revision: int,
) -> None:
    """Write back the values that a region had before it was suppressed.

    Args:
        region: From `suppress`.
        others: (K, 4) balls that stay suppressed.
        pools: The map's pools, updated.
        surface: Surface voxels, updated.
        accumulators: Images of the current places, updated.
        directory: Rows of the blocks.
        voxel_size_m: Edge of a voxel.
        prior_log_odds: Log-odds of surface that was first seen while the region was suppressed.
        revision: Map revision of this change.
    """
    rows, voxel, inside = surface_in(region.ball, pools, directory, voxel_size_m)
    log_odds = surface.log_odds
    slots = pools.slot[pools.slab[rows]]
    inside &= (slots != 0) & outside(voxel, others, voxel_size_m)
    slots = slots[inside]
    values = values_before(region, voxel[inside], prior_log_odds)
    log_odds[slots] = values.log_odds
    held, at = reopen_for_ooi(surface, accumulators, slots, values.places)
    close_counted(surface, accumulators, slots[at], held, accumulators.ooi_images[held])
    accumulators.base_log_odds[held] = values.log_odds[at]
    codes = pools.ooi[pools.slab[rows]]
    codes[inside] = np.where(codes[inside] == NOT_MAPPED, NOT_MAPPED, values.code)
    _set_codes(pools, rows, inside, codes[inside], revision)


def values_before(
    region: SuppressedRegion, voxel: NDArray[np.int64], prior_log_odds: np.float32
) -> SuppressedRegion:
    """Return the values that (M, 3) voxels had before a region was suppressed.

    They are the prior where there was no surface.
    """
    n = len(voxel)
    log_odds, code = np.full(n, prior_log_odds, np.float32), np.full(n, NOT_MAPPED, np.uint8)
    places = np.zeros(n, np.uint64)
    here, then = _same_voxels(voxel, region.voxel)
    log_odds[here], code[here] = region.log_odds[then], region.code[then]
    places[here] = region.places[then]
    return SuppressedRegion(region.ball, voxel, log_odds, code, places)


def _same_voxels(
    one: NDArray[np.int64], other: NDArray[np.int64]
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the rows of two (M, 3) lists of voxels that name the same voxels."""
    if not len(one) or not len(other):
        return np.empty(0, np.intp), np.empty(0, np.intp)
    corner = np.minimum(one.min(axis=0), other.min(axis=0))
    side = np.maximum(one.max(axis=0), other.max(axis=0)) - corner + 1
    _, here, there = np.intersect1d(
        np.ravel_multi_index(tuple((one - corner).T), tuple(side)),
        np.ravel_multi_index(tuple((other - corner).T), tuple(side)),
        return_indices=True,
    )
    return here, there


def outside(
    voxel: NDArray[np.int64], balls: NDArray[np.float64], voxel_size_m: float
) -> NDArray[np.bool_]:
    """Return (...) whether the centres of (..., 3) voxels lie in none of (K, 4) balls."""
    free = np.ones(voxel.shape[:-1], np.bool_)
    for ball in balls:
        away = (voxel + 0.5) * voxel_size_m - ball[:3]
        free &= (away**2).sum(axis=-1) > ball[3] ** 2
    return free


def surface_in(
    ball: NDArray[np.float64], pools: Pools, directory: BlockDirectory, voxel_size_m: float
) -> tuple[NDArray[np.int32], NDArray[np.int64], NDArray[np.bool_]]:
    """Return the (B,) block rows with a slab near a ball, and their voxels.

    Returns:
        (B,) rows; (B, 512, 3) voxel index; (B, 512) whether a voxel's centre lies in the ball.
    """
    edge = BLOCK_EDGE * voxel_size_m
    low = np.floor((ball[:3] - ball[3]) / edge).astype(np.int64)
    high = np.floor((ball[:3] + ball[3]) / edge).astype(np.int64) + 1
    rows = directory.part(low, high)[1].ravel()
    rows = rows[rows >= 0]
    rows = rows[pools.slab[rows] != NO_SLAB]
    k = np.arange(BLOCK_VOLUME)
    inner = np.stack([k >> 6, (k >> 3) & 7, k & 7], axis=1)
    voxel = pools.coord[rows][:, None].astype(np.int64) * BLOCK_EDGE + inner
    return rows, voxel, ~outside(voxel, ball[None], voxel_size_m)


def surface_slots(
    ball: NDArray[np.float64],
    others: NDArray[np.float64],
    pools: Pools,
    directory: BlockDirectory,
    voxel_size_m: float,
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return (M, 3) voxels and (M,) rows of the surface in a ball and in none of (K, 4) others."""
    rows, voxel, inside = surface_in(ball, pools, directory, voxel_size_m)
    slots = pools.slot[pools.slab[rows]]
    inside &= (slots != 0) & outside(voxel, others, voxel_size_m)
    return voxel[inside], slots[inside].astype(np.int64)


def _set_codes(
    pools: Pools,
    rows: NDArray[np.int32],
    where: NDArray[np.bool_],
    code: int | NDArray[np.uint8],
    revision: int,
) -> None:
    """Write codes of `ooi_code` to voxels of blocks, (B, 512) `where`."""
    codes = pools.ooi[pools.slab[rows]]
    codes[where] = code
    pools.ooi[pools.slab[rows]] = codes
    pools.best_ooi[rows] = np.where(codes == NOT_MAPPED, 0, codes).max(axis=1, initial=0)
    changed = rows[where.any(axis=1)]
    pools.revision[changed] = pools.appearance[changed] = revision

"""Update of the geometry from one image: signed distance and occupancy.

Two measurements are combined. Each voxel looks up the pixel at the projection of its centre (signed
distance, free space), and each pixel marks the voxel that contains its endpoint. The first alone
loses objects thinner than a voxel, because the ray through the centre of a voxel with a chair leg
mostly passes beside the leg, and it breaks floors seen at a grazing angle; the second alone cannot
clear space. An image therefore never clears a voxel that contains one of its endpoints.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ippon.compiling import njit
from ippon.mapping.arrays import FREE, INNER, INNER_OPTIONS, OCCUPIED
from ippon.mapping.occupancy.block_changes import note_change
from ippon.mapping.occupancy.free_space import (
    OBSERVED,
    OCCUPIED_CHANGED,
    STATE_CHANGED,
    SURFACE_LOST,
    TSDF_ONE,
    VECTORS,
    update_clear_block,
)
from ippon.mapping.occupancy.prefetching import prefetch_block
from ippon.mapping.occupancy.sample_rows import PIXEL_BITS
from ippon.mapping.occupancy.visible_blocks import CLEAR


class UpdateWork(NamedTuple):
    """Working memory of `update_kernel`, an entry for each voxel of a block."""

    z: NDArray[np.float32]
    """Depth of its centre, metres."""
    read: NDArray[np.float32]
    """Depth of the pixel there."""
    signed: NDArray[np.float32]
    """Signed distance to the surface before it."""
    pixel: NDArray[np.uint32]
    """Its place in the padded image."""
    cell: NDArray[np.uint32]
    """Its cell of slopes."""
    no_hits: NDArray[np.int32]
    """Counts of a block without endpoints: zeros."""
    listed: NDArray[np.uint32]
    """The voxels that are surface; one entry more."""


def make_update_work() -> UpdateWork:
    """Allocate the working memory."""
    z, read, signed = np.zeros((3, 512), np.float32)
    pixel, cell = np.zeros((2, 512), np.uint32)
    return UpdateWork(
        z, read, signed, pixel, cell, np.zeros(512, np.int32), np.zeros(513, np.uint32)
    )


@VECTORS
def _find_pixels(corner, steps, lens, depths, width, height, per_cell, cells_u, z, index, cell):
    """Find the pixel of each voxel's centre; pixel 0, which has no depth, if it is out of range.

    One loop that only writes, over few arrays: with more arrays LLVM does not vectorise, because it
    has to check them for overlap.
    """
    near, far = depths
    fx, fy, cx, cy = lens
    ox, oy, oz = corner
    (xi, xj, xk), (yi, yj, yk), (zi, zj, zk) = steps
    zero, one = np.float32(0.0), np.float32(1.0)
    u_last, v_last = np.float32(width), np.float32(height)
    line = np.int32(width + 2)
    for n in range(512):
        i = np.float32(np.int32(np.int32(n) >> 6))
        j = np.float32(np.int32(np.int32(np.int32(n) >> 3) & np.int32(7)))
        k = np.float32(np.int32(np.int32(n) & np.int32(7)))
        depth = oz + i * zi + j * zj + k * zk
        inverse = one / max(depth, near)
        # Coordinates of the padded image, clamped to its border, their fraction kept.
        u = min(max((ox + i * xi + j * xj + k * xk) * inverse * fx + cx, zero), u_last + one)
        v = min(max((oy + i * yi + j * yj + k * yk) * inverse * fy + cy, zero), v_last + one)
        pixel = np.int32(np.int32(np.int32(v) * line) + np.int32(u))
        index[n] = np.uint32(pixel if (depth > near) & (depth <= far) else np.int32(0))
        # On the border the nearest slope is read; it is not used.
        uc = np.int32(min(max(u - one, zero), u_last - one) * per_cell)
        vc = np.int32(min(max(v - one, zero), v_last - one) * per_cell)
        cell[n] = np.uint32(np.int32(np.int32(vc * cells_u) + uc))
        z[n] = depth


@VECTORS
def _read(image, index, out):
    """Read the image at the pixels into `out`; return how many values are positive, as a float."""
    zero, one = np.float32(0.0), np.float32(1.0)
    for k in range(512):
        out[k] = image[index[k]]
    positive = zero
    for k in range(512):
        positive += one if out[k] > zero else zero
    return positive


@VECTORS
def _measure(slope, cell, read, z, signed, behind):
    """Write each voxel's signed distance to the surface before it, -1e9 for none.

    Returns:
        How many are greater than `behind`, a float.
    """
    zero, one, none = np.float32(0.0), np.float32(1.0), np.float32(-1e9)
    for k in range(512):
        signed[k] = slope[cell[k]]
    observed = zero
    for k in range(512):
        s = (read[k] - z[k]) * signed[k]
        s = s if read[k] > zero else none
        signed[k] = s
        observed += one if s > behind else zero
    return observed


@VECTORS
def _fuse_distance(tsdf, weight, signed, rules):
    """Average the signed distances into the block's, clamped to the truncation distance."""
    one, top = np.float32(1.0), np.float32(TSDF_ONE)
    scale = np.float32(TSDF_ONE / rules.truncation)
    behind = np.float32(-rules.behind)
    w_max = np.float32(rules.weight_max)
    for k in range(512):
        s = signed[k]
        w = np.float32(weight[k])
        t = np.float32(tsdf[k])
        mean = t + (min(s * scale, top) - t) / (w + one)
        mean = mean + (np.float32(0.5) if mean > 0 else np.float32(-0.5))
        valid = s > behind
        tsdf[k] = np.int16(mean if valid else t)
        weight[k] = np.uint8(min(w + one, w_max) if valid else w)


@njit(**INNER_OPTIONS, fastmath={"nnan", "ninf", "nsz", "reassoc"})
def _weigh_evidence(evidence, state, signed, z, number, need, rules):
    """Add the image's evidence to the block's; return counts of the changes.

    All values are float32, including integers, so that the loop is fully vectorised.
    """
    zero, one = np.float32(0.0), np.float32(1.0)
    hit, miss = np.float32(rules.hit), np.float32(rules.miss)
    e_max, e_min = np.float32(rules.evidence_max), np.float32(rules.evidence_min)
    clear, behind = np.float32(rules.clear), np.float32(-rules.behind)
    free, occupied = np.float32(FREE), np.float32(OCCUPIED)
    observed, changed, became, ceased = zero, zero, zero, zero
    for k in range(512):
        n = np.float32(number[k])
        is_hit = one if n * z[k] * z[k] >= need else zero
        is_miss = (one if signed[k] > clear else zero) * (one - is_hit)
        e = np.float32(evidence[k]) + hit * is_hit - miss * is_miss
        e = min(max(e, e_min), e_max)
        old = np.float32(state[k])
        new = occupied if e > zero else (free if e < zero else old)
        evidence[k] = np.int8(e)
        state[k] = np.uint8(new)
        observed += (one if signed[k] > behind else zero) + is_hit
        changed += one if new != old else zero
        was = one if old == occupied else zero
        now = one if new == occupied else zero
        became += now * (one - was)
        ceased += was * (one - now)
    return observed, changed, became, ceased


@njit(cache=True, nogil=True, inline="always")
def _mixed_block(tsdf, weight, evidence, state, rules, z, signed, number, need):
    """Update signed distance, evidence and state of one block."""
    _fuse_distance(tsdf, weight, signed, rules)
    observed, changed, became, ceased = _weigh_evidence(
        evidence, state, signed, z, number, need, rules
    )
    flags = OBSERVED if observed > 0 else 0
    if changed > 0:
        flags |= STATE_CHANGED
    if became + ceased > 0:
        flags |= OCCUPIED_CHANGED
    if ceased > 0:
        flags |= SURFACE_LOST
    return flags


@njit(cache=True, nogil=True)
def update_kernel(
    depth_image,
    strides,
    view,
    rules,
    rows,
    kinds,
    n,
    endpoints,
    work,
    pools,
    surface,
    revision,
    flags,
    entries,
):
    """Update every listed block; list the surface voxels that contain endpoints.

    Args:
        depth_image: Prepared depth.
        strides: Pixels between samples, along u and v.
        view: The image's geometry.
        rules: Update rules.
        rows: (n,) pool rows of the blocks.
        kinds: (n,) `CLEAR` or `MIXED`.
        n: Length of the list.
        endpoints: Filled by `count_endpoints_kernel`.
        work: Working memory.
        pools: The map's pools, updated.
        surface: Surface rows; those of voxels that ceased to be surface are given back.
        revision: Map revision of this image.
        flags: (n,) out: what happened to each block.
        entries: (m, 3) int32 out: block row, voxel, sample of each occupied voxel with endpoints.

    Returns:
        Number of entries; `entries` must have room for every sample of the image.
    """
    depth, slope = depth_image.depth.reshape(-1), depth_image.slope.reshape(-1)
    height, width = depth_image.depth.shape[0] - 2, depth_image.depth.shape[1] - 2
    cells_u = depth_image.slope.shape[1]
    v = rules.voxel_size
    m = view.T_camera_world
    z, read, signed, pixel, cell, no_hits, listed = work
    per_cell = np.float32(1.0 / (1 << depth_image.slope_shift))
    depths = np.float32(view.near_m), np.float32(view.far_m)
    # One pixel of border, and half a one so that cutting off the fraction rounds.
    centre = np.float32(view.cx + 1.5), np.float32(view.cy + 1.5)
    lens = np.float32(view.fx), np.float32(view.fy), centre[0], centre[1]
    steps = _steps(m, v)
    # A voxel's face covers (f v / z)^2 pixels, one of `strides[0] * strides[1]` was sampled.
    need = np.float32(
        max(rules.hit_share * view.fx * view.fy * v * v / (strides[0] * strides[1]), 1e-6)
    )
    tsdf, weight, evidence, state = pools.tsdf, pools.weight, pools.evidence, pools.state
    behind = np.float32(-rules.behind)
    n_entries = np.int64(0)
    for at in range(n):
        row = rows[at]
        pools.seen[row] = revision
        if kinds[at] == CLEAR and pools.settled[row] == 1:
            flags[at] = OBSERVED
            continue
        c = pools.coord[row]
        prefetch_block(tsdf, row)
        prefetch_block(weight, row)
        prefetch_block(evidence, row)
        prefetch_block(state, row)
        if endpoints.any[at + 1] == 1:
            prefetch_block(endpoints.number, at + 1)
            prefetch_block(endpoints.best, at + 1)
        _find_pixels(
            _corner(m, v, c), steps, lens, depths, width, height, per_cell, np.int32(cells_u),
            z, pixel, cell,
        )  # fmt: skip
        if _read(depth, pixel, read) == 0 and endpoints.any[at + 1] == 0:
            flags[at] = 0
            continue
        if kinds[at] == CLEAR:
            flag, settled = update_clear_block(
                tsdf[row], weight[row], evidence[row], state[row], rules, read
            )
            pools.settled[row] = 1 if settled else 0
        else:
            observed = _measure(slope, cell, read, z, signed, behind)
            if observed == 0 and endpoints.any[at + 1] == 0:
                flags[at] = 0
                continue
            pools.settled[row] = 0
            count = endpoints.number[at + 1] if endpoints.any[at + 1] == 1 else no_hits
            flag = _mixed_block(
                tsdf[row], weight[row], evidence[row], state[row], rules, z, signed, count, need
            )
            if endpoints.any[at + 1] == 1:
                n_entries = _list_entries(
                    state[row], row, count, endpoints.best[at + 1], listed, entries, n_entries
                )
        if flag & STATE_CHANGED:
            note_change(pools, surface, row, flag, rules.layer, revision)
        flags[at] = flag
    return n_entries


@INNER
def _steps(m, v):
    """Return the camera-frame steps along i, j and k."""
    return (
        (np.float32(m[0, 0] * v), np.float32(m[0, 1] * v), np.float32(m[0, 2] * v)),
        (np.float32(m[1, 0] * v), np.float32(m[1, 1] * v), np.float32(m[1, 2] * v)),
        (np.float32(m[2, 0] * v), np.float32(m[2, 1] * v), np.float32(m[2, 2] * v)),
    )


@INNER
def _corner(m, v, block):
    """Return the centre of a block's first voxel in the camera frame."""
    i, j, k = 8 * block[0] + 0.5, 8 * block[1] + 0.5, 8 * block[2] + 0.5
    return (
        np.float32(v * (m[0, 0] * i + m[0, 1] * j + m[0, 2] * k) + m[0, 3]),
        np.float32(v * (m[1, 0] * i + m[1, 1] * j + m[1, 2] * k) + m[1, 3]),
        np.float32(v * (m[2, 0] * i + m[2, 1] * j + m[2, 2] * k) + m[2, 3]),
    )


@INNER
def _list_entries(state, row, count, best, listed, entries, n):
    """Append a block's occupied voxels with endpoints to the entries; return how many there are."""
    found = np.uint64(0)
    for k in range(512):
        # Faster than a branch that is hard to predict.
        listed[found] = k
        found += np.uint64((count[k] > 0) & (state[k] == OCCUPIED))
    for at in range(found):
        k = listed[at]
        entries[n, 0] = row
        entries[n, 1] = k
        entries[n, 2] = best[k] & np.int32((1 << PIXEL_BITS) - 1)
        n += 1
    return n

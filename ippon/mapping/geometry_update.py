"""One image into the geometry: signed distance, free space, occupied or free.

Two readings of the image meet here. Each voxel looks up the pixel that its centre projects to
(signed distance, free space); and each pixel names the voxel that its point falls in (a hit). The
first alone loses what is thinner than a voxel, because the centre of a voxel with a chair leg in it
mostly sees past the leg, and it breaks floors seen at a grazing angle; the second alone cannot
carve. So a voxel that was hit is never carved by the same image.
"""

from typing import Final

import numpy as np
from numba import njit

from ippon.mapping.arrays import FREE, NOT_MAPPED, OCCUPIED
from ippon.mapping.blocks import N_LAYER_FREE
from ippon.mapping.hits import PIXEL_BITS
from ippon.mapping.view_blocks import OPEN

TSDF_ONE: Final = 32767
# Flags of a block after an update.
STATE_CHANGED: Final = 1
OCCUPIED_CHANGED: Final = 2
OBSERVED: Final = 4


@njit(cache=True, nogil=True)
def _open_block(pools, row, rules):
    """Every voxel of the block was seen free, far from any surface."""
    if pools.settled[row] == 1:
        return OBSERVED
    flags = OBSERVED
    settled = True
    tsdf, weight, evidence = pools.tsdf[row], pools.weight[row], pools.evidence[row]
    state = pools.state[row]
    for k in range(512):
        w = np.int32(weight[k])
        t = np.int32(tsdf[k])
        t = (t * w + np.int32(TSDF_ONE)) // (w + np.int32(1)) if t < TSDF_ONE - 64 else TSDF_ONE
        tsdf[k] = np.int16(t)
        weight[k] = np.uint8(min(w + 1, rules.weight_max))
        e = max(np.int32(evidence[k]) - rules.miss, rules.evidence_min)
        evidence[k] = np.int8(e)
        if t < TSDF_ONE or e > rules.evidence_min:
            settled = False
        if e < 0 and state[k] != FREE:
            flags |= STATE_CHANGED | (OCCUPIED_CHANGED if state[k] == OCCUPIED else 0)
            state[k] = FREE
    pools.settled[row] = 1 if settled else 0
    return flags


@njit(cache=True, nogil=True, fastmath={"nnan", "ninf", "nsz", "arcp", "contract"})
def _project(offset, origin, inverse_z, focal, center, last, out):
    """Write one pixel coordinate of the padded image, its fraction kept, clamped to 0 .. last."""
    zero = np.float32(0.0)
    for k in range(512):
        at = (origin + offset[k]) * inverse_z[k] * focal + center
        out[k] = min(max(at, zero), last)


@njit(cache=True, nogil=True, fastmath={"nnan", "ninf", "nsz", "arcp", "contract"})
def _depths(offset, origin, near, z, inverse_z):
    for k in range(512):
        z[k] = origin + offset[k]
        inverse_z[k] = np.float32(1.0) / max(origin + offset[k], near)


@njit(cache=True, nogil=True, fastmath={"nnan", "ninf", "nsz", "contract"})
def _name_pixels(u, v, z, near, far, stride, out):
    """Write the index of each voxel's pixel; 0, which has no depth, when it is out of range."""
    for k in range(512):
        inside = np.int32(1) if (z[k] > near) & (z[k] <= far) else np.int32(0)
        out[k] = np.uint32((np.int32(v[k]) * stride + np.int32(u[k])) * inside)


@njit(cache=True, nogil=True, fastmath={"nnan", "ninf", "nsz", "contract"})
def _name_slopes(u, v, u_last, v_last, per_cell, cells_u, out):
    """Write the index of each voxel's slope; the border's is the nearest, and never used."""
    zero, one = np.float32(0.0), np.float32(1.0)
    for k in range(512):
        uc = np.int32(min(max(u[k] - one, zero), u_last) * per_cell)
        vc = np.int32(min(max(v[k] - one, zero), v_last) * per_cell)
        out[k] = np.uint32(vc * cells_u + uc)


@njit(cache=True, nogil=True)
def _project_block(ox, oy, oz, offsets, view, width, height, scratch, index, cell, shift, cells_u):
    """Find the pixel of each voxel's centre. Loops of few arrays each, see `hit_kernel`."""
    z, inverse_z, u, v = scratch[0], scratch[1], scratch[2], scratch[3]
    near, far = np.float32(view.near_m), np.float32(view.far_m)
    fx, fy = np.float32(view.fx), np.float32(view.fy)
    # One pixel of border, and half a one so that cutting off the fraction rounds.
    cx, cy = np.float32(view.cx + 1.5), np.float32(view.cy + 1.5)
    _depths(offsets[2], oz, near, z, inverse_z)
    _project(offsets[0], ox, inverse_z, fx, cx, np.float32(width + 1), u)
    _project(offsets[1], oy, inverse_z, fy, cy, np.float32(height + 1), v)
    _name_pixels(u, v, z, near, far, np.int32(width + 2), index)
    per_cell = np.float32(1.0) / np.float32(1 << shift)
    _name_slopes(
        u, v, np.float32(width - 1), np.float32(height - 1), per_cell, np.int32(cells_u), cell
    )


@njit(cache=True, nogil=True, fastmath={"nnan", "ninf", "nsz"})
def _measure_block(depth, slope, index, cell, z, signed):
    """Write each voxel's signed distance to the surface before it, -1e9 where there is none."""
    for k in range(512):
        d = depth[index[k]]
        s = (d - z[k]) * slope[cell[k]]
        signed[k] = s if d > np.float32(0.0) else np.float32(-1e9)


@njit(cache=True, nogil=True, fastmath={"nnan", "ninf", "nsz", "contract", "arcp"})
def _fuse_distance(tsdf, weight, signed, rules):
    """Average the signed distances into the block's, cut off at the truncation distance."""
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


@njit(cache=True, nogil=True, fastmath={"nnan", "ninf", "nsz", "reassoc"})
def _weigh_evidence(evidence, state, signed, z, number, need, rules):
    """Add the image's evidence to the block's; return counts of what it changed.

    Everything is float32, the whole numbers too, so that the loop fills whole vector registers.
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
    return observed, changed, became + ceased


@njit(cache=True, nogil=True)
def _mixed_block(pools, row, rules, z, signed, number, need):
    """Update signed distance, evidence and state of one block."""
    _fuse_distance(pools.tsdf[row], pools.weight[row], signed, rules)
    observed, changed, occupied_changed = _weigh_evidence(
        pools.evidence[row], pools.state[row], signed, z, number, need, rules
    )
    flags = OBSERVED if observed > 0 else 0
    if changed > 0:
        flags |= STATE_CHANGED
    if occupied_changed > 0:
        flags |= OCCUPIED_CHANGED
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
    hits,
    pools,
    surface,
    revision,
    flags,
    entries,
):
    """Update every listed block; list the surface voxels that were hit.

    Args:
        depth_image: Prepared depth.
        strides: Pixels between the samples that hits were counted on, along u and v.
        view: The image's geometry.
        rules: Update rules.
        rows: (n,) pool rows of the blocks.
        kinds: (n,) `OPEN` or `MIXED`.
        n: Length of the list.
        hits: Filled by `hit_kernel`.
        pools: The map's pools, updated.
        surface: Surface rows; those of voxels that ceased to be surface are given back.
        revision: Map revision of this image.
        flags: (n,) out: what happened to each block.
        entries: (m, 3) int32 out: block row, voxel, sample of each occupied voxel that was hit.

    Returns:
        Number of entries; `entries` must have room for every sample of the image.
    """
    depth, slope = depth_image.depth.ravel(), depth_image.slope.ravel()
    height, width = depth_image.depth.shape[0] - 2, depth_image.depth.shape[1] - 2
    cells_u = depth_image.slope.shape[1]
    v = rules.voxel_size
    m = view.T_camera_world
    offsets = np.empty((3, 512), np.float32)
    for k in range(512):
        i, j, l = (k >> 6) + 0.5, ((k >> 3) & 7) + 0.5, (k & 7) + 0.5  # noqa: E741
        for axis in range(3):
            offsets[axis, k] = v * (m[axis, 0] * i + m[axis, 1] * j + m[axis, 2] * l)
    scratch = np.empty((4, 512), np.float32)
    z = scratch[0]
    signed = np.empty(512, np.float32)
    index = np.empty(512, np.uint32)
    cell = np.empty(512, np.uint32)
    no_hits = np.zeros(512, np.uint16)
    # A voxel's face covers (f v / z)^2 pixels, one of `strides[0] * strides[1]` was sampled.
    need = np.float32(
        max(rules.hit_share * view.fx * view.fy * v * v / (strides[0] * strides[1]), 1e-6)
    )
    n_entries = 0
    for at in range(n):
        row = rows[at]
        pools.seen[row] = revision
        if kinds[at] == OPEN:
            flag = _open_block(pools, row, rules)
        else:
            pools.settled[row] = 0
            c = pools.coord[row]
            edge = 8.0 * v
            ox = np.float32(edge * (m[0, 0] * c[0] + m[0, 1] * c[1] + m[0, 2] * c[2]) + m[0, 3])
            oy = np.float32(edge * (m[1, 0] * c[0] + m[1, 1] * c[1] + m[1, 2] * c[2]) + m[1, 3])
            oz = np.float32(edge * (m[2, 0] * c[0] + m[2, 1] * c[1] + m[2, 2] * c[2]) + m[2, 3])
            _project_block(
                ox, oy, oz, offsets, view, width, height, scratch, index, cell,
                depth_image.slope_shift, cells_u,
            )  # fmt: skip
            count = hits.number[at] if hits.any[at] == 1 else no_hits
            _measure_block(depth, slope, index, cell, z, signed)
            flag = _mixed_block(pools, row, rules, z, signed, count, need)
            if hits.any[at] == 1:
                n_entries = _list_entries(pools, row, count, hits.best[at], entries, n_entries)
        if flag & STATE_CHANGED:
            _after_change(pools, surface, row, rules.layer)
            pools.revision[row] = revision
            pools.appearance[row] = revision
        flags[at] = flag
    return n_entries


@njit(cache=True, nogil=True)
def _list_entries(pools, row, count, best, entries, n):
    state = pools.state[row]
    for k in range(512):
        if count[k] > 0 and state[k] == OCCUPIED:
            entries[n, 0] = row
            entries[n, 1] = k
            entries[n, 2] = np.int32(best[k] & np.uint32((1 << PIXEL_BITS) - 1))
            n += 1
    return n


@njit(cache=True, nogil=True)
def _after_change(pools, surface, row, layer):
    """Drop what belongs to voxels that are surface no more, and count the body layer again."""
    state, slot = pools.state[row], pools.slot[row]
    for k in range(512):
        if slot[k] != 0 and state[k] != OCCUPIED:
            surface.free[surface.tally[1]] = slot[k]
            surface.tally[1] += 1
            surface.voxel[slot[k]] = -1
            slot[k] = 0
            pools.ooi[row, k] = NOT_MAPPED
            pools.level[row, k] = NOT_MAPPED
    best = 0
    occupied = 0
    for k in range(512):
        occupied += state[k] == OCCUPIED
        if pools.ooi[row, k] != NOT_MAPPED:
            best = max(best, pools.ooi[row, k])
    pools.best_ooi[row] = best
    pools.occupied[row] = occupied
    at = layer - 8 * pools.coord[row, 2]
    if 0 <= at < 8:
        n = 0
        for c in range(64):
            n += state[c * 8 + at] == FREE
        pools.tally[N_LAYER_FREE] += n - pools.layer_free[row]
        pools.layer_free[row] = n

"""One image into the geometry: signed distance, free space, occupied or free.

Two readings of the image meet here. Each voxel looks up the pixel that its centre projects to
(signed distance, free space); and each pixel names the voxel that its point falls in (a hit). The
first alone loses what is thinner than a voxel, because the centre of a voxel with a chair leg in it
mostly sees past the leg, and it breaks floors seen at a grazing angle; the second alone cannot
carve. So a voxel that was hit is never carved by the same image.
"""

import numpy as np
from numba import njit

from ippon.mapping.arrays import FREE, NOT_MAPPED, OCCUPIED
from ippon.mapping.blocks import N_LAYER_FREE, NO_SLAB, give_slab_back
from ippon.mapping.free_space import (
    OBSERVED,
    OCCUPIED_CHANGED,
    STATE_CHANGED,
    TSDF_ONE,
    VECTORS,
    update_clear_block,
)
from ippon.mapping.hits import PIXEL_BITS
from ippon.mapping.view_blocks import CLEAR


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
def _find_pixels(corner, offsets, lens, depths, width, height, z, inverse_z, u, v, index):
    """Find the pixel of each voxel's centre. Loops of few arrays each, see `hit_kernel`."""
    near, far = depths
    fx, fy, cx, cy = lens
    _depths(offsets[2], corner[2], near, z, inverse_z)
    _project(offsets[0], corner[0], inverse_z, fx, cx, np.float32(width + 1), u)
    _project(offsets[1], corner[1], inverse_z, fy, cy, np.float32(height + 1), v)
    _name_pixels(u, v, z, near, far, np.int32(width + 2), index)


@njit(cache=True, nogil=True)
def _gather(image, index, out):
    for k in range(512):
        out[k] = image[index[k]]


@njit(cache=True, nogil=True, fastmath={"nnan", "ninf", "nsz"})
def _measure(read, slope, z, signed):
    """Write each voxel's signed distance to the surface before it, -1e9 where there is none."""
    for k in range(512):
        s = (read[k] - z[k]) * slope[k]
        signed[k] = s if read[k] > np.float32(0.0) else np.float32(-1e9)


@VECTORS
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
def _mixed_block(tsdf, weight, evidence, state, rules, z, signed, number, need):
    """Update signed distance, evidence and state of one block.

    Its arrays come one by one: numba counts references to all arrays of a tuple at each call.
    """
    _fuse_distance(tsdf, weight, signed, rules)
    observed, changed, occupied_changed = _weigh_evidence(
        evidence, state, signed, z, number, need, rules
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
        kinds: (n,) `CLEAR` or `MIXED`.
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
    z, inverse_z = np.empty(512, np.float32), np.empty(512, np.float32)
    u, v_pixel = np.empty(512, np.float32), np.empty(512, np.float32)
    read, slopes = np.empty(512, np.float32), np.empty(512, np.float32)
    signed = np.empty(512, np.float32)
    index, cell = np.empty(512, np.uint32), np.empty(512, np.uint32)
    no_hits = np.zeros(512, np.uint16)
    per_cell = np.float32(1.0 / (1 << depth_image.slope_shift))
    depths = np.float32(view.near_m), np.float32(view.far_m)
    # One pixel of border, and half a one so that cutting off the fraction rounds.
    centre = np.float32(view.cx + 1.5), np.float32(view.cy + 1.5)
    lens = np.float32(view.fx), np.float32(view.fy), centre[0], centre[1]
    u_last, v_last = np.float32(width - 1), np.float32(height - 1)
    # A voxel's face covers (f v / z)^2 pixels, one of `strides[0] * strides[1]` was sampled.
    need = np.float32(
        max(rules.hit_share * view.fx * view.fy * v * v / (strides[0] * strides[1]), 1e-6)
    )
    tsdf, weight, evidence, state = pools.tsdf, pools.weight, pools.evidence, pools.state
    n_entries = 0
    for at in range(n):
        row = rows[at]
        pools.seen[row] = revision
        if kinds[at] == CLEAR and pools.settled[row] == 1:
            flags[at] = OBSERVED
            continue
        c = pools.coord[row]
        edge = 8.0 * v
        ox = np.float32(edge * (m[0, 0] * c[0] + m[0, 1] * c[1] + m[0, 2] * c[2]) + m[0, 3])
        oy = np.float32(edge * (m[1, 0] * c[0] + m[1, 1] * c[1] + m[1, 2] * c[2]) + m[1, 3])
        oz = np.float32(edge * (m[2, 0] * c[0] + m[2, 1] * c[1] + m[2, 2] * c[2]) + m[2, 3])
        _find_pixels(
            (ox, oy, oz), offsets, lens, depths, width, height, z, inverse_z, u, v_pixel, index
        )
        _gather(depth, index, read)
        if kinds[at] == CLEAR:
            flag, settled = update_clear_block(
                tsdf[row], weight[row], evidence[row], state[row], rules, read
            )
            pools.settled[row] = 1 if settled else 0
        else:
            pools.settled[row] = 0
            _name_slopes(u, v_pixel, u_last, v_last, per_cell, np.int32(cells_u), cell)
            _gather(slope, cell, slopes)
            _measure(read, slopes, z, signed)
            count = hits.number[at] if hits.any[at] == 1 else no_hits
            flag = _mixed_block(
                tsdf[row], weight[row], evidence[row], state[row], rules, z, signed, count, need
            )
            if hits.any[at] == 1:
                n_entries = _list_entries(state[row], row, count, hits.best[at], entries, n_entries)
        if flag & STATE_CHANGED:
            pools.occupied[row] = _count(state[row], OCCUPIED)
            if pools.slab[row] != NO_SLAB:
                _drop_surface(pools, surface, row)
            layer = rules.layer - 8 * pools.coord[row, 2]
            if 0 <= layer < 8:
                free = _count_layer(state[row], layer)
                pools.tally[N_LAYER_FREE] += free - pools.layer_free[row]
                pools.layer_free[row] = free
            pools.revision[row] = revision
            pools.appearance[row] = revision
        flags[at] = flag
    return n_entries


@njit(cache=True, nogil=True)
def _list_entries(state, row, count, best, entries, n):
    for k in range(512):
        if count[k] > 0 and state[k] == OCCUPIED:
            entries[n, 0] = row
            entries[n, 1] = k
            entries[n, 2] = np.int32(best[k] & np.uint32((1 << PIXEL_BITS) - 1))
            n += 1
    return n


@njit(cache=True, nogil=True)
def _count(state, wanted):
    n = 0
    for k in range(512):
        n += np.int32(state[k] == wanted)
    return n


@njit(cache=True, nogil=True)
def _count_layer(state, layer):
    n = 0
    for c in range(64):
        n += np.int32(state[c * 8 + layer] == FREE)
    return n


@njit(cache=True, nogil=True)
def _drop_surface(pools, surface, row):
    """Drop what belongs to voxels that are surface no more."""
    slab = pools.slab[row]
    state, slot, ooi = pools.state[row], pools.slot[slab], pools.ooi[slab]
    best, left = 0, 0
    for k in range(512):
        if slot[k] == 0:
            continue
        if state[k] == OCCUPIED:
            left += 1
            if ooi[k] != NOT_MAPPED:
                best = max(best, ooi[k])
            continue
        surface.free[surface.tally[1]] = slot[k]
        surface.tally[1] += 1
        surface.voxel[slot[k]] = -1
        slot[k] = 0
        ooi[k] = NOT_MAPPED
        pools.level[slab, k] = NOT_MAPPED
    pools.best_ooi[row] = best
    if left == 0:
        give_slab_back(pools, row)

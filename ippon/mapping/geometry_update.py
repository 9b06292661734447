"""One image into the geometry: signed distance, free space, occupied or free.

Two readings of the image meet here. Each voxel looks up the pixel that its centre projects to
(signed distance, free space); and each pixel names the voxel that its point falls in (a hit). The
first alone loses what is thinner than a voxel, because the centre of a voxel with a chair leg in it
mostly sees past the leg, and it breaks floors seen at a grazing angle; the second alone cannot
carve. So a voxel that was hit is never carved by the same image.
"""

from typing import Final, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ippon.mapping.arrays import FREE, NOT_MAPPED, OCCUPIED
from ippon.mapping.blocks import N_LAYER_FREE
from ippon.mapping.view_blocks import OPEN

TSDF_ONE: Final = 32767
NO_PIXEL: Final = 0xFFFFFFFF
PIXEL_BITS: Final = 20
"""Bits of `Hits.best` that name a sample; the others hold its distance to the voxel's centre."""

# Flags of a block after an update.
STATE_CHANGED: Final = 1
OCCUPIED_CHANGED: Final = 2
OBSERVED: Final = 4


class View(NamedTuple):
    """An image's geometry as scalars for the kernels; metres, pixels."""

    T_camera_world: NDArray[np.float64]
    T_world_camera: NDArray[np.float64]
    fx: float
    fy: float
    cx: float
    cy: float
    near_m: float
    far_m: float


class Rules(NamedTuple):
    """How observations turn into states; see `MapConfig`."""

    voxel_size: float
    truncation: float
    behind: float
    """Metres behind the surface up to which the signed distance is updated."""
    clear: float
    """A centre at least this far before the surface is evidence for free, metres."""
    depth_of_hits: float
    """Hits are taken this far under the surface, so that a floor on a voxel boundary is one layer
    and not two, metres."""
    weight_max: int
    hit: int
    miss: int
    evidence_max: int
    evidence_min: int
    hit_share: float
    """Share of a voxel's face, as the camera sees it, that its hits must cover."""
    layer: int
    """Voxel layer along z whose free voxels are counted as explored floor."""


class Hits(NamedTuple):
    """Pixels by voxel, for the blocks of one image's list; only rows with `any` set are valid."""

    number: NDArray[np.uint16]
    """(n, 512) samples that fell in the voxel."""
    best: NDArray[np.uint32]
    """(n, 512) the sample nearest the voxel's centre, `NO_PIXEL` for none."""
    any: NDArray[np.uint8]
    """(n,) the block has hits."""


def make_hits(blocks: int) -> Hits:
    """Reserve room for the hits of a list of `blocks` blocks."""
    return Hits(
        np.zeros((blocks, 512), np.uint16),
        np.zeros((blocks, 512), np.uint32),
        np.zeros(blocks, np.uint8),
    )


@njit(cache=True, nogil=True)
def hit_kernel(depth_image, stride, view, rules, origin, directory, rows, list_of_row, n, hits):
    """Count in which voxels the image's points fall, and keep the most central of each."""
    depth, slope, shift = depth_image.depth, depth_image.slope, depth_image.slope_shift
    height, width = depth.shape[0] - 2, depth.shape[1] - 2
    samples_u = (width + stride - 1) // stride
    inv = 1.0 / rules.voxel_size
    m = view.T_world_camera
    # Blocks are counted from the camera's own, so that float32 is exact enough anywhere.
    base_x = int(np.floor(m[0, 3] * inv / 8.0)) * 8
    base_y = int(np.floor(m[1, 3] * inv / 8.0)) * 8
    base_z = int(np.floor(m[2, 3] * inv / 8.0)) * 8
    tx = np.float32(m[0, 3] * inv - base_x)
    ty = np.float32(m[1, 3] * inv - base_y)
    tz = np.float32(m[2, 3] * inv - base_z)
    r00, r01, r02 = np.float32(m[0, 0] * inv), np.float32(m[0, 1] * inv), np.float32(m[0, 2] * inv)
    r10, r11, r12 = np.float32(m[1, 0] * inv), np.float32(m[1, 1] * inv), np.float32(m[1, 2] * inv)
    r20, r21, r22 = np.float32(m[2, 0] * inv), np.float32(m[2, 1] * inv), np.float32(m[2, 2] * inv)
    far, near = np.float32(view.far_m), np.float32(view.near_m)
    sink = np.float32(rules.depth_of_hits)
    base_bx = (base_x >> 3) - origin[0]
    base_by = (base_y >> 3) - origin[1]
    base_bz = (base_z >> 3) - origin[2]
    half = np.float32(0.5)
    offset = stride // 2
    for sv in range((height + stride - 1) // stride):
        v = min(sv * stride + offset, height - 1)
        yn = np.float32((v - view.cy) / view.fy)
        for su in range(samples_u):
            u = min(su * stride + offset, width - 1)
            d = depth[v + 1, u + 1]
            if d < near or d > far:
                continue
            d += sink / slope[v >> shift, u >> shift]
            xn = np.float32((u - view.cx) / view.fx)
            px = (r00 * xn + r01 * yn + r02) * d + tx
            py = (r10 * xn + r11 * yn + r12) * d + ty
            pz = (r20 * xn + r21 * yn + r22) * d + tz
            flx, fly, flz = np.floor(px), np.floor(py), np.floor(pz)
            i, j, k = int(flx), int(fly), int(flz)
            bx, by, bz = (i >> 3) + base_bx, (j >> 3) + base_by, (k >> 3) + base_bz
            if (
                bx < 0
                or by < 0
                or bz < 0
                or bx >= directory.shape[0]
                or by >= directory.shape[1]
                or bz >= directory.shape[2]
            ):
                continue
            row = directory[bx, by, bz]
            if row < 0:
                continue
            at = list_of_row[row]
            if at >= n or rows[at] != row:
                continue
            if hits.any[at] == 0:
                hits.any[at] = 1
                hits.number[at, :] = 0
                hits.best[at, :] = NO_PIXEL
            dx, dy, dz = px - flx - half, py - fly - half, pz - flz - half
            away = int((dx * dx + dy * dy + dz * dz) * np.float32(4000.0))
            voxel = ((i & 7) << 6) | ((j & 7) << 3) | (k & 7)
            code = np.uint32((away << PIXEL_BITS) | (sv * samples_u + su))
            hits.best[at, voxel] = min(hits.best[at, voxel], code)
            if hits.number[at, voxel] < 65535:
                hits.number[at, voxel] += np.uint16(1)


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
def _project_block(
    ox, oy, oz, offsets, view, width, height, scratch_z, index, cell, shift, cells_u
):
    """Find the pixel of each voxel's centre; pixel 0, which has no depth, when there is none."""
    fx, fy = np.float32(view.fx), np.float32(view.fy)
    cx, cy = np.float32(view.cx + 1.5), np.float32(view.cy + 1.5)
    near, far = np.float32(view.near_m), np.float32(view.far_m)
    u_max, v_max = np.float32(width + 1), np.float32(height + 1)
    zero, one = np.float32(0.0), np.float32(1.0)
    stride = np.int32(width + 2)
    for k in range(512):
        z = oz + offsets[2, k]
        inverse = one / max(z, near)
        u = (ox + offsets[0, k]) * inverse * fx + cx
        v = (oy + offsets[1, k]) * inverse * fy + cy
        u = min(max(u, zero), u_max)
        v = min(max(v, zero), v_max)
        ui, vi = np.int32(u), np.int32(v)
        at = np.int32(vi * stride + ui)
        index[k] = at if z > near and z <= far else np.int32(0)
        # The border maps to the nearest cell; its depth is 0, so the value is never used.
        uc = max(np.int32(0), np.int32(min(ui, np.int32(width)) - np.int32(1)))
        vc = max(np.int32(0), np.int32(min(vi, np.int32(height)) - np.int32(1)))
        cell[k] = np.int32((vc >> shift) * cells_u + (uc >> shift))
        scratch_z[k] = z


@njit(cache=True, nogil=True, fastmath={"nnan", "ninf", "nsz", "arcp", "contract"})
def _mixed_block(pools, row, rules, depth, slope, z, index, cell, count, need):
    """Update signed distance, evidence and state of one block from the pixels of its voxels."""
    zero, one = np.float32(0.0), np.float32(1.0)
    scale = np.float32(TSDF_ONE / rules.truncation)
    top = np.float32(TSDF_ONE)
    behind, clear = np.float32(-rules.behind), np.float32(rules.clear)
    tsdf, weight, evidence = pools.tsdf[row], pools.weight[row], pools.evidence[row]
    state = pools.state[row]
    w_max = np.float32(rules.weight_max)
    hit, miss = np.int32(rules.hit), np.int32(rules.miss)
    e_max, e_min = np.int32(rules.evidence_max), np.int32(rules.evidence_min)
    observed = 0
    changed = 0
    occupied_changed = 0
    for k in range(512):
        d = depth[index[k]]
        s = (d - z[k]) * slope[cell[k]]
        valid = d > zero and s > behind
        t = min(s * scale, top)
        w = np.float32(weight[k])
        mean = (np.float32(tsdf[k]) * w + t) / (w + one)
        rounded = np.floor(mean + np.float32(0.5))
        tsdf[k] = np.int16(rounded) if valid else tsdf[k]
        weight[k] = np.uint8(min(w + one, w_max)) if valid else weight[k]
        is_hit = np.float32(count[k]) * z[k] * z[k] >= need and count[k] > 0
        is_miss = valid and s > clear and not is_hit
        e = np.int32(evidence[k]) + (hit if is_hit else np.int32(0))
        e = e - (miss if is_miss else np.int32(0))
        e = min(max(e, e_min), e_max)
        evidence[k] = np.int8(e)
        old = state[k]
        new = np.uint8(OCCUPIED) if e > 0 else (np.uint8(FREE) if e < 0 else old)
        state[k] = new
        observed += valid or is_hit
        changed += new != old
        occupied_changed += (new == OCCUPIED) != (old == OCCUPIED)
    flags = OBSERVED if observed > 0 else 0
    if changed > 0:
        flags |= STATE_CHANGED
    if occupied_changed > 0:
        flags |= OCCUPIED_CHANGED
    return flags


@njit(cache=True, nogil=True)
def update_kernel(
    depth_image,
    stride,
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
        stride: Pixels between the samples that hits were counted on.
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
    z = np.empty(512, np.float32)
    index = np.empty(512, np.int32)
    cell = np.empty(512, np.int32)
    no_hits = np.zeros(512, np.uint16)
    # A voxel's face covers (f v / z)^2 pixels, 1 / stride^2 of which were sampled.
    need = np.float32(rules.hit_share * view.fx * view.fy * v * v / (stride * stride))
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
                ox, oy, oz, offsets, view, width, height, z, index, cell,
                depth_image.slope_shift, cells_u,
            )  # fmt: skip
            count = hits.number[at] if hits.any[at] == 1 else no_hits
            flag = _mixed_block(pools, row, rules, depth, slope, z, index, cell, count, need)
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

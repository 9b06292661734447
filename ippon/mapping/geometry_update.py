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

from ippon.camera import PinholeCamera
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


def sample_strides(camera: PinholeCamera, voxel_size: float, far_m: float) -> tuple[int, int]:
    """Return pixels between the samples for hits, along u and v.

    Along u, at least 2.5 samples fall across a voxel at the greatest range; along v they are twice
    as dense, because floors are seen at a grazing angle.
    """
    across = camera.fx * voxel_size / far_m
    along_u = max(1, min(4, int(across / 2.5)))
    along_v = max(1, along_u // 2)
    # The index of a sample must fit its bits.
    while n_samples(camera, (along_u, along_v)) > 1 << PIXEL_BITS:
        along_u, along_v = along_u + 1, along_v + 1
    return along_u, along_v


def n_samples(camera: PinholeCamera, strides: tuple[int, int]) -> int:
    """Return the number of samples of an image."""
    return (-(-camera.width // strides[0])) * (-(-camera.height // strides[1]))


def make_hits(blocks: int) -> Hits:
    """Reserve room for the hits of a list of `blocks` blocks."""
    return Hits(
        np.zeros((blocks, 512), np.uint16),
        np.zeros((blocks, 512), np.uint32),
        np.zeros(blocks, np.uint8),
    )


@njit(cache=True, nogil=True, fastmath={"nnan", "ninf", "nsz", "contract"})
def _locate_row(depth, slope, shift, v, columns, lines, view, rules, size, cells, codes):
    """Find the directory cell and the voxel that each sample of an image row falls in.

    Args:
        depth: (W + 2,) padded depth of the row.
        slope: (w,) slopes of the row.
        shift: See `DepthImage.slope_shift`.
        v: Row in pixels.
        columns: (S,) pixel column of each sample.
        lines: (3, 4) camera coordinates to voxels counted from the directory's corner.
        view: The image's geometry.
        rules: Update rules.
        size: (3,) of the directory, blocks.
        cells: (S,) out: linear index in the directory, -1 for none.
        codes: (S,) out: distance to the voxel's centre in the high bits, the voxel in the low nine.
    """
    far, near = np.float32(view.far_m), np.float32(view.near_m)
    sink = np.float32(rules.depth_of_hits)
    yn = (v - view.cy) / view.fy
    # Ray of the row's pixel u is a + b u, in voxels for one metre along the optical axis.
    b = lines[:, 0] / view.fx
    a = lines[:, 1] * yn + lines[:, 2] - b * view.cx
    ax, ay, az = np.float32(a[0]), np.float32(a[1]), np.float32(a[2])
    bx, by, bz = np.float32(b[0]), np.float32(b[1]), np.float32(b[2])
    tx, ty, tz = np.float32(lines[0, 3]), np.float32(lines[1, 3]), np.float32(lines[2, 3])
    ex, ey, ez = np.float32(8 * size[0]), np.float32(8 * size[1]), np.float32(8 * size[2])
    zero, half, steps = np.float32(0.0), np.float32(0.5), np.float32(2000.0)
    for s in range(columns.shape[0]):
        u = columns[s]
        d = depth[u + np.uint32(1)]
        z = d + sink / slope[u >> shift]
        uf = np.float32(u)
        px = (ax + bx * uf) * z + tx
        py = (ay + by * uf) * z + ty
        pz = (az + bz * uf) * z + tz
        inside = (d >= near) & (d <= far) & (px >= zero) & (py >= zero) & (pz >= zero)
        inside = inside & (px < ex) & (py < ey) & (pz < ez)
        i, j, k = np.int32(px), np.int32(py), np.int32(pz)
        cell = ((i >> 3) * size[1] + (j >> 3)) * size[2] + (k >> 3)
        cells[s] = np.int32(cell) if inside else np.int32(-1)
        dx = px - np.float32(i) - half
        dy = py - np.float32(j) - half
        dz = pz - np.float32(k) - half
        away = np.int32((dx * dx + dy * dy + dz * dz) * steps)
        codes[s] = np.int32((away << 9) | ((i & 7) << 6) | ((j & 7) << 3) | (k & 7))


@njit(cache=True, nogil=True)
def hit_kernel(depth_image, strides, view, rules, origin, directory, rows, list_of_row, n, hits):
    """Count in which voxels the image's points fall, and keep the most central of each.

    Args:
        depth_image: Prepared depth.
        strides: Pixels between samples along u and v.
        view: The image's geometry.
        rules: Update rules.
        origin: (3,) block index of `directory[0, 0, 0]`.
        directory: (DX, DY, DZ) rows by block.
        rows: (n,) pool rows of the blocks in view.
        list_of_row: Place of each pool row in `rows`; void for rows that are not there.
        n: Length of the list.
        hits: Out.
    """
    depth, slope, shift = depth_image.depth, depth_image.slope, depth_image.slope_shift
    height, width = depth.shape[0] - 2, depth.shape[1] - 2
    samples_u = (width + strides[0] - 1) // strides[0]
    columns = np.empty(samples_u, np.uint32)
    for su in range(samples_u):
        columns[su] = min(su * strides[0] + strides[0] // 2, width - 1)
    cells = np.empty(samples_u, np.int32)
    codes = np.empty(samples_u, np.int32)
    size = np.array(directory.shape)
    found = directory.ravel()
    lines = view.T_world_camera[:3] / rules.voxel_size
    lines[:, 3] -= 8.0 * origin
    for sv in range((height + strides[1] - 1) // strides[1]):
        v = min(sv * strides[1] + strides[1] // 2, height - 1)
        _locate_row(
            depth[v + 1], slope[v >> shift], shift, v, columns, lines, view, rules, size, cells,
            codes,
        )  # fmt: skip
        last_cell, at = -1, -1
        for su in range(samples_u):
            cell = cells[su]
            if cell < 0:
                continue
            if cell != last_cell:
                last_cell = cell
                row = found[cell]
                at = list_of_row[row] if row >= 0 else -1
                if at >= n or (at >= 0 and rows[at] != row):
                    at = -1
                if at >= 0 and hits.any[at] == 0:
                    hits.any[at] = 1
                    hits.number[at, :] = 0
                    hits.best[at, :] = NO_PIXEL
            if at < 0:
                continue
            voxel = codes[su] & 511
            code = np.uint32(((codes[su] >> 9) << PIXEL_BITS) | (sv * samples_u + su))
            hits.best[at, voxel] = min(hits.best[at, voxel], code)
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
    u_last, v_last = np.float32(width - 1), np.float32(height - 1)
    per_cell = np.float32(1.0) / np.float32(1 << shift)
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
        inside = np.int32(1) if z > near and z <= far else np.int32(0)
        index[k] = np.uint32(np.int32(vi * stride + ui) * inside)
        # The border maps to the nearest cell; its depth is 0, so the value is never used.
        uc = np.int32(min(max(u - one, zero), u_last) * per_cell)
        vc = np.int32(min(max(v - one, zero), v_last) * per_cell)
        cell[k] = np.uint32(vc * cells_u + uc)
        scratch_z[k] = z


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
    z = np.empty(512, np.float32)
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
                ox, oy, oz, offsets, view, width, height, z, index, cell,
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

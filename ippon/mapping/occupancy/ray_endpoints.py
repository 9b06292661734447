"""Voxels that contain the endpoints of an image's rays, that is, its depth points."""

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ippon.camera import PinholeCamera
from ippon.compiling import njit
from ippon.mapping.arrays import INNER, INNER_OPTIONS
from ippon.mapping.depth_image import TILE

NO_SAMPLE: Final = 0x7FFFFFFF
PIXEL_BITS: Final = 20
"""Bits of `EndpointCounts.best` that index a sample; the others hold its distance to the voxel's
centre."""
PARTS: Final = (0, 4, 2, 6, 1, 5, 3, 7)
"""Order in which every eighth sample of a row is listed, so that neighbours can be compared as
vectors: they are halves, quarters and eighths of the list."""


class CameraGeometry(NamedTuple):
    """Pose, intrinsics and range of an image as kernel arguments; metres, pixels."""

    T_camera_world: NDArray[np.float64]
    T_world_camera: NDArray[np.float64]
    fx: float
    fy: float
    cx: float
    cy: float
    near_m: float
    far_m: float


class UpdateRules(NamedTuple):
    """Parameters of the update; see `MapConfig`."""

    voxel_size: float
    truncation: float
    behind: float
    """Metres behind the surface up to which the signed distance is updated."""
    clear: float
    """A centre at least this far before the surface is evidence for free, metres."""
    endpoint_depth: float
    """Depth under the surface at which endpoints are counted, metres, so that a floor on a voxel
    boundary occupies one layer."""
    weight_max: int
    hit: int
    miss: int
    evidence_max: int
    evidence_min: int
    hit_share: float
    """Share of a voxel's face, as the camera sees it, that its endpoints must cover."""
    layer: int
    """Voxel layer along z whose free voxels count as explored floor."""


class EndpointCounts(NamedTuple):
    """Endpoints by voxel: row r is for block r - 1 of the image's list, valid where `any` is set.

    Row 0 collects endpoints outside the listed blocks.
    """

    number: NDArray[np.int32]
    """(n + 1, 512) endpoints in the voxel, including samples that were skipped because they are
    near."""
    best: NDArray[np.int32]
    """(n + 1, 512) sample nearest to the voxel's centre, `NO_SAMPLE` for none."""
    any: NDArray[np.uint8]
    """(n + 1,) whether the block contains endpoints."""


def sample_strides(camera: PinholeCamera, voxel_size: float, far_m: float) -> tuple[int, int]:
    """Return the pixels between samples along u and v.

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


def make_endpoint_counts(blocks: int) -> EndpointCounts:
    """Reserve counts for a list of `blocks` blocks."""
    return EndpointCounts(
        np.zeros((blocks + 1, 512), np.int32),
        np.zeros((blocks + 1, 512), np.int32),
        np.zeros(blocks + 1, np.uint8),
    )


# numba's check for division by zero would prevent vectorisation.
_ROWS: Final = njit(
    **INNER_OPTIONS,
    error_model="numpy",
    fastmath={"nnan", "ninf", "nsz", "contract"},
)


@_ROWS
def _read_sinks(slope, cells, sink, out):
    """Write the depth under the surface at which each sample of a row of cells is counted."""
    for s in range(cells.shape[0]):
        out[s] = sink / slope[cells[s]]


@_ROWS
def _read_depth(depth, columns, out):
    for s in range(columns.shape[0]):
        out[s] = depth[columns[s]]


@_ROWS
def _lift_row(read, sinks, near, far, out):
    """Write the depth at which each sample is counted; -1 for those out of range."""
    for s in range(read.shape[0]):
        d = read[s]
        out[s] = d + sinks[s] if (d >= near) & (d <= far) else np.float32(-1.0)


@_ROWS
def _along_axis(depth, pixels, start, step, shift, out):
    """Write one coordinate of the samples of a row: (start + step * u) * depth + shift."""
    for s in range(depth.shape[0]):
        out[s] = (start + step * pixels[s]) * depth[s] + shift


@_ROWS
def _name_voxels(depth, x, y, z, size_x, size_y, size_z, out):
    """Write each sample's voxel: (cell of the box of blocks + 1) * 512 + voxel; 0 for none."""
    zero, eight = np.float32(0.0), np.float32(8.0)
    end_x = np.float32(size_x) * eight
    end_y, end_z = np.float32(size_y) * eight, np.float32(size_z) * eight
    for s in range(depth.shape[0]):
        inside = (x[s] >= zero) & (y[s] >= zero) & (z[s] >= zero) & (depth[s] > zero)
        inside = inside & (x[s] < end_x) & (y[s] < end_y) & (z[s] < end_z)
        i, j, k = np.int32(x[s]), np.int32(y[s]), np.int32(z[s])
        # 32-bit integers, so that twice as many fit in a register.
        cell = np.int32(np.int32(i >> 3) * size_y) + np.int32(j >> 3)
        cell = np.int32(np.int32(cell) * size_z) + np.int32(k >> 3)
        low = np.int32(np.int32((i & 7) << 6) | np.int32((j & 7) << 3)) | np.int32(k & 7)
        voxel = np.int32(np.int32((np.int32(cell) + 1) << 9) | np.int32(low))
        out[s] = np.uint32(voxel if inside else np.int32(0))


@_ROWS
def _rate_samples(x, y, z, read, half_range, row, order, first, codes, weights):
    """Write each sample's weight, and its code for choosing the most central sample.

    Nearer than half the range one sample in two along each axis is used, with weight four: they are
    as dense on the surface as all samples are at full range. Codes order by distance to the voxel's
    centre, coarsely, then by number.
    """
    half, steps, most = np.float32(0.5), np.float32(2000.0), np.float32(2047.0)
    zero = np.float32(0.0)
    for s in range(x.shape[0]):
        dx = x[s] - np.floor(x[s]) - half
        dy = y[s] - np.floor(y[s]) - half
        dz = z[s] - np.floor(z[s]) - half
        away = np.int32(min((dx * dx + dy * dy + dz * dz) * steps, most))
        is_near = read[s] < half_range
        odd = (np.int32(order[s] | row) & np.int32(1)) == np.int32(1)
        left_out = (read[s] <= zero) | (is_near & odd)
        code = np.int32(np.int32(away << PIXEL_BITS) | np.int32(first + order[s]))
        codes[s] = np.int32(NO_SAMPLE) if left_out else code
        one = np.int32(4) if is_near else np.int32(1)
        weights[s] = np.int32(0) if left_out else one


@_ROWS
def _merge_codes(voxels, others, codes, their_codes):
    """Keep the better of two samples in one voxel."""
    for s in range(voxels.shape[0]):
        theirs = their_codes[s] if voxels[s] == others[s] else np.int32(NO_SAMPLE)
        codes[s] = min(codes[s], theirs)


@_ROWS
def _merge_weights(voxels, others, weights, their_weights):
    """Add the weight of the other sample in the same voxel."""
    zero = np.int32(0)
    for s in range(voxels.shape[0]):
        moved = their_weights[s] if voxels[s] == others[s] else zero
        weights[s] = np.int32(weights[s] + moved)
        their_weights[s] = np.int32(their_weights[s] - moved)


@njit(cache=True, nogil=True)
def count_endpoints_kernel(depth_image, strides, view, rules, box, place, endpoints):
    """Count the endpoints in each voxel, and keep the most central of each.

    Args:
        depth_image: Prepared depth.
        strides: Pixels between samples along u and v.
        view: The image's geometry.
        rules: Update rules.
        box: Block index of the lower corner of the box of blocks that holds the view, and its
            shape, three each.
        place: (1 + shape[0] * shape[1] * shape[2],) see `select_kernel`.
        endpoints: Overwritten.
    """
    depth, slope, shift = depth_image.depth, depth_image.slope, depth_image.slope_shift
    height, width = depth.shape[0] - 2, depth.shape[1] - 2
    samples_u, samples_v = -(-width // strides[0]), -(-height // strides[1])
    eighth = (samples_u + 7) // 8
    most = 8 * eighth
    # The samples of even rows, the same in all of them, and of odd ones.
    orders, all_pixels = np.empty((2, most), np.int32), np.empty((2, most), np.float32)
    all_columns, all_cells = np.empty((2, most), np.uint32), np.empty((2, most), np.uint32)
    # Loops over few arrays: LLVM does not vectorise loops over more.
    sinks, read = np.empty(most, np.float32), np.empty(most, np.float32)
    z = np.empty(most, np.float32)
    x, y, up = np.empty(most, np.float32), np.empty(most, np.float32), np.empty(most, np.float32)
    voxels, codes = np.empty(most, np.uint32), np.empty(most, np.int32)
    weights, kept = np.empty(most, np.int32), np.empty(most + 1, np.uint32)
    low_x, low_y, low_z, size_x, size_y, size_z = box
    size_x, size_y, size_z = np.int32(size_x), np.int32(size_y), np.int32(size_z)
    near, far = np.float32(view.near_m), np.float32(view.far_m)
    half_range, sink = np.float32(0.5) * far, np.float32(rules.endpoint_depth)
    # Camera coordinates to voxels counted from the box's corner.
    lines = np.empty((3, 4))
    for i in range(3):
        for k in range(4):
            lines[i, k] = view.T_world_camera[i, k] / rules.voxel_size
    lines[0, 3] -= 8.0 * low_x
    lines[1, 3] -= 8.0 * low_y
    lines[2, 3] -= 8.0 * low_z
    steps = lines[0, 0] / view.fx, lines[1, 0] / view.fx, lines[2, 0] / view.fx
    step_x, step_y, step_z = np.float32(steps[0]), np.float32(steps[1]), np.float32(steps[2])
    shift_x, shift_y = np.float32(lines[0, 3]), np.float32(lines[1, 3])
    shift_z = np.float32(lines[2, 3])
    number, best = endpoints.number.ravel(), endpoints.best.ravel()
    for band in range(2 * depth_image.tiles.shape[1]):
        # The even and then the odd rows of a row of tiles. Near samples are left out in odd rows
        # and between two even samples (see `_rate_samples`): odd ones are listed where it is far.
        ty, odd = band >> 1, band & 1
        begin, end = _far_eights(depth_image.tiles[0, ty], half_range, strides[0], samples_u)
        if odd and begin == end:
            continue
        start, length = (begin, end - begin) if odd else (0, eighth)
        order, pixels = orders[odd], all_pixels[odd]
        columns, cells = all_columns[odd], all_cells[odd]
        if odd or band == 0:
            for part in range(8):
                a, b = part * length, (part + 1) * length
                _list_samples(
                    8 * start + PARTS[part], samples_u, strides[0], width, shift,
                    order[a:b], pixels[a:b], columns[a:b], cells[a:b],
                )  # fmt: skip
        n = (8 if begin < end else 4) * length
        # Slices cost a count of references each, so they are made once a band.
        columns_n, cells_n = columns[:n], cells[:n]
        read_n, z_n, x_n, weights_n = read[:n], z[:n], x[:n], weights[:n]
        at_8, at_4, at_2 = length, 2 * length, 4 * length
        voxels_2, codes_2, weights_2 = voxels[at_2:n], codes[at_2:n], weights[at_2:n]
        voxels_4, codes_4, weights_4 = voxels[at_4:at_2], codes[at_4:at_2], weights[at_4:at_2]
        voxels_8, codes_8, weights_8 = voxels[at_8:at_4], codes[at_8:at_4], weights[at_8:at_4]
        last_line = -1
        for sv in range(_first_row(ty, odd, strides[1], height), samples_v, 2):
            v = min(sv * strides[1] + strides[1] // 2, height - 1)
            if v >= TILE * (ty + 1):
                break
            if v >> shift != last_line:
                last_line = v >> shift
                _read_sinks(slope[last_line], cells_n, sink, sinks)
            _read_depth(depth[v + 1], columns_n, read)
            _lift_row(read_n, sinks, near, far, z)
            yn = (v - view.cy) / view.fy
            # The ray of the row's pixel u is start + step * u, for one metre of depth.
            start_x = np.float32(lines[0, 1] * yn + lines[0, 2] - steps[0] * view.cx)
            start_y = np.float32(lines[1, 1] * yn + lines[1, 2] - steps[1] * view.cx)
            start_z = np.float32(lines[2, 1] * yn + lines[2, 2] - steps[2] * view.cx)
            _along_axis(z_n, pixels, start_x, step_x, shift_x, x)
            _along_axis(z_n, pixels, start_y, step_y, shift_y, y)
            _along_axis(z_n, pixels, start_z, step_z, shift_z, up)
            _name_voxels(z_n, x, y, up, size_x, size_y, size_z, voxels)
            first, row = np.int32(sv * samples_u), np.int32(sv)
            _rate_samples(x_n, y, up, read, half_range, row, order, first, codes, weights)
            # 2 k + 1 with 2 k, then 4 k + 2 with 4 k, then 8 k + 4 with 8 k.
            _merge_codes(voxels_2, voxels, codes, codes_2)
            _merge_weights(voxels_2, voxels, weights, weights_2)
            _merge_codes(voxels_4, voxels, codes, codes_4)
            _merge_weights(voxels_4, voxels, weights, weights_4)
            _merge_codes(voxels_8, voxels, codes, codes_8)
            _merge_weights(voxels_8, voxels, weights, weights_8)
            m = _keep_weighted(weights_n, kept)
            _count_row(voxels, codes, weights, kept, m, place, number, best, endpoints.any)


@INNER
def _far_eights(tiles, half_range, stride, samples_u):
    """Return the range of the eights of samples in which a row of tiles may be far."""
    begin, end = tiles.shape[0], 0
    for tx in range(tiles.shape[0]):
        if tiles[tx, 1] >= half_range:
            begin, end = min(begin, tx), tx + 1
    if end == 0:
        return 0, 0
    # Sample s reads pixel s * stride + stride // 2, the last one no further than the image's edge.
    first, last = max(0, begin * TILE // stride - 1), min(samples_u - 1, end * TILE // stride)
    return first // 8, last // 8 + 1


@INNER
def _first_row(ty, odd, stride, height):
    """Return the first even or odd row of samples that lies in a row of tiles."""
    row = max(0, (ty * TILE - stride // 2) // stride - 1)
    row += (row & 1) != odd
    while min(row * stride + stride // 2, height - 1) < ty * TILE:
        row += 2
    return row


@INNER
def _list_samples(first, samples_u, stride, width, shift, order, pixels, columns, cells):
    """List every eighth sample from one on."""
    for slot in range(order.shape[0]):
        su = first + 8 * slot
        u = min(su * stride + stride // 2, width - 1)
        order[slot], pixels[slot] = su, u
        # Beyond the last sample the border is read, which has no depth.
        columns[slot], cells[slot] = (u + 1, u >> shift) if su < samples_u else (0, 0)


@INNER
def _keep_weighted(weights, kept):
    """List the samples with weight; return how many there are."""
    n = np.uint64(0)
    for s in range(weights.shape[0]):
        kept[n] = s
        n += np.uint64(weights[s] != 0)
    return n


@INNER
def _count_row(voxels, codes, weights, kept, n, place, number, best, has_hits):
    """Add a row's samples to their voxels, alternating between the quarters of the list.

    Neighbouring samples often share a voxel; alternating avoids waiting for the previous write.
    """
    # Unsigned indices avoid the check for negative ones.
    quarter = (n + np.uint64(3)) >> np.uint64(2)
    for start in range(quarter):
        for part in range(np.uint64(4)):
            turn = start + part * quarter
            if turn >= n:
                break
            s = kept[turn]
            voxel = voxels[s]
            at = place[voxel >> np.uint32(9)]
            if at < 0:
                # The block's first.
                at = -at
                place[voxel >> np.uint32(9)] = at
                has_hits[at] = 1
                number[at << 9 : (at + 1) << 9] = 0
                best[at << 9 : (at + 1) << 9] = NO_SAMPLE
            k = (np.uint64(at) << np.uint64(9)) | np.uint64(voxel & np.uint32(511))
            number[k] += weights[s]
            best[k] = min(best[k], codes[s])

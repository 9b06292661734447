"""Rows of samples of a depth image: which are read, their voxels, and those that share one."""

from typing import Final

import numpy as np

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

# numba's check for division by zero would prevent vectorisation.
_ROWS: Final = njit(
    **INNER_OPTIONS,
    error_model="numpy",
    fastmath={"nnan", "ninf", "nsz", "contract"},
)


@_ROWS
def read_sinks(slope, cells, sink, out):
    """Write the depth under the surface at which each sample of a row of cells is counted."""
    for s in range(cells.shape[0]):
        out[s] = sink / slope[cells[s]]


@_ROWS
def read_depth(depth, columns, out):
    """Read the depth of each sample of a row."""
    for s in range(columns.shape[0]):
        out[s] = depth[columns[s]]


@_ROWS
def lift_row(read, sinks, near, far, out):
    """Write the depth at which each sample is counted; -1 for those out of range."""
    for s in range(read.shape[0]):
        d = read[s]
        out[s] = d + sinks[s] if (d >= near) & (d <= far) else np.float32(-1.0)


@_ROWS
def lift_along_axis(depth, pixels, start, step, shift, out):
    """Write one coordinate of the samples of a row: (start + step * u) * depth + shift."""
    for s in range(depth.shape[0]):
        out[s] = (start + step * pixels[s]) * depth[s] + shift


@_ROWS
def name_voxels(depth, x, y, z, size_x, size_y, size_z, out):
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
def rate_samples(x, y, z, read, half_range, row, order, first, codes, weights):
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
def merge_codes(voxels, others, codes, their_codes):
    """Keep the better of two samples in one voxel."""
    for s in range(voxels.shape[0]):
        theirs = their_codes[s] if voxels[s] == others[s] else np.int32(NO_SAMPLE)
        codes[s] = min(codes[s], theirs)


@_ROWS
def merge_weights(voxels, others, weights, their_weights):
    """Add the weight of the other sample in the same voxel."""
    zero = np.int32(0)
    for s in range(voxels.shape[0]):
        moved = their_weights[s] if voxels[s] == others[s] else zero
        weights[s] = np.int32(weights[s] + moved)
        their_weights[s] = np.int32(their_weights[s] - moved)


@INNER
def find_far_eights(tiles, half_range, stride, samples_u):
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
def find_first_row(ty, odd, stride, height):
    """Return the first even or odd row of samples that lies in a row of tiles."""
    row = max(0, (ty * TILE - stride // 2) // stride - 1)
    row += (row & 1) != odd
    while min(row * stride + stride // 2, height - 1) < ty * TILE:
        row += 2
    return row


@INNER
def list_samples(first, samples_u, stride, width, shift, order, pixels, columns, cells):
    """List every eighth sample from one on."""
    for slot in range(order.shape[0]):
        su = first + 8 * slot
        u = min(su * stride + stride // 2, width - 1)
        order[slot], pixels[slot] = su, u
        # Beyond the last sample the border is read, which has no depth.
        columns[slot], cells[slot] = (u + 1, u >> shift) if su < samples_u else (0, 0)


@INNER
def keep_weighted(weights, kept):
    """List the samples with weight; return how many there are."""
    n = np.uint64(0)
    for s in range(weights.shape[0]):
        kept[n] = s
        n += np.uint64(weights[s] != 0)
    return n

"""Voxels that contain the endpoints of an image's rays, that is, its depth points."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ippon.camera import PinholeCamera
from ippon.compiling import njit
from ippon.mapping.arrays import INNER
from ippon.mapping.depth_image import TILE
from ippon.mapping.occupancy.sample_rows import (
    NO_SAMPLE,
    PARTS,
    PIXEL_BITS,
    find_far_eights,
    find_first_row,
    keep_weighted,
    lift_along_axis,
    lift_row,
    list_samples,
    merge_codes,
    merge_weights,
    name_voxels,
    rate_samples,
    read_depth,
    read_sinks,
)


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


class EndpointWork(NamedTuple):
    """Working memory of `count_endpoints_kernel`: an entry for each sample of a row, M of them."""

    order: NDArray[np.int32]
    """(2, M) numbers of the samples of even rows, the same in all of them, and of odd ones."""
    pixel: NDArray[np.float32]
    """(2, M) their pixels along u."""
    column: NDArray[np.uint32]
    """(2, M) the same in the padded image; 0, where there is no depth, beyond the last sample."""
    cell: NDArray[np.uint32]
    """(2, M) their cells of slopes along u."""
    sink: NDArray[np.float32]
    """Depth under the surface at which the sample is counted, metres."""
    read: NDArray[np.float32]
    """Depth of its pixel."""
    z: NDArray[np.float32]
    """Depth at which it is counted."""
    x: NDArray[np.float32]
    """The endpoint from the corner of the box of blocks, in voxels; `y` and `up` likewise."""
    y: NDArray[np.float32]
    up: NDArray[np.float32]
    voxel: NDArray[np.uint32]
    """See `name_voxels`."""
    code: NDArray[np.int32]
    """See `rate_samples`."""
    weight: NDArray[np.int32]
    """Endpoints that it stands for."""
    kept: NDArray[np.uint32]
    """(M + 1,) samples with weight."""
    lines: NDArray[np.float64]
    """(3, 4) from camera coordinates to voxels, counted from the corner of the box of blocks."""


def n_listed(width: int, stride: int) -> int:
    """Return the number of samples in a row, up to a multiple of eight."""
    return 8 * -(-width // (8 * stride))


def make_endpoint_work(most: int) -> EndpointWork:
    """Allocate the working memory for rows of M = `most` samples, see `n_listed`."""
    floats = np.zeros((6, most), np.float32)
    return EndpointWork(
        np.zeros((2, most), np.int32),
        np.zeros((2, most), np.float32),
        np.zeros((2, most), np.uint32),
        np.zeros((2, most), np.uint32),
        *floats,
        voxel=np.zeros(most, np.uint32),
        code=np.zeros(most, np.int32),
        weight=np.zeros(most, np.int32),
        kept=np.zeros(most + 1, np.uint32),
        lines=np.zeros((3, 4)),
    )


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


@njit(cache=True, nogil=True)
def count_endpoints_kernel(depth_image, strides, view, rules, box, place, work, endpoints):
    """Count the endpoints in each voxel, and keep the most central of each.

    Args:
        depth_image: Prepared depth.
        strides: Pixels between samples along u and v.
        view: The image's geometry.
        rules: Update rules.
        box: Block index of the lower corner of the box of blocks that holds the view, and its
            shape, three each.
        place: (1 + shape[0] * shape[1] * shape[2],) see `select_kernel`.
        work: Working memory for `n_listed` samples.
        endpoints: Overwritten.
    """
    depth, slope, shift = depth_image.depth, depth_image.slope, depth_image.slope_shift
    height, width = depth.shape[0] - 2, depth.shape[1] - 2
    samples_u, samples_v = -(-width // strides[0]), -(-height // strides[1])
    eighth = work.order.shape[1] // 8
    orders, all_pixels, all_columns, all_cells = work.order, work.pixel, work.column, work.cell
    # Loops over few arrays: LLVM does not vectorise loops over more.
    sinks, read, z, x, y, up = work.sink, work.read, work.z, work.x, work.y, work.up
    voxels, codes, weights, kept = work.voxel, work.code, work.weight, work.kept
    low_x, low_y, low_z, size_x, size_y, size_z = box
    size_x, size_y, size_z = np.int32(size_x), np.int32(size_y), np.int32(size_z)
    near, far = np.float32(view.near_m), np.float32(view.far_m)
    half_range, sink = np.float32(0.5) * far, np.float32(rules.endpoint_depth)
    # Camera coordinates to voxels counted from the box's corner.
    lines = work.lines
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
    number, best = endpoints.number.reshape(-1), endpoints.best.reshape(-1)
    for band in range(2 * depth_image.tiles.shape[1]):
        # The even and then the odd rows of a row of tiles. Near samples are left out in odd rows
        # and between two even samples (see `rate_samples`): odd ones are listed where it is far.
        ty, odd = band >> 1, band & 1
        begin, end = find_far_eights(depth_image.tiles[0, ty], half_range, strides[0], samples_u)
        if odd and begin == end:
            continue
        start, length = (begin, end - begin) if odd else (0, eighth)
        order, pixels = orders[odd], all_pixels[odd]
        columns, cells = all_columns[odd], all_cells[odd]
        if odd or band == 0:
            for part in range(8):
                a, b = part * length, (part + 1) * length
                list_samples(
                    8 * start + PARTS[part], samples_u, strides[0], width, shift,
                    order[a:b], pixels[a:b], columns[a:b], cells[a:b],
                )  # fmt: skip
        n = (8 if begin < end else 4) * length
        columns_n, cells_n = columns[:n], cells[:n]
        read_n, z_n, x_n, weights_n = read[:n], z[:n], x[:n], weights[:n]
        at_8, at_4, at_2 = length, 2 * length, 4 * length
        voxels_2, codes_2, weights_2 = voxels[at_2:n], codes[at_2:n], weights[at_2:n]
        voxels_4, codes_4, weights_4 = voxels[at_4:at_2], codes[at_4:at_2], weights[at_4:at_2]
        voxels_8, codes_8, weights_8 = voxels[at_8:at_4], codes[at_8:at_4], weights[at_8:at_4]
        last_line = -1
        for sv in range(find_first_row(ty, odd, strides[1], height), samples_v, 2):
            v = min(sv * strides[1] + strides[1] // 2, height - 1)
            if v >= TILE * (ty + 1):
                break
            if v >> shift != last_line:
                last_line = v >> shift
                read_sinks(slope[last_line], cells_n, sink, sinks)
            read_depth(depth[v + 1], columns_n, read)
            lift_row(read_n, sinks, near, far, z)
            yn = (v - view.cy) / view.fy
            # The ray of the row's pixel u is start + step * u, for one metre of depth.
            start_x = np.float32(lines[0, 1] * yn + lines[0, 2] - steps[0] * view.cx)
            start_y = np.float32(lines[1, 1] * yn + lines[1, 2] - steps[1] * view.cx)
            start_z = np.float32(lines[2, 1] * yn + lines[2, 2] - steps[2] * view.cx)
            lift_along_axis(z_n, pixels, start_x, step_x, shift_x, x)
            lift_along_axis(z_n, pixels, start_y, step_y, shift_y, y)
            lift_along_axis(z_n, pixels, start_z, step_z, shift_z, up)
            name_voxels(z_n, x, y, up, size_x, size_y, size_z, voxels)
            first, row = np.int32(sv * samples_u), np.int32(sv)
            rate_samples(x_n, y, up, read, half_range, row, order, first, codes, weights)
            # 2 k + 1 with 2 k, then 4 k + 2 with 4 k, then 8 k + 4 with 8 k.
            merge_codes(voxels_2, voxels, codes, codes_2)
            merge_weights(voxels_2, voxels, weights, weights_2)
            merge_codes(voxels_4, voxels, codes, codes_4)
            merge_weights(voxels_4, voxels, weights, weights_4)
            merge_codes(voxels_8, voxels, codes, codes_8)
            merge_weights(voxels_8, voxels, weights, weights_8)
            m = keep_weighted(weights_n, kept)
            _count_row(voxels, codes, weights, kept, m, place, number, best, endpoints.any)


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

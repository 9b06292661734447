"""Which voxels the points of an image fall in."""

from typing import Final, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ippon.camera import PinholeCamera

NO_PIXEL: Final = 0xFFFFFFFF
PIXEL_BITS: Final = 20
"""Bits of `Hits.best` that name a sample; the others hold its distance to the voxel's centre."""


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
    """(n, 512) samples that fell in the voxel, those left out because it is near included."""
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


@njit(cache=True, nogil=True)
def _read_row(depth, slope, columns, cells_u, read, slopes):
    for s in range(columns.shape[0]):
        read[s] = depth[columns[s]]
        slopes[s] = slope[cells_u[s]]


@njit(
    cache=True,
    nogil=True,
    error_model="numpy",
    fastmath={"nnan", "ninf", "nsz", "contract"},
)
def _lift_row(read, slopes, row, near, far, sink, out):
    """Write each sample's depth, taken `sink` under the surface; -1 for those left out.

    Nearer than a quarter of the range, every second sample along either axis is enough;
    `_name_voxels` says which those are.
    """
    quarter = np.float32(0.25) * far
    for s in range(read.shape[0]):
        d = read[s]
        kept = (d >= quarter) | (((np.int32(s) | row) & 1) == 0)
        z = d + sink / slopes[s]
        out[s] = z if (d >= near) & (d <= far) & kept else np.float32(-1.0)


@njit(cache=True, nogil=True, fastmath={"nnan", "ninf", "nsz", "contract"})
def _along_axis(depth, columns, start, step, shift, out):
    """Write one coordinate of the samples of a row: (start + step * u) * depth + shift."""
    for s in range(depth.shape[0]):
        out[s] = (start + step * np.float32(columns[s])) * depth[s] + shift


@njit(cache=True, nogil=True, fastmath={"nnan", "ninf", "nsz", "contract"})
def _name_cells(depth, x, y, z, size_x, size_y, size_z, out):
    """Write each sample's linear index in the directory, -1 where it lies in no block."""
    zero, per_block = np.float32(0.0), np.float32(1.0 / 8.0)
    for s in range(depth.shape[0]):
        i, j, k = x[s] * per_block, y[s] * per_block, z[s] * per_block
        inside = (depth[s] > zero) & (i >= zero) & (j >= zero) & (k >= zero)
        inside = inside & (i < size_x) & (j < size_y) & (k < size_z)
        cell = (np.int32(i) * np.int32(size_y) + np.int32(j)) * np.int32(size_z) + np.int32(k)
        out[s] = np.int32(cell if inside else -1)


@njit(cache=True, nogil=True, fastmath={"nnan", "ninf", "nsz", "contract"})
def _name_voxels(x, y, z, read, far, out):
    """Write what each sample stands for, its distance to the voxel's centre, and the voxel.

    Bit 20: 1 if it stands for 4 samples, else for 1; bits 9 to 19 the distance, coarsely; bits 0 to
    8 the voxel of its block.
    """
    half, steps = np.float32(0.5), np.float32(2000.0)
    quarter = np.float32(0.25) * far
    for s in range(x.shape[0]):
        i, j, k = np.int32(x[s]), np.int32(y[s]), np.int32(z[s])
        dx = x[s] - np.float32(i) - half
        dy = y[s] - np.float32(j) - half
        dz = z[s] - np.float32(k) - half
        away = np.int32((dx * dx + dy * dy + dz * dz) * steps)
        level = np.int32(read[s] < quarter)
        voxel = ((i & 7) << 6) | ((j & 7) << 3) | (k & 7)
        out[s] = np.int32((level << 20) | (away << 9) | voxel)


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
    padded_columns = np.empty(samples_u, np.uint32)
    slope_columns = np.empty(samples_u, np.uint32)
    for su in range(samples_u):
        u = min(su * strides[0] + strides[0] // 2, width - 1)
        columns[su], padded_columns[su], slope_columns[su] = u, u + 1, u >> shift
    # Loops of a few arrays each: LLVM gives up on vectors when one loop has more.
    read, slopes = np.empty(samples_u, np.float32), np.empty(samples_u, np.float32)
    z = np.empty(samples_u, np.float32)
    x, y = np.empty(samples_u, np.float32), np.empty(samples_u, np.float32)
    up = np.empty(samples_u, np.float32)
    cells = np.empty(samples_u, np.int32)
    codes = np.empty(samples_u, np.int32)
    size = directory.shape
    size_x, size_y, size_z = np.float32(size[0]), np.float32(size[1]), np.float32(size[2])
    near, far = np.float32(view.near_m), np.float32(view.far_m)
    sink = np.float32(rules.depth_of_hits)
    found = directory.ravel()
    # Camera coordinates to voxels counted from the directory's corner.
    lines = view.T_world_camera[:3] / rules.voxel_size
    lines[:, 3] -= 8.0 * origin
    steps = lines[:, 0] / view.fx
    step_x, step_y, step_z = np.float32(steps[0]), np.float32(steps[1]), np.float32(steps[2])
    shift_x, shift_y = np.float32(lines[0, 3]), np.float32(lines[1, 3])
    shift_z = np.float32(lines[2, 3])
    for sv in range((height + strides[1] - 1) // strides[1]):
        v = min(sv * strides[1] + strides[1] // 2, height - 1)
        _read_row(depth[v + 1], slope[v >> shift], padded_columns, slope_columns, read, slopes)
        _lift_row(read, slopes, np.int32(sv), near, far, sink, z)
        yn = (v - view.cy) / view.fy
        # The ray of the row's pixel u is start + step * u, for one metre of depth.
        start_x = np.float32(lines[0, 1] * yn + lines[0, 2] - steps[0] * view.cx)
        start_y = np.float32(lines[1, 1] * yn + lines[1, 2] - steps[1] * view.cx)
        start_z = np.float32(lines[2, 1] * yn + lines[2, 2] - steps[2] * view.cx)
        _along_axis(z, columns, start_x, step_x, shift_x, x)
        _along_axis(z, columns, start_y, step_y, shift_y, y)
        _along_axis(z, columns, start_z, step_z, shift_z, up)
        _name_cells(z, x, y, up, size_x, size_y, size_z, cells)
        _name_voxels(x, y, up, read, far, codes)
        _count_row(cells, codes, sv * samples_u, found, rows, list_of_row, n, hits)


@njit(cache=True, nogil=True)
def _count_row(cells, codes, first, found, rows, list_of_row, n, hits):
    """Count a row's samples; neighbours mostly share a voxel and are counted in one go."""
    last_cell, last_voxel, at = -1, -1, -1
    run, least = 0, np.uint32(NO_PIXEL)
    for su in range(cells.shape[0]):
        cell = cells[su]
        if cell < 0:
            continue
        voxel = codes[su] & 511
        code = np.uint32((((codes[su] >> 9) & 2047) << PIXEL_BITS) | (first + su))
        weight = 1 + 3 * (codes[su] >> 20)
        if cell == last_cell and voxel == last_voxel:
            run += weight
            least = min(least, code)
            continue
        if at >= 0:
            hits.best[at, last_voxel] = min(hits.best[at, last_voxel], least)
            hits.number[at, last_voxel] += np.uint16(run)
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
        last_voxel, run, least = voxel, weight, code
    if at >= 0:
        hits.best[at, last_voxel] = min(hits.best[at, last_voxel], least)
        hits.number[at, last_voxel] += np.uint16(run)

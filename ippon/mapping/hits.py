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

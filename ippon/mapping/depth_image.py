"""Depth as the map's kernels want it: cleaned, padded, with slopes and tiles."""

from typing import Final, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ippon.camera import PinholeCamera

MIN_SLOPE: Final = 0.15
"""Least ratio of perpendicular to axial distance: surfaces seen under less than 9 degrees are too
uncertain to tell from a step in depth."""
TILE: Final = 16
"""Edge of the tiles of `DepthImage.tiles` in pixels."""


class DepthImage(NamedTuple):
    """One depth image with what the kernels read beside each pixel."""

    depth: NDArray[np.float32]
    """(H + 2, W + 2) metres, 0 for none; a border of zeros spares the kernels a bounds test."""
    slope: NDArray[np.float32]
    """(h, w) one for each cell of `1 << slope_shift` pixels squared: perpendicular distance to the
    surface for one metre along the optical axis, 1 for a surface that faces the camera."""
    slope_shift: int
    tiles: NDArray[np.float32]
    """(TH, TW, 3) of each tile: least depth, greatest depth, 1 if every pixel has one."""


def prepare_depth(
    depth: NDArray[np.float32], camera: PinholeCamera, voxel_size: float, max_valid_m: float
) -> DepthImage:
    """Clean and index a depth image.

    Args:
        depth: (H, W) metres; NaN, infinite, negative values and those above `max_valid_m` count as
            no return.
        camera: Intrinsics of `depth`.
        voxel_size: Metres; slopes are measured over about half a voxel.
        max_valid_m: Readings above are a sensor's code for "nothing".
    """
    height, width = depth.shape
    shift = 2 if width >= 480 else 1
    padded = np.zeros((height + 2, width + 2), np.float32)
    cell = 1 << shift
    slope = np.empty((-(-height // cell), -(-width // cell)), np.float32)
    tiles = np.empty((-(-height // TILE), -(-width // TILE), 3), np.float32)
    _clean_kernel(np.ascontiguousarray(depth), np.float32(max_valid_m), padded, tiles)
    reach = np.float32(0.5 * voxel_size * max(camera.fx, camera.fy))
    intrinsics = np.array([camera.fx, camera.fy, camera.cx, camera.cy], np.float32)
    _slope_kernel(padded, intrinsics, reach, shift, slope)
    return DepthImage(padded, slope, shift, tiles)


@njit(cache=True, nogil=True, fastmath={"nsz", "contract", "arcp"})
def _clean_kernel(depth, max_valid, padded, tiles):
    height, width = depth.shape
    zero = np.float32(0.0)
    for v in range(height):
        for u in range(width):
            d = depth[v, u]
            # NaN fails both comparisons and so becomes "no return".
            padded[v + 1, u + 1] = d if d > zero and d <= max_valid else zero
    for ty in range(tiles.shape[0]):
        for tx in range(tiles.shape[1]):
            low = np.float32(1e9)
            high = zero
            full = np.float32(1.0)
            for v in range(ty * TILE, min(height, ty * TILE + TILE)):
                for u in range(tx * TILE, min(width, tx * TILE + TILE)):
                    d = padded[v + 1, u + 1]
                    full = full if d > zero else zero
                    low = min(low, d if d > zero else np.float32(1e9))
                    high = max(high, d)
            tiles[ty, tx, 0] = low
            tiles[ty, tx, 1] = high
            tiles[ty, tx, 2] = full


@njit(cache=True, nogil=True)
def _gradient(depth, here, offset, inverse):
    """Return the smaller one-sided difference of inverse depth a pixel step `offset` away."""
    flat = depth
    a = flat[here - offset]
    b = flat[here + offset]
    back = inverse - np.float32(1.0) / a if a > 0 else np.float32(1e9)
    ahead = np.float32(1.0) / b - inverse if b > 0 else np.float32(1e9)
    best = back if abs(back) < abs(ahead) else ahead
    return best if abs(best) < np.float32(1e8) else np.float32(0.0)


@njit(cache=True, nogil=True)
def _slope_kernel(padded, intrinsics, reach, shift, slope):
    # Inverse depth of a plane is affine in (u, v), so its gradient gives the plane's normal, and
    # w / |n| turns a distance along the optical axis into one along the normal.
    height, width = padded.shape[0] - 2, padded.shape[1] - 2
    stride = padded.shape[1]
    flat = padded.ravel()
    fx, fy, cx, cy = intrinsics[0], intrinsics[1], intrinsics[2], intrinsics[3]
    half = 1 << (shift - 1)
    one = np.float32(1.0)
    for cv in range(slope.shape[0]):
        v = min(cv * 2 * half + half, height - 1)
        for cu in range(slope.shape[1]):
            u = min(cu * 2 * half + half, width - 1)
            here = (v + 1) * stride + u + 1
            d = flat[here]
            if d <= 0:
                slope[cv, cu] = one
                continue
            step = int(reach / d)
            step = max(1, min(step, 12, u + 1, v + 1, width - u, height - v))
            w = one / d
            a = _gradient(flat, here, step, w) / np.float32(step)
            b = _gradient(flat, here, step * stride, w) / np.float32(step)
            nx = a * fx
            ny = b * fy
            nz = w - a * (np.float32(u) - cx) - b * (np.float32(v) - cy)
            s = w / np.sqrt(nx * nx + ny * ny + nz * nz)
            slope[cv, cu] = min(one, max(np.float32(MIN_SLOPE), s))

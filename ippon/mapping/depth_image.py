"""A depth image prepared for the map's kernels: cleaned and padded, with slopes and tiles."""

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ippon.camera import PinholeCamera
from ippon.compiling import njit
from ippon.mapping.arrays import INNER, INNER_OPTIONS

MIN_SLOPE: Final = 0.15
"""Least ratio of perpendicular to axial distance. Surfaces seen at less than 9 degrees cannot be
told from a step in depth."""
SPAN: Final = 2
"""Distance in cells over which slopes are measured; large enough to suppress the noise of the
depth."""
NOTHING: Final = 1e9
"""Least depth of a tile without returns."""
TILE: Final = 16
"""Edge of the tiles of `DepthImage.tiles` in pixels."""
SQUARES: Final = 5
"""Number of square sizes in `DepthImage.tiles`. Few blocks span more than 16 tiles; those combine
several squares."""


class DepthImage(NamedTuple):
    """A depth image with precomputed slopes and tiles."""

    depth: NDArray[np.float32]
    """(H + 2, W + 2) metres, 0 for none; a border of zeros spares the kernels a bounds test."""
    slope: NDArray[np.float32]
    """(h, w) per cell of `1 << slope_shift` pixels squared: perpendicular distance to the surface
    per metre along the optical axis; 1 for a surface that faces the camera."""
    slope_shift: int
    tiles: NDArray[np.float32]
    """(K, TH, TW, 2) least depth (`NOTHING` for none) and greatest depth (0 for none) of the square
    of 1 << k tiles that begins at each tile; parts beyond the image are left out."""


def prepare_depth(
    depth: NDArray[np.float32],
    camera: PinholeCamera,
    max_valid_m: float,
    padded: NDArray[np.float32],
) -> DepthImage:
    """Clean a depth image and compute its slopes and tiles.

    Args:
        depth: (H, W) metres; NaN, infinite, negative values and those above `max_valid_m` count as
            no return.
        camera: Intrinsics of `depth`.
        max_valid_m: Readings above are a sensor's code for "nothing".
        padded: (H + 2, W + 2) for `DepthImage.depth`, its border 0; overwritten. Kept from image to
            image, its pages need not be mapped again for each.
    """
    height, width = depth.shape
    shift = 2 if width >= 480 else 1
    cell = 1 << shift
    slope = np.empty((-(-height // cell), -(-width // cell)), np.float32)
    tiles = np.empty((SQUARES, -(-height // TILE), -(-width // TILE), 2), np.float32)
    _clean_kernel(np.ascontiguousarray(depth), np.float32(max_valid_m), padded, tiles[0])
    _join_kernel(tiles)
    intrinsics = np.array([camera.fx, camera.fy, camera.cx, camera.cy], np.float32)
    _slope_kernel(padded, intrinsics, shift, slope)
    return DepthImage(padded, slope, shift, tiles)


@njit(allocates=True, cache=True, nogil=True)
def _clean_kernel(depth, max_valid, padded, tiles):
    """Copy valid depth into the padded image and compute the extremes of each tile."""
    height, width = depth.shape
    low = np.empty(width, np.float32)
    high = np.empty(width, np.float32)
    for ty in range(tiles.shape[0]):
        low[:] = np.float32(NOTHING)
        high[:] = np.float32(0.0)
        for v in range(ty * TILE, min(height, ty * TILE + TILE)):
            _clean_row(depth[v], max_valid, padded[v + 1], low, high)
        tiles[ty, :, 0] = np.float32(NOTHING)
        tiles[ty, :, 1] = np.float32(0.0)
        # Iterations over tiles are independent of each other; those over the pixels of one are not.
        for k in range(TILE):
            for tx in range((width - k + TILE - 1) // TILE):
                tiles[ty, tx, 0] = min(tiles[ty, tx, 0], low[tx * TILE + k])
                tiles[ty, tx, 1] = max(tiles[ty, tx, 1], high[tx * TILE + k])


@njit(cache=True, nogil=True)
def _join_kernel(tiles):
    """Compute the extremes of each square of tiles from four squares of half its width."""
    _, height, width, _ = tiles.shape
    for k in range(1, tiles.shape[0]):
        half = 1 << (k - 1)
        for y in range(height):
            below = min(y + half, height - 1)
            for x in range(width):
                beside = min(x + half, width - 1)
                for side in range(2):
                    a, b = tiles[k - 1, y, x, side], tiles[k - 1, y, beside, side]
                    c, d = tiles[k - 1, below, x, side], tiles[k - 1, below, beside, side]
                    least = side == 0
                    above = min(a, b) if least else max(a, b)
                    under = min(c, d) if least else max(c, d)
                    tiles[k, y, x, side] = min(above, under) if least else max(above, under)


@INNER
def _clean_row(depth, max_valid, out, low, high):
    """Clean a row and update the extremes of each column."""
    zero, nothing = np.float32(0.0), np.float32(NOTHING)
    for u in range(depth.shape[0]):
        d = depth[u]
        # NaN fails both comparisons and so becomes "no return".
        valid = (d > zero) & (d <= max_valid)
        clean = d if valid else zero
        out[u + 1] = clean
        high[u] = max(high[u], clean)
        low[u] = min(low[u], clean if valid else nothing)


# Without numba's check for division by zero the loop can be vectorised.
@njit(
    **INNER_OPTIONS,
    error_model="numpy",
    fastmath={"nnan", "ninf", "nsz", "contract", "arcp"},
)
def _slope_row(here, above, below, v, intrinsics, cell, out):
    """Measure the slopes of a row of cells from inverse depths, `SPAN` cells apart.

    Inverse depth of a plane is affine in (u, v), so its gradient gives the plane's normal n, and
    w / |n| turns a distance along the optical axis into one along the normal. Of the two one-sided
    differences the lesser does not cross a step in depth; where they differ in sign there is a
    ridge, such as a chair leg before the floor, and no slope.
    """
    fx, fy, cx, cy = intrinsics[0], intrinsics[1], intrinsics[2], intrinsics[3]
    one, zero, big = np.float32(1.0), np.float32(0.0), np.float32(1e8)
    per_pixel = np.float32(1.0 / (SPAN * cell))
    y = np.float32(v) - cy
    x_first = np.float32(cell // 2) - cx
    for c in range(out.shape[0]):
        w = here[c + SPAN]
        back = w - here[c] if here[c] > zero else big
        ahead = here[c + 2 * SPAN] - w if here[c + 2 * SPAN] > zero else big
        a = back if abs(back) < abs(ahead) else ahead
        ridge = (back * ahead < zero) & (abs(back) < big) & (abs(ahead) < big)
        a = a * per_pixel if (abs(a) < big) & (not ridge) else zero
        back = w - above[c + SPAN] if above[c + SPAN] > zero else big
        ahead = below[c + SPAN] - w if below[c + SPAN] > zero else big
        b = back if abs(back) < abs(ahead) else ahead
        ridge = (back * ahead < zero) & (abs(back) < big) & (abs(ahead) < big)
        b = b * per_pixel if (abs(b) < big) & (not ridge) else zero
        nx, ny = a * fx, b * fy
        nz = w - a * (x_first + np.float32(c) * np.float32(cell)) - b * y
        s = w / np.sqrt(nx * nx + ny * ny + nz * nz + np.float32(1e-12))
        out[c] = min(one, max(np.float32(MIN_SLOPE), s)) if w > zero else one


@njit(allocates=True, cache=True, nogil=True)
def _slope_kernel(padded, intrinsics, shift, slope):
    height, width = padded.shape[0] - 2, padded.shape[1] - 2
    cell = 1 << shift
    rows, columns = slope.shape
    inverse = np.zeros((rows + 2 * SPAN, columns + 2 * SPAN), np.float32)
    for c in range(rows):
        line = padded[min(c * cell + (cell >> 1), height - 1) + 1]
        for k in range(columns):
            d = line[min(k * cell + (cell >> 1), width - 1) + 1]
            inverse[c + SPAN, k + SPAN] = np.float32(1.0) / d if d > 0 else np.float32(0.0)
    for c in range(rows):
        v = c * cell + (cell >> 1)
        _slope_row(
            inverse[c + SPAN], inverse[c], inverse[c + 2 * SPAN], v, intrinsics, cell, slope[c]
        )

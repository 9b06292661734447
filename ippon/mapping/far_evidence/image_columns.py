"""Object scores of an image by column: how likely the object lies beyond the map's range."""

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ippon.compiling import njit
from ippon.geometry import Float64Array

NEUTRAL: Final = 0.055
"""Score that is as frequent with the object in a column as without it."""
COLUMNS: Final = 24
"""Minimum number of columns of an image."""
TOP_SHARE: Final = 0.00026
"""Share of the image's pixels that are averaged to a score: a hat at ten metres."""
LEAST_OPEN: Final = 0.3
"""Share of a column that must lie beyond the map's range for a low score to count."""
LEAST_RETURNED: Final = 0.6
"""Share of those pixels with depth above which the greatest depth bounds the view."""
BLOB: Final = 0.5
"""Pixels above this share of the score belong to the object."""


class ImageColumns(NamedTuple):
    """Object scores beyond the map's range, one row per image column, left to right."""

    u: Float64Array
    """(K,) centre in heatmap pixels."""
    score: NDArray[np.float32]
    """(K,) mean probability of the highest pixels; negative if too little lies beyond range."""
    low: NDArray[np.int64]
    """(K,) lowest heatmap row of the object's pixels, -1 for none."""
    depth: NDArray[np.float32]
    """(K, 2) least and greatest depth of these pixels, metres; 0 for no return."""
    end: NDArray[np.float32]
    """(K,) greatest depth in the column, 0 where most pixels have no return."""


def read_columns(
    heat: NDArray[np.uint8],
    depth: NDArray[np.float32],
    lens: tuple[float, ...],
    size: tuple[float, float, int],
    up: tuple[float, ...],
    ranges: tuple[float, float],
) -> ImageColumns:
    """Return the score, depth range and lowest row of the object in each image column.

    Args:
        heat: (h, w) probability of the object in units of 1/255.
        depth: (H, W) metres.
        lens: fx, fy, cx, cy of `depth`.
        size: Pixels of `depth` for one of `heat`, along u and v, and h.
        up: World z of the camera's axes, and the camera's height over the floor, metres.
        ranges: Range of the map's object layer, and the sensor's code for no return, metres.
    """
    h, w = heat.shape
    width = -(-w // COLUMNS)
    first = np.arange(0, w, width)
    count = len(first)
    out = ImageColumns(
        u=0.5 * (first + np.minimum(first + width, w)),
        score=np.full(count, -1.0, np.float32),
        low=np.full(count, -1, np.int64),
        depth=np.zeros((count, 2), np.float32),
        end=np.zeros(count, np.float32),
    )
    top = max(1, round(TOP_SHARE * h * w))
    _columns_kernel(heat, depth, lens, size, up, ranges, width, top, out)
    return out


@njit(allocates=True, cache=True, nogil=True)
def _columns_kernel(heat, depth, lens, size, up, ranges, width, top, out):
    h, w = heat.shape
    height, full = depth.shape
    near, most = ranges
    histogram = np.empty(256, np.int64)
    # Depth of each pixel of a column: -1 for no return, 0 within the map's range.
    far = np.empty((h, width), np.float32)
    for c in range(out.score.shape[0]):
        j0, j1 = c * width, min((c + 1) * width, w)
        histogram[:] = 0
        beyond, returned = 0, 0
        for i in range(h):
            v = (2 * i + 1) * height // (2 * h)
            dv = ((i + 0.5) * size[1] - 0.5 - lens[3]) / lens[1]
            for j in range(j0, j1):
                z = depth[v, (2 * j + 1) * full // (2 * w)]
                far[i, j - j0] = 0.0
                if z > 0.0 and z <= near:
                    continue
                if z > near and z <= most:
                    far[i, j - j0] = z
                    returned += 1
                    out.end[c] = max(out.end[c], z)
                else:
                    # A hole in a near surface: the ray meets the floor within the map's range.
                    du = ((j + 0.5) * size[0] - 0.5 - lens[2]) / lens[0]
                    falls = -(up[0] * du + up[1] * dv + up[2])
                    if falls * near > up[3]:
                        continue
                    far[i, j - j0] = -1.0
                beyond += 1
                histogram[heat[i, j]] += 1
        if returned < LEAST_RETURNED * beyond:
            out.end[c] = 0.0
        if beyond < 3 * top:
            continue
        left, total = top, 0
        for code in range(255, -1, -1):
            n = min(left, histogram[code])
            total += n * code
            left -= n
            if left == 0:
                break
        score = total / (255.0 * top)
        if score < NEUTRAL:
            # A narrow gap shows too little for a low score to count.
            if beyond >= LEAST_OPEN * h * (j1 - j0):
                out.score[c] = score
            continue
        here = 0
        for i in range(h):
            for j in range(j0, j1):
                if heat[i, j] < 255.0 * BLOB * score:
                    continue
                z = far[i, j - j0]
                if z == 0.0:
                    here -= 1
                    continue
                here += 1
                out.low[c] = i
                if z > 0.0:
                    out.depth[c, 0] = z if out.depth[c, 0] == 0.0 else min(z, out.depth[c, 0])
                    out.depth[c, 1] = max(z, out.depth[c, 1])
        # If most of the object's pixels are near, the far ones are holes in its depth.
        if here > 0:
            out.score[c] = score

"""The floor grid: the kind of each cell, and the nearest obstacle and unseen cell of each."""

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ippon.compiling import njit
from ippon.geometry import Float64Array

UNSEEN: Final = 0
OPEN: Final = 1
OBSTACLE: Final = 2
BEYOND_CUTOFF: Final = 32767
"""Offset of a cell without a nearest cell within the cut-off."""


class FloorGrid(NamedTuple):
    """The floor in cells of one voxel edge; cell (i, j) is the voxel column origin + (i, j)."""

    voxel_size: float
    origin: NDArray[np.int64]
    """(2,) voxel index of cell (0, 0)."""
    kind: NDArray[np.uint8]
    """(X, Y) `UNSEEN`, `OPEN` or `OBSTACLE`."""
    obstacle: NDArray[np.int16]
    """(X, Y, 2) offset in cells to the nearest obstacle cell, or `BEYOND_CUTOFF`."""
    unseen: NDArray[np.int16]
    """(X, Y, 2) offset in cells to the nearest unseen cell, or `BEYOND_CUTOFF`."""
    cutoff: int
    """Largest distance of a nearest cell, in cells."""


def update_nearest_offsets(
    kind: NDArray[np.uint8],
    value: int,
    window: tuple[int, int, int, int],
    cutoff: int,
    site: NDArray[np.int16],
) -> None:
    """Recompute the offsets to the nearest cell of one kind inside a window.

    Args:
        kind: (X, Y) kinds of the whole grid.
        value: The kind to find.
        window: Cells (i0, i1, j0, j1) to write, upper ends excluded; cells outside it count too.
        cutoff: Offsets longer than this, in cells, become `BEYOND_CUTOFF`.
        site: (X, Y, 2) int16, written inside the window.
    """
    i0, i1, j0, j1 = window
    rows = min(kind.shape[0], i1 + cutoff) - max(0, i0 - cutoff)
    along = np.empty((rows, j1 - j0), dtype=np.int16)
    _update_nearest_offsets_kernel(kind, value, i0, i1, j0, j1, cutoff, along, site)


@njit(cache=True, nogil=True)
def _update_nearest_offsets_kernel(kind, value, i0, i1, j0, j1, cutoff, along, site):
    nx, ny = kind.shape
    a0, a1 = max(0, i0 - cutoff), min(nx, i1 + cutoff)
    b0, b1 = max(0, j0 - cutoff), min(ny, j1 + cutoff)
    for i in range(a0, a1):
        last = -(1 << 20)
        for j in range(b0, j1):
            if kind[i, j] == value:
                last = j
            if j >= j0:
                d = last - j
                along[i - a0, j - j0] = d if d >= -cutoff else BEYOND_CUTOFF
        last = 1 << 20
        for j in range(b1 - 1, j0 - 1, -1):
            if kind[i, j] == value:
                last = j
            if j < j1:
                d = last - j
                if d <= cutoff and d < abs(along[i - a0, j - j0]):
                    along[i - a0, j - j0] = d
    for i in range(i0, i1):
        for j in range(j0, j1):
            best, bi, bj = cutoff * cutoff + 1, BEYOND_CUTOFF, BEYOND_CUTOFF
            for step in range(2 * cutoff + 1):
                # 0, 1, -1, 2, -2, …: nearest columns first, so that the search can end early.
                di = (step + 1) // 2 if step % 2 == 1 else -(step // 2)
                if di * di >= best:
                    break
                c = i + di
                if c < a0 or c >= a1:
                    continue
                dj = along[c - a0, j - j0]
                if dj == BEYOND_CUTOFF:
                    continue
                d2 = di * di + dj * dj
                if d2 < best:
                    best, bi, bj = d2, di, dj
            site[i, j, 0] = bi
            site[i, j, 1] = bj


def offset_distance_cells(offsets: NDArray[np.int16]) -> Float64Array:
    """Return (…) distances in cells from offsets (…, 2); very large for `BEYOND_CUTOFF`."""
    return np.hypot(offsets[..., 0].astype(np.float64), offsets[..., 1].astype(np.float64))


def cell_centre(grid: FloorGrid, i: int, j: int) -> tuple[float, float]:
    """Return the world x and y of a cell's centre."""
    v = grid.voxel_size
    return (i + grid.origin[0] + 0.5) * v, (j + grid.origin[1] + 0.5) * v


def cell_centres(grid: FloorGrid, cells: NDArray[np.int64]) -> Float64Array:
    """Return the (N, 2) world x and y of the centres of (N, 2) cells, metres."""
    return np.asarray((cells + grid.origin + 0.5) * grid.voxel_size, dtype=np.float64)


def obstacle_distance_m(grid: FloorGrid, cells: NDArray[np.int64]) -> Float64Array:
    """Return the (N,) distances from (N, 2) cells to the nearest obstacle, metres."""
    return offset_distance_cells(grid.obstacle[cells[:, 0], cells[:, 1]]) * grid.voxel_size

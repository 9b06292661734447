"""The map as the kernels see it: dense blocks of 8 x 8 x 8 voxels found through a directory."""

import math
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ippon.compiling import njit

BLOCK_EDGE: Final = 8
BLOCK_VOLUME: Final = 512

UNKNOWN: Final = 0
FREE: Final = 1
OCCUPIED: Final = 2

NOT_MAPPED: Final = 255
"""In `MapArrays.ooi` and `MapArrays.level`: this voxel was never labelled."""

INNER_OPTIONS: Final[dict[str, Any]] = {
    "cache": True,
    "nogil": True,
    "no_cpython_wrapper": True,
    "no_cfunc_wrapper": True,
}
"""Options of functions that only kernels call: without an entry point for Python they compile
faster."""
INNER: Final = njit(**INNER_OPTIONS)


def read_only(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return a contiguous, read-only view of an image.

    numba compiles a kernel separately for writable and for read-only arrays; arrays that were
    unpacked from a message are read-only.
    """
    view = np.ascontiguousarray(image).view()
    view.flags.writeable = False
    return view


class MapArrays(NamedTuple):
    """Read-only arrays that a compiled kernel takes as one argument.

    Voxel (i, j, k) covers [i, i + 1) * voxel_size along x, and so on. It lies in block
    b = (i >> 3, j >> 3, k >> 3), found in row `directory[b - origin_block]` of the pools, at
    column ((i & 7) * 8 + (j & 7)) * 8 + (k & 7). A row below 0, or a block outside the directory,
    means that nothing was observed there. `ooi[slab[row], column]` and `level` likewise, because
    most blocks are free space and have neither.
    """

    voxel_size: float
    origin_block: NDArray[np.int64]
    """(3,) block index of `directory[0, 0, 0]`."""
    directory: NDArray[np.int32]
    """(DX, DY, DZ) row in the pools, -1 for none."""
    state: NDArray[np.uint8]
    """(B, 512) `UNKNOWN`, `FREE` or `OCCUPIED`."""
    slab: NDArray[np.int32]
    """(B,) row in `ooi` and `level`; blocks without surface share row 0."""
    ooi: NDArray[np.uint8]
    """(S, 512) p(v in O) in units of 1/254 of voxels in V_O, else `NOT_MAPPED`."""
    level: NDArray[np.uint8]
    """(S, 512) proximity level of the most probable label, else `NOT_MAPPED`."""
    squared_distance: NDArray[np.uint16]
    """(B, 512) squared distance between voxel centres, in voxels, to the nearest occupied voxel,
    cut off at a maximum: whole numbers, so nothing is lost."""
    revision: NDArray[np.int64]
    """(B,) map revision at which the block last changed; 0 for a row without a block."""
    ooi_clear_m: float = math.inf
    """Depth in metres up to which a miss of the object of interest is evidence; see `VoxelMap`."""
    ooi_prior_log_odds: float = math.inf
    """Log-odds of p(v in O) of a voxel without evidence; infinite without an object of interest."""

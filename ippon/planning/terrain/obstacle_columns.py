"""Obstacles and floor in each voxel column of the map, for a body on that floor.

A voxel is up to half its edge off the surface that it represents. At 10 cm the lowest collision
sphere of a robot that rolls over 6 cm would always touch the floor's own voxels in the 3-D distance
field. The body is therefore checked in the plane, against the columns above the floor band.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ippon.compiling import njit
from ippon.mapping.arrays import FREE, OCCUPIED, UNKNOWN, MapArrays
from ippon.planning.voxel_lookup import block_row
from ippon.robot import RobotProfile

COLUMN_UNSEEN: Final = 0
COLUMN_CLEAR: Final = 1
"""No obstacle at the height of the body, and enough of the column was seen."""
COLUMN_BLOCKED: Final = 2
"""An obstacle at the height of the body."""
FLOOR_SEEN: Final = 4
"""Bit: a surface at the height of the floor."""
FLOOR_ABSENT: Final = 8
"""Bit: free space at the height of the floor: a drop, or a stair that leads down."""
DROP_COLUMNS: Final = 3
"""Columns without floor that make a drop of a column, among it and its eight neighbours: rays
through the edge of a floor free single voxels. The column before the edge counts as part of it."""


@dataclass(frozen=True, slots=True)
class HeightBands:
    """Voxel layers of the floor and of the body above it, both ends included."""

    floor_low: int
    floor_high: int
    body_low: int
    body_high: int

    @classmethod
    def of(cls, robot: RobotProfile, floor_z_m: float, voxel_size: float) -> "HeightBands":
        """Return the layers for a robot on a floor of this height."""
        # A surface at step height occupies voxels up to almost half an edge above it.
        above = floor_z_m + robot.max_step_m + 0.45 * voxel_size
        # The same below: a full half edge would accept a stair two steps deep as floor.
        below = floor_z_m - robot.max_step_m - 0.45 * voxel_size
        top = floor_z_m + robot.height_m
        floor_high = math.floor(above / voxel_size - 0.5)
        return cls(
            floor_low=min(floor_high, math.ceil(below / voxel_size - 0.5)),
            floor_high=floor_high,
            body_low=floor_high + 1,
            body_high=max(floor_high + 1, math.ceil(top / voxel_size - 1e-6) - 1),
        )


def height_tolerance_m(robot: RobotProfile, voxel_size: float) -> float:
    """Return by how much the pose's height changes on one floor at most, metres."""
    return max(0.5 * robot.max_step_m, 0.25 * voxel_size)


def classify_columns(
    arrays: MapArrays,
    bands: HeightBands,
    blocks: NDArray[np.int64],
    min_seen: float,
    origin: NDArray[np.int64],
    out: NDArray[np.uint8],
) -> None:
    """Classify the 8 x 8 voxel columns of block columns.

    Args:
        arrays: The map.
        bands: Layers of floor and body.
        blocks: (M, 2) block indices (x, y).
        min_seen: Fraction of the body's layers that must be known free for a clear column.
        origin: (2,) voxel index of `out[0, 0]`.
        out: (X, Y) uint8, one of the `COLUMN_` values plus the `FLOOR_` bits, written in place.
    """
    layers = np.array(
        [bands.floor_low, bands.floor_high, bands.body_low, bands.body_high], dtype=np.int64
    )
    _read_columns_kernel(arrays, blocks, layers, min_seen, origin[0], origin[1], out)


@njit(cache=True, nogil=True)
def floor_of_column(arrays: MapArrays, i: int, j: int, low: int, high: int) -> int:
    """Return `FLOOR_SEEN`, `FLOOR_ABSENT`, or 0 for a column whose floor is not known.

    Args:
        arrays: The map.
        i: Voxel index of the column; likewise j.
        j: See i.
        low: Lowest layer of the floor's band.
        high: Its highest layer.
    """
    column = ((i & 7) << 6) | ((j & 7) << 3)
    empty = 0
    for k in range(low, high + 1):
        row = block_row(arrays, i, j, k)
        if row < 0:
            continue
        state = arrays.state[row, column | (k & 7)]
        if state == OCCUPIED:
            return FLOOR_SEEN
        if state == FREE:
            empty += 1
    if empty < high - low + 1:
        return 0
    # The last layer of the band may just miss a floor, so the layer below must have been seen too:
    # as more free space, or as a lower surface.
    row = block_row(arrays, i, j, low - 1)
    if row < 0 or arrays.state[row, column | ((low - 1) & 7)] == UNKNOWN:
        return 0
    return FLOOR_ABSENT


@njit(cache=True, nogil=True)
def _read_columns_kernel(arrays, blocks, bands, min_seen, origin_i, origin_j, out):
    layers = bands[3] - bands[2] + 1
    for n in range(blocks.shape[0]):
        for a in range(8):
            for b in range(8):
                i, j = blocks[n, 0] * 8 + a, blocks[n, 1] * 8 + b
                free, blocked = 0, False
                row, at = -1, -(1 << 40)
                for k in range(bands[2], bands[3] + 1):
                    if (k >> 3) != at:
                        at = k >> 3
                        row = block_row(arrays, i, j, k)
                    if row < 0:
                        continue
                    state = arrays.state[row, (a << 6) | (b << 3) | (k & 7)]
                    if state == OCCUPIED:
                        blocked = True
                        break
                    if state == FREE:
                        free += 1
                value = COLUMN_UNSEEN
                if blocked:
                    value = COLUMN_BLOCKED
                elif free >= min_seen * layers:
                    value = COLUMN_CLEAR
                value |= floor_of_column(arrays, i, j, bands[0], bands[1])
                out[i - origin_i, j - origin_j] = value


def changed_block_columns(
    arrays: MapArrays, bands: HeightBands, since_revision: int
) -> NDArray[np.int64]:
    """List block columns whose floor or body layers changed after a revision.

    Returns:
        (M, 2) int64 block indices (x, y).
    """
    low = (bands.floor_low - 1) >> 3
    high = bands.body_high >> 3
    out = np.empty((arrays.directory.shape[0] * arrays.directory.shape[1], 2), dtype=np.int64)
    count = _changed_block_columns_kernel(arrays, low, high, since_revision, out)
    return out[:count]


@njit(cache=True, nogil=True)
def _changed_block_columns_kernel(arrays, low, high, since_revision, out):
    directory, origin = arrays.directory, arrays.origin_block
    count = 0
    first = max(0, low - origin[2])
    last = min(directory.shape[2] - 1, high - origin[2])
    for bx in range(directory.shape[0]):
        for by in range(directory.shape[1]):
            for bz in range(first, last + 1):
                row = directory[bx, by, bz]
                if row >= 0 and arrays.revision[row] > since_revision:
                    out[count, 0] = bx + origin[0]
                    out[count, 1] = by + origin[1]
                    count += 1
                    break
    return count

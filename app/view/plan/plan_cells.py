"""Cells of the floor plan from the surface voxels: floor, furniture, wall, or not explored."""

from dataclasses import dataclass
from enum import IntEnum
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ippon.frame import UNDERFOOT_M

FLOOR_M: Final = 0.1
"""Height up to which surface is floor; this and all others are above the robot's floor."""
TALL_M: Final = 2.0
"""Height up to which surface counts; ceilings and lintels do not."""
BODY_M: Final = 1.6
"""Height up to which surface is furniture, which a robot cannot drive through."""
WALL_LOW_M: Final = 0.3
WALL_SHARE: Final = 0.6
"""Share of the height between `WALL_LOW_M` and `TALL_M` that a wall fills."""


class Cell(IntEnum):
    """What a cell of the plan is."""

    UNKNOWN = 0
    FLOOR = 1
    FURNITURE = 2
    WALL = 3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlanCells:
    """Cells of the plan, the size of a voxel each."""

    cells: NDArray[np.uint8]
    """(X, Y) `Cell`."""
    origin_m: tuple[float, float]
    """World x and y of the corner of `cells[0, 0]`."""
    cell_m: float

    @property
    def size_m(self) -> tuple[float, float]:
        """Extent along x and y."""
        return self.cells.shape[0] * self.cell_m, self.cells.shape[1] * self.cell_m

    def packed(self) -> bytes:
        """Return four cells per byte, the first in the lowest bits; rows along x, y fastest."""
        flat = self.cells.reshape(-1)
        padded = np.zeros(-(-len(flat) // 4) * 4, np.uint8)
        padded[: len(flat)] = flat
        quads = padded.reshape(-1, 4) << np.array([0, 2, 4, 6], np.uint8)
        return np.bitwise_or.reduce(quads, axis=1).astype(np.uint8).tobytes()


def plan_cells(
    indices: NDArray[np.int64], is_wall: NDArray[np.bool_], voxel_m: float, floor_z_m: float
) -> PlanCells | None:
    """Return the plan of one floor of a map; None for a map without voxels.

    Args:
        indices: (N, 3) surface voxels.
        is_wall: (N,) whether the label of a voxel is a wall.
        voxel_m: Edge length of a voxel.
        floor_z_m: Height of the floor; surface of other floors does not count.
    """
    if not len(indices):
        return None
    height = (indices[:, 2] + 0.5) * voxel_m - floor_z_m
    low = indices[:, :2].min(axis=0)
    size = indices[:, :2].max(axis=0) - low + 1
    at = (indices[:, :2] - low) @ np.array([size[1], 1])

    def count(chosen: NDArray[np.bool_]) -> NDArray[np.int64]:
        return np.bincount(at[chosen], minlength=int(size.prod()))

    upright = (height > WALL_LOW_M) & (height < TALL_M)
    body = (height > FLOOR_M) & (height < BODY_M)
    filled = count(upright)
    fills = filled >= WALL_SHARE * (TALL_M - WALL_LOW_M) / voxel_m
    labelled = (filled > 0) & (2 * count(upright & is_wall) >= filled)
    cells = np.full(int(size.prod()), Cell.UNKNOWN, np.uint8)
    cells[count((height > -UNDERFOOT_M) & (height <= FLOOR_M)) > 0] = Cell.FLOOR
    cells[count(body) > 0] = Cell.FURNITURE
    cells[fills | labelled] = Cell.WALL
    return PlanCells(
        cells=cells.reshape(int(size[0]), int(size[1])),
        origin_m=(float(low[0] * voxel_m), float(low[1] * voxel_m)),
        cell_m=voxel_m,
    )

"""Cells for new viewpoints: near objects, near the robot, and in the remaining free space."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ippon.compiling import njit
from ippon.geometry import Float64Array
from ippon.planning.terrain.clearance import clearance_at
from ippon.planning.terrain.floor_grid import (
    FloorGrid,
    cell_centre,
    cell_centres,
    obstacle_distance_m,
)
from ippon.planning.terrain.reachability import PASSED, STANDABLE


@dataclass(frozen=True, slots=True, kw_only=True)
class SamplingConfig:
    """Density of the viewpoints."""

    local_radius_m: float = 2.0
    """Within this distance of the robot viewpoints lie densely; more evaluates more."""
    local_spacing_m: float = 0.6
    """Least distance between viewpoints near the robot."""
    spacing_m: float = 1.0
    """Least distance elsewhere; more covers the floor with fewer viewpoints."""
    object_spacing_m: float = 0.3
    """Least distance between viewpoints near a recognised object."""
    robot_spacing_m: float = 0.12
    """Least distance from the robot to other viewpoints for its own position to become one, where
    the search may end; more adds fewer of them."""
    object_reach_m: float = 0.95
    """Viewpoints near an object lie within this distance of one of its voxels: less than the metre
    of the task, so that the robot need not stop exactly on them."""
    choices: int = 4
    """Cells drawn per sample, of which the one with the largest clearance is used; more moves
    viewpoints away from walls."""
    ample_clearance_m: float = 0.5
    """Clearance above which cells are equally good; more moves viewpoints farther into the open."""
    thinning_interval_steps: int = 5
    """Steps between two searches for crowded viewpoints of a full roadmap; more takes less time and
    frees nodes later."""

    def __post_init__(self) -> None:
        """Reject densities that contradict each other."""
        if not 0.0 < self.object_spacing_m <= self.local_spacing_m <= self.spacing_m:
            raise ValueError(
                "spacings must grow: 0 < object_spacing_m <= local_spacing_m <= spacing_m; got "
                f"{self.object_spacing_m}, {self.local_spacing_m}, {self.spacing_m}"
            )


def mark_discs(
    mask: NDArray[np.uint8],
    grid: FloorGrid,
    points: Float64Array,
    radius_m: float,
    value: int,
) -> None:
    """Write `value` into the cells of (X, Y) `mask` within a radius of any of (N, 2) points."""
    if len(points):
        _mark_discs_kernel(mask, grid, np.ascontiguousarray(points), radius_m, value)


@njit(cache=True, nogil=True)
def _mark_discs_kernel(mask, grid, points, radius_m, value):
    nx, ny = mask.shape
    reach = radius_m / grid.voxel_size
    for n in range(points.shape[0]):
        fx = points[n, 0] / grid.voxel_size - grid.origin[0] - 0.5
        fy = points[n, 1] / grid.voxel_size - grid.origin[1] - 0.5
        for i in range(max(0, math.ceil(fx - reach)), min(nx, math.floor(fx + reach) + 1)):
            for j in range(max(0, math.ceil(fy - reach)), min(ny, math.floor(fy + reach) + 1)):
                # Strictly inside: cells exactly `radius_m` away are far enough.
                if (i - fx) ** 2 + (j - fy) ** 2 < reach * reach - 1e-9:
                    mask[i, j] = value


def open_cells(
    reachable: NDArray[np.uint8], grid: FloorGrid, nodes: Float64Array, spacing_m: float
) -> NDArray[np.uint8]:
    """Return (X, Y) uint8, 1 where a viewpoint may go, at least `spacing_m` from all others."""
    places = (reachable == STANDABLE).astype(np.uint8)
    mark_discs(places, grid, nodes, spacing_m, 0)
    return places


def tight_cells(
    objects: NDArray[np.uint8],
    reachable: NDArray[np.uint8],
    grid: FloorGrid,
    spacing_m: float,
    least_room_m: float,
) -> NDArray[np.bool_]:
    """Find tight cells near objects that have no standable cell near them.

    A mug on a sideboard may be within reach only from a gap beside it.

    Args:
        objects: (X, Y) 1 within reach of an object.
        reachable: (X, Y) from `reachable_cells`.
        grid: The floor.
        spacing_m: Distance within which a standable cell replaces a tight one.
        least_room_m: Least distance from a tight cell to an obstacle: the radius of the body and
            the margin of every move.

    Returns:
        (X, Y) True for cells that are only passable but may hold a viewpoint.
    """
    tight = np.zeros(reachable.shape, dtype=np.bool_)
    cells = np.argwhere((objects == 1) & (reachable == PASSED))
    cells = cells[obstacle_distance_m(grid, cells) >= least_room_m]
    if len(cells):
        roomy = np.argwhere((objects == 1) & (reachable == STANDABLE))
        covered = np.zeros_like(reachable)
        mark_discs(covered, grid, cell_centres(grid, roomy), spacing_m, 1)
        tight[tuple(cells.T)] = covered[tuple(cells.T)] == 0
    return tight


def draw_cell(
    places: NDArray[np.int64],
    grid: FloorGrid,
    rng: np.random.Generator,
    choices: int,
    ample_clearance_m: float,
) -> tuple[int, int]:
    """Draw a few cells at random and return the one with the largest clearance.

    Args:
        places: (M, 2) cells, M > 0.
        grid: The floor.
        rng: Source of randomness.
        choices: Cells to draw.
        ample_clearance_m: See `SamplingConfig.ample_clearance_m`.
    """
    drawn = places[rng.integers(0, len(places), size=choices)]
    room = [clearance_at(grid, *cell_centre(grid, int(i), int(j))) for i, j in drawn]
    best = int(np.argmax(np.minimum(room, ample_clearance_m)))
    return int(drawn[best, 0]), int(drawn[best, 1])

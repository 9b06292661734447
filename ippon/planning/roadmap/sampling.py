"""Where the next viewpoints go: dense near the robot first, then the remaining free space."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ippon.geometry import Float64Array
from ippon.planning.terrain.body_limits import BodyLimits, passing_radius, passing_unseen_radius
from ippon.planning.terrain.clearance import OPEN, FloorGrid, clearance_at, site_cells

PASSED: Final = 1
STANDABLE: Final = 2
SLACK_CELLS: Final = 0.4


@dataclass(frozen=True, slots=True, kw_only=True)
class SamplingConfig:
    """Density of the viewpoints."""

    local_radius_m: float = 2.0
    """Within this distance of the robot viewpoints lie densely; more evaluates more."""
    local_spacing_m: float = 0.6
    """Least distance between viewpoints near the robot."""
    spacing_m: float = 1.0
    """Least distance elsewhere; gains of viewpoints farther apart count as independent."""
    object_spacing_m: float = 0.3
    """Least distance of viewpoints round a recognised object."""
    object_reach_m: float = 0.95
    """Viewpoints round an object lie within this of one of its voxels: less than the metre of the
    task, so that the robot need not stop exactly on them."""
    choices: int = 4
    """Places drawn for each sample; the one with the most room wins."""

    def __post_init__(self) -> None:
        """Reject densities that contradict each other."""
        if not 0.0 < self.object_spacing_m <= self.local_spacing_m <= self.spacing_m:
            raise ValueError(
                "spacings must grow: 0 < object_spacing_m <= local_spacing_m <= spacing_m; got "
                f"{self.object_spacing_m}, {self.local_spacing_m}, {self.spacing_m}"
            )


def reachable_cells(
    grid: FloorGrid, limits: BodyLimits, x: float, y: float, margin: float, comfort: float
) -> NDArray[np.uint8]:
    """Flood the floor from the robot.

    A gap may have room for the body between the centres of cells but on none of them, so the flood
    runs over cells that miss the margin by up to `SLACK_CELLS`; whether the gap can be passed is
    for the moves to say, which are exact below a cell. It begins on such cells within 0.5 m of the
    robot, so that one that stands too close to something is not cut off.

    Returns:
        (X, Y) uint8: `STANDABLE` where the robot could stand, and turn, with `margin` and `comfort`
        metres beside the body, `PASSED` where the flood merely went through, 0 elsewhere.
    """
    out = np.zeros(grid.kind.shape, dtype=np.uint8)
    queue = np.empty((grid.kind.size, 2), dtype=np.int32)
    _flood_kernel(grid, limits, x, y, margin, comfort, queue, out)
    return out


@njit(cache=True, nogil=True)
def _passable(grid, limits, i, j, margin, comfort):
    if grid.kind[i, j] != OPEN:
        return 0
    need = passing_unseen_radius(limits) / grid.voxel_size
    di, dj = int(grid.unseen[i, j, 0]), int(grid.unseen[i, j, 1])
    seen = di * di + dj * dj
    if seen < need * need:
        return 0
    di, dj = int(grid.obstacle[i, j, 0]), int(grid.obstacle[i, j, 1])
    room = di * di + dj * dj
    if room >= ((limits.radius + margin + comfort) / grid.voxel_size) ** 2 and (
        seen >= (limits.unseen_radius / grid.voxel_size) ** 2
    ):
        return STANDABLE
    need = (passing_radius(limits) + margin) / grid.voxel_size
    return PASSED if room >= (need - SLACK_CELLS) ** 2 else 0


@njit(cache=True, nogil=True)
def _flood_kernel(grid, limits, x, y, margin, comfort, queue, out):
    nx, ny = out.shape
    fx = x / grid.voxel_size - grid.origin[0] - 0.5
    fy = y / grid.voxel_size - grid.origin[1] - 0.5
    reach = 0.5 / grid.voxel_size
    head, tail = 0, 0
    for i in range(max(0, int(fx - reach)), min(nx, int(fx + reach) + 2)):
        for j in range(max(0, int(fy - reach)), min(ny, int(fy + reach) + 2)):
            if (i - fx) ** 2 + (j - fy) ** 2 > reach * reach:
                continue
            out[i, j] = _passable(grid, limits, i, j, margin, comfort)
            if out[i, j]:
                queue[tail, 0], queue[tail, 1] = i, j
                tail += 1
    while head < tail:
        i, j = queue[head, 0], queue[head, 1]
        head += 1
        for n in range(4):
            a = i + (1 if n == 0 else -1 if n == 1 else 0)
            b = j + (1 if n == 2 else -1 if n == 3 else 0)
            if a < 0 or b < 0 or a >= nx or b >= ny or out[a, b]:
                continue
            out[a, b] = _passable(grid, limits, a, b, margin, comfort)
            if out[a, b]:
                queue[tail, 0], queue[tail, 1] = a, b
                tail += 1


def cover(
    mask: NDArray[np.uint8],
    grid: FloorGrid,
    points: Float64Array,
    radius_m: float,
    value: int,
) -> None:
    """Write `value` into the cells of (X, Y) `mask` within a radius of any of (N, 2) points."""
    if len(points):
        _cover_kernel(mask, grid, np.ascontiguousarray(points), radius_m, value)


@njit(cache=True, nogil=True)
def _cover_kernel(mask, grid, points, radius_m, value):
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


def open_places(
    reachable: NDArray[np.uint8], grid: FloorGrid, nodes: Float64Array, spacing_m: float
) -> NDArray[np.uint8]:
    """Return (X, Y) uint8, 1 where a viewpoint could go without crowding another."""
    places = (reachable == STANDABLE).astype(np.uint8)
    cover(places, grid, nodes, spacing_m, 0)
    return places


def tight_places(
    objects: NDArray[np.uint8],
    reachable: NDArray[np.uint8],
    grid: FloorGrid,
    spacing_m: float,
    least_room_m: float,
) -> NDArray[np.bool_]:
    """Find places beside objects that are tight, and no roomier one within a distance of them.

    A mug on a sideboard may be within reach from a gap beside it only.

    Args:
        objects: (X, Y) 1 within reach of an object.
        reachable: (X, Y) from `reachable_cells`.
        grid: The floor.
        spacing_m: That distance.
        least_room_m: Distance to the nearest obstacle that a tight place must have: the body, and
            the margin that every move leaves.

    Returns:
        (X, Y) True where the flood merely went through, and a viewpoint may go all the same.
    """
    tight = np.zeros(reachable.shape, dtype=np.bool_)
    cells = np.argwhere((objects == 1) & (reachable == PASSED))
    cells = cells[room_m(grid, cells) >= least_room_m]
    if len(cells):
        roomy = np.argwhere((objects == 1) & (reachable == STANDABLE))
        covered = np.zeros_like(reachable)
        cover(covered, grid, cell_centres(grid, roomy), spacing_m, 1)
        tight[tuple(cells.T)] = covered[tuple(cells.T)] == 0
    return tight


def draw_place(
    places: NDArray[np.int64], grid: FloorGrid, rng: np.random.Generator, choices: int
) -> tuple[int, int]:
    """Draw a cell; of a few drawn at random the one with the most room wins.

    Args:
        places: (M, 2) cells, M > 0.
        grid: The floor.
        rng: Source of randomness.
        choices: Cells to draw.
    """
    drawn = places[rng.integers(0, len(places), size=choices)]
    room = [clearance_at(grid, *cell_centre(grid, int(i), int(j))) for i, j in drawn]
    # Beyond half a metre more room is no better.
    best = int(np.argmax(np.minimum(room, 0.5)))
    return int(drawn[best, 0]), int(drawn[best, 1])


def cell_centre(grid: FloorGrid, i: int, j: int) -> tuple[float, float]:
    """Return the world x and y of a cell's centre."""
    v = grid.voxel_size
    return (i + grid.origin[0] + 0.5) * v, (j + grid.origin[1] + 0.5) * v


def cell_centres(grid: FloorGrid, cells: NDArray[np.int64]) -> Float64Array:
    """Return the (N, 2) world x and y of the centres of (N, 2) cells, metres."""
    return np.asarray((cells + grid.origin + 0.5) * grid.voxel_size, dtype=np.float64)


def room_m(grid: FloorGrid, cells: NDArray[np.int64]) -> Float64Array:
    """Return the (N,) distances from (N, 2) cells to the nearest obstacle, metres."""
    return site_cells(grid.obstacle[cells[:, 0], cells[:, 1]]) * grid.voxel_size

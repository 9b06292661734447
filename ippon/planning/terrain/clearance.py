"""Exact distances in the plane of the floor, and what they say about a straight move."""

import math
from typing import Final, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ippon.geometry import Float64Array
from ippon.planning.terrain.body_limits import BodyLimits, passing_unseen_radius, speed_at

UNSEEN: Final = 0
OPEN: Final = 1
OBSTACLE: Final = 2

NO_SITE: Final = 32767
"""Offset where no site lies within the cut-off."""
_TURN_STEP_RAD: Final = 0.1
"""Headings of a turn that are checked lie so far apart: 5 cm at the end of a metre."""


class FloorGrid(NamedTuple):
    """The floor in cells of one voxel; cell (i, j) is the voxel column origin + (i, j)."""

    voxel_size: float
    origin: NDArray[np.int64]
    """(2,) voxel index of cell (0, 0)."""
    kind: NDArray[np.uint8]
    """(X, Y) `UNSEEN`, `OPEN` or `OBSTACLE`."""
    obstacle: NDArray[np.int16]
    """(X, Y, 2) offset in cells to the nearest obstacle cell, `NO_SITE` beyond the cut-off."""
    unseen: NDArray[np.int16]
    """(X, Y, 2) offset in cells to the nearest unseen cell, `NO_SITE` beyond the cut-off."""
    cutoff: int
    """Cells beyond which sites are not looked for."""


def update_sites(
    kind: NDArray[np.uint8],
    value: int,
    window: tuple[int, int, int, int],
    cutoff: int,
    site: NDArray[np.int16],
) -> None:
    """Recompute, inside a window, the offset from every cell to the nearest cell of one kind.

    Args:
        kind: (X, Y) kinds of the whole grid.
        value: The kind that counts as a site.
        window: Cells (i0, i1, j0, j1) to write, upper ends excluded; sites outside it count.
        cutoff: Offsets longer than this, in cells, become `NO_SITE`.
        site: (X, Y, 2) int16, written inside the window.
    """
    i0, i1, j0, j1 = window
    rows = min(kind.shape[0], i1 + cutoff) - max(0, i0 - cutoff)
    along = np.empty((rows, j1 - j0), dtype=np.int16)
    _update_sites_kernel(kind, value, i0, i1, j0, j1, cutoff, along, site)


@njit(cache=True, nogil=True)
def _update_sites_kernel(kind, value, i0, i1, j0, j1, cutoff, along, site):
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
                along[i - a0, j - j0] = d if d >= -cutoff else NO_SITE
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
            best, bi, bj = cutoff * cutoff + 1, NO_SITE, NO_SITE
            for step in range(2 * cutoff + 1):
                # 0, 1, -1, 2, -2, …: nearest columns first, so that the search can end early.
                di = (step + 1) // 2 if step % 2 == 1 else -(step // 2)
                if di * di >= best:
                    break
                c = i + di
                if c < a0 or c >= a1:
                    continue
                dj = along[c - a0, j - j0]
                if dj == NO_SITE:
                    continue
                d2 = di * di + dj * dj
                if d2 < best:
                    best, bi, bj = d2, di, dj
            site[i, j, 0] = bi
            site[i, j, 1] = bj


def site_cells(offsets: NDArray[np.int16]) -> Float64Array:
    """Return (…) cells to the nearest site from offsets (…, 2); very far where none is known."""
    return np.hypot(offsets[..., 0].astype(np.float64), offsets[..., 1].astype(np.float64))


@njit(cache=True, nogil=True)
def clearance_at(grid: FloorGrid, x: float, y: float) -> float:
    """Return the distance from a point to the centre of the nearest obstacle cell.

    The nearest sites of the four cells round the point are measured from the point itself, so the
    answer is exact below a cell. Metres; at most the cut-off; 0 outside the grid.
    """
    fx = x / grid.voxel_size - grid.origin[0] - 0.5
    fy = y / grid.voxel_size - grid.origin[1] - 0.5
    i, j = math.floor(fx), math.floor(fy)
    if i < 0 or j < 0 or i + 1 >= grid.kind.shape[0] or j + 1 >= grid.kind.shape[1]:
        return 0.0
    best = float(grid.cutoff) * grid.cutoff
    for a in range(i, i + 2):
        for b in range(j, j + 2):
            if grid.obstacle[a, b, 0] == NO_SITE:
                continue
            dx = a + grid.obstacle[a, b, 0] - fx
            dy = b + grid.obstacle[a, b, 1] - fy
            best = min(best, dx * dx + dy * dy)
    return math.sqrt(best) * grid.voxel_size


@njit(cache=True, nogil=True)
def seen_at(grid: FloorGrid, x: float, y: float, radius: float) -> bool:
    """Tell whether no unseen cell lies within `radius` metres of the cell that holds a point."""
    i = math.floor(x / grid.voxel_size) - grid.origin[0]
    j = math.floor(y / grid.voxel_size) - grid.origin[1]
    if i < 0 or j < 0 or i >= grid.kind.shape[0] or j >= grid.kind.shape[1]:
        return False
    di, dj = grid.unseen[i, j, 0], grid.unseen[i, j, 1]
    if di == NO_SITE:
        return True
    reach = radius / grid.voxel_size
    return di * di + dj * dj >= reach * reach


@njit(cache=True, nogil=True)
def room_facing(grid: FloorGrid, limits: BodyLimits, x: float, y: float, yaw: float) -> float:
    """Return the room of a body that stands at a point with a heading.

    Returns:
        Metres, as the distance to an obstacle from the centre of a round body of
        `limits.radius` that has as much room beside it.
    """
    if limits.discs.shape[0] == 0:
        return clearance_at(grid, x, y)
    c, s = math.cos(yaw), math.sin(yaw)
    least = math.inf
    for disc in limits.discs:
        room = clearance_at(grid, x + c * disc[0] - s * disc[1], y + s * disc[0] + c * disc[1])
        least = min(least, room - disc[2])
    return least + limits.radius


@njit(cache=True, nogil=True)
def seen_facing(grid: FloorGrid, limits: BodyLimits, x: float, y: float, yaw: float) -> bool:
    """Tell whether no unseen floor lies under a body at a point with a heading."""
    if limits.discs.shape[0] == 0:
        return seen_at(grid, x, y, limits.unseen_radius)
    c, s = math.cos(yaw), math.sin(yaw)
    for disc in limits.discs:
        px, py = x + c * disc[0] - s * disc[1], y + s * disc[0] + c * disc[1]
        if not seen_at(grid, px, py, disc[3]):
            return False
    return True


@njit(cache=True, nogil=True)
def can_turn(
    grid: FloorGrid,
    limits: BodyLimits,
    x: float,
    y: float,
    start: float,
    end: float,
    margin: float,
    leave_from: float,
) -> bool:
    """Tell whether the body can turn on the spot.

    Where it stands now the floor that it turns over must have been seen; elsewhere it will have
    been, by the time that the robot is there.

    Args:
        grid: The floor.
        limits: The body.
        x: Where it stands, metres; likewise y.
        y: See x.
        start: Heading at first, radians.
        end: Heading in the end; it turns the shorter way.
        margin: Room to leave beside the body, metres.
        leave_from: See `straight_move`.
    """
    needed = limits.radius + margin
    here = leave_from < 1e6
    if limits.discs.shape[0] == 0 or (
        clearance_at(grid, x, y) >= needed
        and (not here or seen_at(grid, x, y, limits.unseen_radius))
    ):
        return True
    turn = (end - start + math.pi) % (2.0 * math.pi) - math.pi
    count = max(1, math.ceil(abs(turn) / _TURN_STEP_RAD))
    for n in range(1, count + 1):
        yaw = start + n / count * turn
        if room_facing(grid, limits, x, y, yaw) < min(needed, leave_from - 0.01):
            return False
        if here and not seen_facing(grid, limits, x, y, yaw):
            return False
    return True


def can_stand(grid: FloorGrid, limits: BodyLimits, point: Float64Array, margin: float) -> bool:
    """Tell whether the body fits at a (2,) point and can turn, with `margin` metres to spare.

    Of a long one that means that nothing is known to be in the way: of the floor that it turns over
    only the middle must have been seen.
    """
    return can_stand_at(grid, limits, float(point[0]), float(point[1]), margin)


@njit(cache=True, nogil=True)
def can_stand_at(grid: FloorGrid, limits: BodyLimits, x: float, y: float, margin: float) -> bool:
    """Tell what `can_stand` does."""
    return clearance_at(grid, x, y) >= limits.radius + margin and seen_at(
        grid, x, y, passing_unseen_radius(limits)
    )


def move_between(
    grid: FloorGrid,
    limits: BodyLimits,
    start: Float64Array,
    end: Float64Array,
    margin: float,
    leave_from: float = math.inf,
) -> tuple[bool, float, float]:
    """Check and measure a straight move between two (2,) points; see `straight_move`."""
    return straight_move(
        grid,
        limits,
        float(start[0]),
        float(start[1]),
        float(end[0]),
        float(end[1]),
        margin,
        leave_from,
    )


@njit(cache=True, nogil=True)
def straight_move(
    grid: FloorGrid,
    limits: BodyLimits,
    x0: float,
    y0: float,
    x1: float,
    y1: float,
    margin: float,
    leave_from: float,
) -> tuple[bool, float, float]:
    """Check a straight move and measure it; turns at its ends are for `can_turn`.

    Args:
        grid: The floor.
        limits: The body.
        x0: Start, metres; likewise y0, x1, y1.
        y0: See x0.
        x1: See x0.
        y1: See x0.
        margin: Room to leave beside the body, metres.
        leave_from: Clearance at the start when the robot stands there now: a robot that stands
            too close to something may leave if it gets farther away. Infinite elsewhere.

    Returns:
        Whether it is free; its travel time in seconds; its integral of one over the room beside
        the body.
    """
    length = math.hypot(x1 - x0, y1 - y0)
    count = max(1, math.ceil(length / (0.5 * grid.voxel_size)))
    needed = limits.radius + margin
    heading = math.atan2(y1 - y0, x1 - x0)
    time, crowding = 0.0, 0.0
    for n in range(count + 1):
        t = n / count
        x, y = x0 + t * (x1 - x0), y0 + t * (y1 - y0)
        room = room_facing(grid, limits, x, y, heading)
        # 1 cm of grace: rounding must not pin a robot that stands exactly at the limit.
        if room < min(needed, leave_from - 0.01 + 0.5 * t * length):
            return False, 0.0, 0.0
        if not seen_facing(grid, limits, x, y, heading) and (
            leave_from > 1e6 or t * length > 0.5 * limits.radius
        ):
            return False, 0.0, 0.0
        weight = (0.5 if n in (0, count) else 1.0) * length / count
        beside = room - limits.radius
        time += weight / speed_at(limits, beside)
        crowding += weight / max(beside, 0.5 * grid.voxel_size)
    return True, time, crowding

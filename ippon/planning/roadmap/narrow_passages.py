"""Straight edges for a long body through passages that are too narrow for it to turn in.

Viewpoints lie where the body can turn. Two such regions may be connected by a door that the body
passes only along its axis, and random samples rarely line up with that axis. Therefore pairs of
points are searched on either side of it, as in the bridge test for narrow passages (Hsu et al.
2003), with free space in place of obstacles.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from ippon.compiling import njit
from ippon.geometry import Float64Array
from ippon.planning.terrain.body_limits import BodyLimits
from ippon.planning.terrain.floor_grid import FloorGrid, cell_centres, offset_distance_cells
from ippon.planning.terrain.motion_check import can_stand_at, straight_move
from ippon.planning.terrain.reachability import STANDABLE

_label: Callable[..., Any] = ndimage.label
_distance: Callable[..., Any] = ndimage.distance_transform_edt
"""Untyped: scipy has no annotations for what these functions return."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NarrowPassageConfig:
    """The search for straight passages of a long body."""

    headings: int = 24
    """Directions tried over half a turn; more finds narrower passages and takes longer."""
    max_length_m: float = 1.8
    """Longest distance from the narrow place to where the body can turn, on either side; more finds
    deeper passages."""
    max_places: int = 12
    """Narrow places checked per search; more takes longer."""
    place_spacing_m: float = 0.4
    """Least distance between these places; more checks fewer of them."""
    interval_steps: int = 5
    """Steps between two searches; more takes less time and finds a passage later."""
    patience_steps: int = 20
    """Steps after which a search is made although the deadline has passed; more saves time."""
    joined_m: float = 0.45
    """A passage is connected already if an edge joins nodes within this distance of its two ends;
    more adds fewer edges."""

    def __post_init__(self) -> None:
        """Reject a search that finds nothing."""
        if min(self.headings, self.max_places, self.interval_steps) < 1 or self.max_length_m <= 0.0:
            raise ValueError(
                "headings, max_places and interval_steps must be at least 1 and max_length_m above "
                f"0; got {self.headings}, {self.max_places}, {self.interval_steps}, "
                f"{self.max_length_m}"
            )
        if self.patience_steps < self.interval_steps:
            raise ValueError(
                "patience_steps must be at least interval_steps; got "
                f"{self.patience_steps} and {self.interval_steps}"
            )


def find_narrow_passages(
    config: NarrowPassageConfig,
    grid: FloorGrid,
    limits: BodyLimits,
    reachable: NDArray[np.uint8],
    margin_m: float,
) -> list[Float64Array]:
    """Find straight passages between regions in which the body can turn.

    Args:
        config: Number and length of the passages.
        grid: The floor.
        limits: The body.
        reachable: (X, Y) from `reachable_cells`.
        margin_m: Free space beside the body that a move must leave.

    Returns:
        (2, 2) both ends of each passage, metres; none for a round body.
    """
    if not len(limits.discs):
        return []
    room = offset_distance_cells(grid.obstacle)
    may_turn = (reachable > 0) & (room >= (limits.radius + margin_m) / grid.voxel_size)
    turns = (reachable == STANDABLE) | _ends_unseen(may_turn, reachable)
    regions, count = _label(turns)
    if count < 2:
        return []
    _, nearest = _distance(regions == 0, return_indices=True)
    owner = np.where(reachable > 0, regions[tuple(nearest)], 0)
    cells = _spread(config, np.argwhere(_borders(owner) & ~turns), room, grid)
    narrow = cell_centres(grid, cells).tolist()
    passages = [straight_passage(config, grid, limits, x, y, margin_m) for x, y in narrow]
    return [passage for passage in passages if passage is not None]


def straight_passage(
    config: NarrowPassageConfig,
    grid: FloorGrid,
    limits: BodyLimits,
    x: float,
    y: float,
    margin_m: float,
) -> Float64Array | None:
    """Find the straight passage with the most clearance near a point.

    The body can turn at both ends.

    Args:
        config: Directions and longest passage.
        grid: The floor.
        limits: The body.
        x: World x of the point, metres; likewise y.
        y: See x.
        margin_m: Free space beside the body that a move must leave.

    Returns:
        (2, 2) both ends, metres; None if there is no passage.
    """
    ends = np.zeros((2, 2))
    found = _passage_kernel(
        grid, limits, x, y, margin_m, config.headings, config.max_length_m, ends
    )
    return ends if found else None


def _ends_unseen(may_turn: NDArray[np.bool_], reachable: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """Return (X, Y) cells where no known obstacle prevents turning, in regions without a viewpoint.

    The floor beyond a deep passage is seen well only from its end; a robot that turns out to be
    unable to turn there backs out.
    """
    parts, count = _label(may_turn)
    known = np.zeros(count + 1, dtype=np.bool_)
    known[parts[reachable == STANDABLE]] = True
    return may_turn & ~known[parts]


def _borders(owner: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Return (X, Y) cells that touch another region; 0 in `owner` is no region."""
    border = np.zeros(owner.shape, dtype=np.bool_)
    for low, high in (
        ((slice(0, -1), slice(None)), (slice(1, None), slice(None))),
        ((slice(None), slice(0, -1)), (slice(None), slice(1, None))),
    ):
        border[low] |= (owner[low] != owner[high]) & (owner[low] > 0) & (owner[high] > 0)
    return border


def _spread(
    config: NarrowPassageConfig, cells: NDArray[np.int64], worth: Float64Array, grid: FloorGrid
) -> NDArray[np.int64]:
    """Return the first of (M, 2) cells, highest worth first, without those close to others.

    Args:
        config: Number and least distance.
        cells: Their indices.
        worth: (X, Y) of every cell of the grid.
        grid: The floor.
    """
    kept: list[NDArray[np.int64]] = []
    apart = config.place_spacing_m / grid.voxel_size
    for cell in cells[np.argsort(-worth[cells[:, 0], cells[:, 1]], kind="stable")]:
        if all(math.hypot(*(cell - other)) >= apart for other in kept):
            kept.append(cell)
            if len(kept) == config.max_places:
                break
    return np.array(kept, dtype=np.int64).reshape(-1, 2)


@njit(cache=True, nogil=True)
def _turning_place_kernel(grid, limits, x, y, c, s, margin, longest):
    """Return the distance to the first place in a direction where the body can turn; -1 if none."""
    step = 0.5 * grid.voxel_size
    for n in range(1, int(longest / step) + 1):
        if can_stand_at(grid, limits, x + n * step * c, y + n * step * s, margin):
            return n * step
    return -1.0


@njit(cache=True, nogil=True)
def _passage_kernel(grid, limits, x, y, margin, headings, longest, ends):
    """Write the ends of the passage with the most clearance; return whether there is one."""
    best, found = math.inf, False
    v = grid.voxel_size
    for h in range(headings):
        heading = h * math.pi / headings
        c, s = math.cos(heading), math.sin(heading)
        for aside in range(-2, 3):
            # The narrow place is known to one cell; its axis may pass between cell centres.
            px, py = x - 0.5 * aside * v * s, y + 0.5 * aside * v * c
            ahead = _turning_place_kernel(grid, limits, px, py, c, s, margin, longest)
            if ahead < 0.0:
                continue
            behind = _turning_place_kernel(grid, limits, px, py, -c, -s, margin, longest)
            if behind < 0.0:
                continue
            ax, ay = px - behind * c, py - behind * s
            bx, by = px + ahead * c, py + ahead * s
            free, _, crowding = straight_move(grid, limits, ax, ay, bx, by, margin, math.inf)
            if free and crowding < best:
                best, found = crowding, True
                ends[0, 0], ends[0, 1], ends[1, 0], ends[1, 1] = ax, ay, bx, by
    return found

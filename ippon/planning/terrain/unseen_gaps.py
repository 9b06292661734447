"""Whether a strip of floor that was not looked at is all that keeps the robot from a room.

From a doorway the camera often shows the floor of a room, but not the floor at the robot's feet.
No viewpoint can be reached over floor that was never seen, so that the room promises nothing, and
the robot would leave although a look down is all that it takes.
"""

import math
from collections.abc import Callable
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from ippon.planning.deadline import Deadline
from ippon.planning.terrain.body_limits import BodyLimits, inscribed_radius, inscribed_unseen_radius
from ippon.planning.terrain.floor_grid import OBSTACLE, OPEN, UNSEEN, FloorGrid
from ippon.planning.terrain.traversability import Traversability

GAP_M: Final = 0.8
"""Strips of unseen floor up to so wide, between floor that was seen, are expected to be floor."""
LEAST_BEHIND_M2: Final = 1.0
"""Less floor than that beyond is not worth a look."""
_WITHIN_M: Final = 1.6
"""Farther away than this a look down shows little of the floor."""
_STEPS: Final = 5
"""It is looked for in every such step."""
_PATIENCE_STEPS: Final = 10
"""After so many it is looked for however late it is."""
_WINDOW_M: Final = 5.0
_NEAREST_M: Final = 0.3

_closing: Callable[..., Any] = ndimage.binary_closing
_distance: Callable[..., Any] = ndimage.distance_transform_edt
_label: Callable[..., Any] = ndimage.label
"""Untyped on purpose: scipy does not say what its functions return."""


class UnseenGapDetector:
    """Looks for such a strip now and then, and says so while it stays: most close by driving."""

    def __init__(self) -> None:
        self._since = 0
        self._gap: tuple[float, float] | None = None

    def step(
        self,
        floor: Traversability,
        reachable: NDArray[np.uint8],
        xy: tuple[float, float],
        deadline: Deadline,
    ) -> tuple[float, float] | None:
        """Return world x and y of a strip that was there the last time, too; None for none.

        Args:
            floor: The floor and the body.
            reachable: (X, Y) from `reachable_cells`.
            xy: Where the robot stands, metres.
            deadline: Once it has passed this waits for another step, a few times.
        """
        self._since += 1
        if self._since < _STEPS:
            return None
        if self._since < _PATIENCE_STEPS and deadline.passed():
            return None
        self._since = 0
        before = self._gap
        self._gap = find_unseen_gap(
            floor.grid, floor.limits, floor.margin_m, reachable, xy, _WITHIN_M
        )
        if before is None or self._gap is None or math.dist(before, self._gap) > GAP_M:
            return None
        return self._gap


def find_unseen_gap(
    grid: FloorGrid,
    limits: BodyLimits,
    margin_m: float,
    reachable: NDArray[np.uint8],
    xy: tuple[float, float],
    within_m: float,
) -> tuple[float, float] | None:
    """Find unseen floor near the robot that a room lies behind which nothing else leads to.

    Args:
        grid: The floor.
        limits: Size of the body.
        margin_m: Room beside the body that a move must leave.
        reachable: (X, Y) above 0 where the robot can get to, from `reachable_cells`.
        xy: Where it stands, metres.
        within_m: How far from there the floor may be to be looked at.

    Returns:
        World x and y of the nearest such floor in sight, metres; None where there is none.
    """
    v = grid.voxel_size
    here = np.floor(np.array(xy) / v).astype(np.int64) - grid.origin
    reach = math.ceil(_WINDOW_M / v)
    low = np.maximum(0, here - reach)
    window = tuple(slice(int(a), int(b) + reach + 1) for a, b in zip(low, here, strict=True))
    kind, reached = grid.kind[window], reachable[window] > 0
    seen = kind == OPEN
    if not reached.any() or not (seen & ~reached).any():
        return None
    bridge = _closed(seen, max(1, round(0.5 * GAP_M / v))) & (kind == UNSEEN)
    if not bridge.any():
        return None
    need_m = inscribed_radius(limits) + margin_m
    passable = (seen | bridge) & (_distance(kind != OBSTACLE) * v >= need_m)
    passable &= _distance((kind != UNSEEN) | bridge) * v >= inscribed_unseen_radius(limits)
    parts, _ = _label(passable | reached)
    mine = np.isin(parts, np.unique(parts[reached]))
    beyond = _large(mine & seen & ~reached, math.ceil(LEAST_BEHIND_M2 / v**2))
    if not beyond.any():
        return None
    return _nearest(grid, low, bridge & mine & _beside(beyond, GAP_M / v), here, within_m)


def _closed(cells: NDArray[np.bool_], radius: int) -> NDArray[np.bool_]:
    """Fill gaps of up to two radii between cells."""
    around = np.arange(-radius, radius + 1)
    disk = np.hypot(around[:, None], around[None]) <= radius
    return _closing(np.pad(cells, radius), structure=disk)[radius:-radius, radius:-radius]


def _large(cells: NDArray[np.bool_], least: int) -> NDArray[np.bool_]:
    """Keep what hangs together in so many cells at least."""
    parts, _ = _label(cells)
    return cells & (np.bincount(parts.ravel())[parts] >= least)


def _beside(cells: NDArray[np.bool_], radius: float) -> NDArray[np.bool_]:
    return _distance(~cells) <= radius


def _nearest(
    grid: FloorGrid,
    low: NDArray[np.int64],
    cells: NDArray[np.bool_],
    here: NDArray[np.int64],
    within_m: float,
) -> tuple[float, float] | None:
    """Return the nearest cell, no obstacle before it; cells count from `low`."""
    found = np.argwhere(cells) + low
    away = np.linalg.norm(found - here, axis=1) * grid.voxel_size
    for n in np.argsort(away, kind="stable"):
        if away[n] > within_m:
            break
        if away[n] >= _NEAREST_M and _in_sight(grid, here, found[n]):
            x, y = (found[n] + grid.origin + 0.5) * grid.voxel_size
            return float(x), float(y)
    return None


def _in_sight(grid: FloorGrid, start: NDArray[np.int64], end: NDArray[np.int64]) -> bool:
    steps = 2 * int(np.abs(end - start).max()) + 1
    i, j = np.rint(np.linspace(start, end, steps)).astype(np.int64).T
    return bool((grid.kind[i, j] != OBSTACLE).all())

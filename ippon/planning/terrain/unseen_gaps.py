"""Narrow strips of unseen floor that separate the robot from floor that it has seen.

From a doorway the camera often sees the floor of a room, but not the floor at the robot's feet. No
viewpoint beyond unseen floor is reachable, so the room has no gain and the robot would leave,
although tilting the camera down would close the gap.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from ippon.planning.deadline import Deadline
from ippon.planning.terrain.body_limits import BodyLimits, inscribed_radius, inscribed_unseen_radius
from ippon.planning.terrain.floor_grid import OBSTACLE, OPEN, UNSEEN, FloorGrid
from ippon.planning.terrain.traversability import Traversability

_WINDOW_M: Final = 5.0
"""Half the edge of the square of floor around the robot that is searched."""
_NEAREST_M: Final = 0.3
"""Floor closer to the robot than this is under its body."""

_closing: Callable[..., Any] = ndimage.binary_closing
_distance: Callable[..., Any] = ndimage.distance_transform_edt
_label: Callable[..., Any] = ndimage.label
"""Untyped: scipy has no annotations for what these functions return."""


@dataclass(frozen=True, slots=True, kw_only=True)
class UnseenGapConfig:
    """Which strips of unseen floor are worth a look, and how often they are searched for."""

    max_gap_m: float = 0.8
    """Widest strip of unseen floor between seen floor that is expected to be floor; more looks at
    more strips, and more of them turn out to be steps or obstacles."""
    min_floor_beyond_m2: float = 1.0
    """Least seen but unreachable floor beyond the strip; more ignores larger rooms."""
    max_distance_m: float = 1.6
    """Farthest strip from the robot; more looks from places that show less of the floor."""
    interval_steps: int = 5
    """Steps between two searches; more works less and notices a gap later."""
    patience_steps: int = 10
    """Steps after which the search runs although the deadline has passed; more saves time."""

    def __post_init__(self) -> None:
        """Reject intervals that contradict each other, and empty gaps."""
        if not 1 <= self.interval_steps <= self.patience_steps:
            raise ValueError(
                "interval_steps must lie in 1 to patience_steps; got "
                f"{self.interval_steps} and {self.patience_steps}"
            )
        if self.max_gap_m <= 0.0:
            raise ValueError(f"max_gap_m must be above 0; got {self.max_gap_m}")


class UnseenGapDetector:
    """Searches for a gap every few steps and reports one that persists: most close by driving."""

    def __init__(self, config: UnseenGapConfig) -> None:
        self._config = config
        self._since = 0
        self._gap: tuple[float, float] | None = None

    def step(
        self,
        floor: Traversability,
        reachable: NDArray[np.uint8],
        xy: tuple[float, float],
        deadline: Deadline,
    ) -> tuple[float, float] | None:
        """Return world x and y, metres, of a gap found in the last two searches; None for none.

        Args:
            floor: The floor and the body.
            reachable: (X, Y) from `reachable_cells`.
            xy: Position of the robot, metres.
            deadline: Once it has passed, the search waits up to `patience_steps`.
        """
        config = self._config
        self._since += 1
        if self._since < config.interval_steps:
            return None
        if self._since < config.patience_steps and deadline.passed():
            return None
        self._since = 0
        before = self._gap
        self._gap = find_unseen_gap(config, floor.grid, floor.limits, floor.margin_m, reachable, xy)
        if before is None or self._gap is None or math.dist(before, self._gap) > config.max_gap_m:
            return None
        return self._gap


def find_unseen_gap(
    config: UnseenGapConfig,
    grid: FloorGrid,
    limits: BodyLimits,
    margin_m: float,
    reachable: NDArray[np.uint8],
    xy: tuple[float, float],
) -> tuple[float, float] | None:
    """Find unseen floor near the robot that is the only connection to seen floor beyond it.

    Args:
        config: Size and distance of the gap.
        grid: The floor.
        limits: Size of the body.
        margin_m: Free space beside the body that a move must leave.
        reachable: (X, Y) above 0 where the robot can get to, from `reachable_cells`.
        xy: Position of the robot, metres.

    Returns:
        World x and y of the nearest cell of such a gap in sight, metres; None if there is none.
    """
    v, gap_m = grid.voxel_size, config.max_gap_m
    here = np.floor(np.array(xy) / v).astype(np.int64) - grid.origin
    reach = math.ceil(_WINDOW_M / v)
    low = np.maximum(0, here - reach)
    window = tuple(slice(int(a), int(b) + reach + 1) for a, b in zip(low, here, strict=True))
    kind, reached = grid.kind[window], reachable[window] > 0
    seen = kind == OPEN
    if not reached.any() or not (seen & ~reached).any():
        return None
    bridge = _closed(seen, max(1, round(0.5 * gap_m / v))) & (kind == UNSEEN)
    if not bridge.any():
        return None
    need_m = inscribed_radius(limits) + margin_m
    passable = (seen | bridge) & (_distance(kind != OBSTACLE) * v >= need_m)
    passable &= _distance((kind != UNSEEN) | bridge) * v >= inscribed_unseen_radius(limits)
    parts, _ = _label(passable | reached)
    mine = np.isin(parts, np.unique(parts[reached]))
    beyond = _large(mine & seen & ~reached, math.ceil(config.min_floor_beyond_m2 / v**2))
    if not beyond.any():
        return None
    near = bridge & mine & _beside(beyond, gap_m / v)
    return _nearest(grid, low, near, here, config.max_distance_m)


def _closed(cells: NDArray[np.bool_], radius: int) -> NDArray[np.bool_]:
    """Fill gaps of up to two radii between cells (morphological closing)."""
    around = np.arange(-radius, radius + 1)
    disk = np.hypot(around[:, None], around[None]) <= radius
    return _closing(np.pad(cells, radius), structure=disk)[radius:-radius, radius:-radius]


def _large(cells: NDArray[np.bool_], least: int) -> NDArray[np.bool_]:
    """Keep the connected components of at least `least` cells."""
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
    """Return the nearest cell in sight; cell indices count from `low`."""
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

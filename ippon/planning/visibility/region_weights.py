"""Regions of the floor that are preferred or avoided: painted ones, and rooms that were said."""

import copy
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from ippon.geometry import Float64Array
from ippon.planning.visibility.view_config import RegionConfig

RegionKind = Literal["look_here", "not_here"]

_CELL_M: Final = 0.1
"""Edge of a cell of the raster that strokes are painted on."""
LONGEST_PAINTED_M: Final = 300.0
"""Side of the floor that all strokes may span: their raster has 72 MB then."""
_SAMPLES_M: Final = (0.4, 0.8, 1.2, 1.6, 2.0, 2.4, 2.8, 3.2)
"""Distances ahead of a viewpoint at which the floor is sampled, as far as surfaces count."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Stroke:
    """One stroke of the brush."""

    kind: RegionKind
    points: tuple[tuple[float, float], ...]
    """World x and y of the brush's centre, metres."""
    radius_m: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WeightGrid:
    """Weights of the floor in cells; 1 outside."""

    cell_m: float
    origin: NDArray[np.int64]
    """(2,) cell index of `weights[0, 0]`."""
    weights: Float64Array
    """(X, Y) factors on the gain of views of the floor there."""

    def at(self, points: Float64Array) -> Float64Array:
        """Return the weights of (..., 2) points: (...)."""
        cell = np.floor(points / self.cell_m).astype(np.int64) - self.origin
        return _looked_up(self.weights, cell)

    def is_same(self, other: "WeightGrid") -> bool:
        """Return whether another grid has the same cells and weights."""
        same_cells = self.cell_m == other.cell_m and np.array_equal(self.origin, other.origin)
        return same_cells and np.array_equal(self.weights, other.weights)


class RegionWeights:
    """Weight of every place on the floor: 1 where nothing is painted; later strokes cover earlier.

    Args:
        config: The weights.
        strokes: In the order in which they were painted.
        rooms: Weights of rooms, which are multiplied with those; None for none.
    """

    def __init__(
        self, config: RegionConfig, strokes: Iterable[Stroke], rooms: WeightGrid | None = None
    ) -> None:
        self._rooms = rooms
        weight_of: dict[RegionKind, float] = {
            "look_here": config.preferred_weight,
            "not_here": config.avoided_weight,
        }
        strokes = tuple(stroke for stroke in strokes if stroke.points)
        if not strokes:
            self._origin = np.zeros(2)
            self._weights: Float64Array = np.ones((1, 1))
            return
        self._origin, high = painted_corners(strokes)
        size = np.ceil((high - self._origin) / _CELL_M).astype(int) + 1
        self._weights = np.ones(tuple(size))
        for stroke in strokes:
            self._fill(stroke.points, stroke.radius_m, weight_of[stroke.kind])

    def with_rooms(self, rooms: WeightGrid | None) -> "RegionWeights":
        """Return the same painted regions with other weights of rooms."""
        twin = copy.copy(self)
        twin._rooms = rooms  # noqa: SLF001
        return twin

    def at(self, points: Float64Array) -> Float64Array:
        """Return the weights of (..., 2) points: (...)."""
        painted = self._painted_at(points)
        return painted if self._rooms is None else painted * self._rooms.at(points)

    def ahead(
        self, xy: Float64Array, headings: Float64Array, reach_m: NDArray[np.floating]
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return mean weights of the floor that a viewpoint sees in each direction.

        Args:
            xy: (2,) position, metres.
            headings: (A,) radians.
            reach_m: (A,) longest ray in each direction; floor beyond it is hidden.

        Returns:
            (A,) mean weight, and (A,) that of painted regions alone; 1 where neither a painted
            region nor a weighed room is in sight.
        """
        away = np.array(_SAMPLES_M)
        unit = np.stack([np.cos(headings), np.sin(headings)], axis=1)
        points = xy + away[None, :, None] * unit[:, None, :]
        seen = away[None, :] <= np.maximum(reach_m, away[0])[:, None]
        painted = self._painted_at(points)
        painted_mean = _mean_seen(painted, seen)
        if self._rooms is None:
            return painted_mean, painted_mean
        return _mean_seen(painted * self._rooms.at(points), seen), painted_mean

    def _painted_at(self, points: Float64Array) -> Float64Array:
        cell = np.floor((points - self._origin) / _CELL_M).astype(np.int64)
        return _looked_up(self._weights, cell)

    def _fill(self, points: Iterable[tuple[float, float]], radius_m: float, weight: float) -> None:
        shape = self._weights.shape
        x = self._origin[0] + (np.arange(shape[0]) + 0.5) * _CELL_M
        y = self._origin[1] + (np.arange(shape[1]) + 0.5) * _CELL_M
        for px, py in points:
            # Only the cells around the brush: the floor may be large, and strokes have many points.
            at, reach = (np.array((px, py)) - self._origin) / _CELL_M, radius_m / _CELL_M
            u, v = (slice(int(cell - reach), int(cell + reach) + 1) for cell in at)
            near = (x[u, None] - px) ** 2 + (y[None, v] - py) ** 2 <= radius_m**2
            self._weights[u, v][near] = weight


def painted_corners(strokes: Sequence[Stroke]) -> tuple[Float64Array, Float64Array]:
    """Return the corners of the floor that strokes span, with a margin: (2,) each, metres.

    Args:
        strokes: At least one, each with at least one point.
    """
    points = np.concatenate([np.array(stroke.points, dtype=np.float64) for stroke in strokes])
    reach = max(stroke.radius_m for stroke in strokes) + _CELL_M
    return points.min(axis=0) - reach, points.max(axis=0) + reach


def _mean_seen(weights: Float64Array, seen: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Return the (A,) mean of (A, S) weights where seen."""
    return ((weights * seen).sum(axis=1) / seen.sum(axis=1)).astype(np.float32)


def _looked_up(weights: Float64Array, cell: NDArray[np.int64]) -> Float64Array:
    """Return the weights at (..., 2) cells, 1 outside."""
    shape = np.array(weights.shape)
    if not weights.size:
        return np.ones(cell.shape[:-1])
    inside = ((cell >= 0) & (cell < shape)).all(axis=-1)
    cell = np.clip(cell, 0, shape - 1)
    return np.where(inside, weights[cell[..., 0], cell[..., 1]], 1.0)

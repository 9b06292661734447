"""Parts of the floor that the operator wants looked at first, or not at all."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from ippon.geometry import Float64Array

Wish = Literal["look_here", "not_here"]

WEIGHTS: Final[dict[Wish, float]] = {"look_here": 6.0, "not_here": 0.02}
"""What a gain is multiplied by where everything that it looks at is painted. Six times outweighs
the ratio of two neighbouring levels; a fiftieth is less than any threshold, yet keeps an order."""
CELL_M: Final = 0.1
LOOK_M: Final = (0.4, 0.8, 1.2, 1.6, 2.0, 2.4, 2.8, 3.2)
"""How far ahead of a viewpoint the floor counts: as far as surfaces do."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Stroke:
    """One stroke of the brush."""

    wish: Wish
    points: tuple[tuple[float, float], ...]
    """World x and y of the brush, metres."""
    radius_m: float


class RegionWeights:
    """A weight for every place; 1 where nothing is painted, a later stroke over an earlier."""

    def __init__(self, strokes: Iterable[Stroke]) -> None:
        strokes = tuple(stroke for stroke in strokes if stroke.points)
        if not strokes:
            self._origin = np.zeros(2)
            self._weights = np.ones((1, 1))
            return
        points = [np.array(stroke.points, dtype=np.float64) for stroke in strokes]
        reach = max(stroke.radius_m for stroke in strokes) + CELL_M
        low = np.min([p.min(axis=0) for p in points], axis=0) - reach
        high = np.max([p.max(axis=0) for p in points], axis=0) + reach
        size = np.ceil((high - low) / CELL_M).astype(int) + 1
        self._origin = low
        self._weights = np.ones(tuple(size))
        for stroke, at in zip(strokes, points, strict=True):
            self._fill(at, stroke.radius_m, WEIGHTS[stroke.wish])

    def at(self, points: Float64Array) -> Float64Array:
        """Return the weights of (..., 2) points: (...)."""
        cell = np.floor((points - self._origin) / CELL_M).astype(np.int64)
        shape = np.array(self._weights.shape)
        inside = ((cell >= 0) & (cell < shape)).all(axis=-1)
        cell = np.clip(cell, 0, shape - 1)
        return np.where(inside, self._weights[cell[..., 0], cell[..., 1]], 1.0)

    def ahead(
        self, xy: Float64Array, headings: Float64Array, reach_m: NDArray[np.floating]
    ) -> NDArray[np.float32]:
        """Weigh what a viewpoint looks at in each direction.

        Args:
            xy: (2,) where it stands, metres.
            headings: (A,) radians.
            reach_m: (A,) how far it sees there; the floor behind a wall does not count.

        Returns:
            (A,) mean weight of the floor ahead, 1 where nothing painted is in sight.
        """
        away = np.array(LOOK_M)
        unit = np.stack([np.cos(headings), np.sin(headings)], axis=1)
        weights = self.at(xy + away[None, :, None] * unit[:, None, :])
        seen = away[None, :] <= np.maximum(reach_m, away[0])[:, None]
        mean = (weights * seen).sum(axis=1) / seen.sum(axis=1)
        return mean.astype(np.float32)

    def _fill(self, points: Float64Array, radius_m: float, weight: float) -> None:
        shape = self._weights.shape
        x = self._origin[0] + (np.arange(shape[0]) + 0.5) * CELL_M
        y = self._origin[1] + (np.arange(shape[1]) + 0.5) * CELL_M
        for px, py in points:
            near = (x[:, None] - px) ** 2 + (y[None, :] - py) ** 2 <= radius_m**2
            self._weights[near] = weight

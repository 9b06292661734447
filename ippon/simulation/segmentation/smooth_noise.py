"""Temporally correlated noise, independent of which frames were generated before."""

from collections.abc import Callable

import numpy as np

from ippon.geometry import Float64Array


class SmoothNoise:
    """Noise of unit variance, interpolated between draws `period` frames apart."""

    def __init__(
        self,
        shapes: tuple[tuple[int, ...], ...],
        period: int,
        draws: Callable[[int], np.random.Generator],
    ) -> None:
        """Store the parameters; noise is drawn on demand.

        Args:
            shapes: Shapes of the arrays that `at` returns.
            period: Frames from one draw to the next.
            draws: Returns the generator for a draw's number.
        """
        self._shapes = shapes
        self._period = period
        self._draws = draws
        self._drawn: dict[int, tuple[Float64Array, ...]] = {}

    def at(self, frame_index: int) -> tuple[Float64Array, ...]:
        """Return the noise of a frame, one array per shape."""
        draw, step = divmod(frame_index, self._period)
        wanted = (draw, draw + 1)
        self._drawn = {k: self._drawn.get(k) or self._draw(k) for k in wanted}
        first, second = (self._drawn[k] for k in wanted)
        return tuple(mixed(a, b, step / self._period) for a, b in zip(first, second, strict=True))

    def _draw(self, k: int) -> tuple[Float64Array, ...]:
        rng = self._draws(k)
        return tuple(rng.standard_normal(shape) for shape in self._shapes)


def mixed(first: Float64Array, second: Float64Array, part: float | Float64Array) -> Float64Array:
    """Interpolate two independent draws at constant variance."""
    scale = np.sqrt((1.0 - part) ** 2 + np.square(part))
    return ((1.0 - part) * first + part * second) / scale

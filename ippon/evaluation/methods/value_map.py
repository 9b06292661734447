"""The value map of VLFM, computed from heatmaps and levels."""

import math
from collections.abc import Mapping
from typing import Final

import numpy as np

from ippon.frame import Frame
from ippon.geometry import Float64Array

_CELL_M: Final = 0.1
_HALF_EXTENT_M: Final = 60.0
"""Half the side of the map, centred at the start of the search."""


class ValueMap:
    """Value and confidence of each cell of the floor (Yokoyama et al. 2024, Sec. III-B).

    VLFM asks an image-text model how well an image fits "there may be a <goal> ahead". Here the
    image's value is the mean over its heatmap of l(O | C), what the levels say of what is seen,
    with 1 for the object itself: the same evidence as every other method has. Cells in the field of
    view, up to what the depth image shows, take it over with confidence cos² of the angle off the
    optical axis, weighted against what they had.
    """

    def __init__(self, level_of: Mapping[str, float], max_range_m: float = 5.0) -> None:
        """Create an empty map.

        Args:
            level_of: l(O | C) of each common label.
            max_range_m: Range of an image; farther cells are not updated.
        """
        self._level_of = dict(level_of)
        self._max_range_m = max_range_m
        size = round(2.0 * _HALF_EXTENT_M / _CELL_M)
        self._value = np.zeros((size, size), dtype=np.float32)
        self._confidence = np.zeros((size, size), dtype=np.float32)
        self._origin: Float64Array | None = None

    def image_value(self, frame: Frame) -> float:
        """Return the value of an image for the goal, 0 to 1; 0 without a heatmap."""
        heatmap = frame.heatmap
        if heatmap is None:
            return 0.0
        mean = heatmap.probabilities.reshape(-1, heatmap.probabilities.shape[2]).mean(axis=0)
        # A detector's heatmap has only the labels that it can recognise.
        weights = np.zeros(len(mean))
        weights[: len(heatmap.labels)] = [self._level_of.get(x, 0.0) for x in heatmap.labels]
        if heatmap.ooi_channel is not None:
            weights[heatmap.ooi_channel] = 1.0
        return float(mean @ weights) / max(1e-9, float(mean.sum()))

    def observe(self, frame: Frame) -> None:
        """Fuse an image."""
        position = frame.T_world_camera[:3, 3]
        if self._origin is None:
            self._origin = position[:2] - _HALF_EXTENT_M
        window, x, y = self._cells_round(position)
        if window is None:
            return
        # In the camera's frame, on the level of the camera: x to the right, z ahead.
        forward = frame.T_world_camera[:2, 2]
        norm = float(np.linalg.norm(forward))
        if norm < 0.2:
            return  # A camera that looks straight down does not see ahead.
        forward = forward / norm
        ahead = x * forward[0] + y * forward[1]
        right = x * forward[1] - y * forward[0]
        tangent = np.where(ahead > 0.0, right / np.maximum(ahead, 1e-6), np.inf)
        column = np.round(tangent * frame.camera.fx + frame.camera.cx)
        inside = (ahead > 0.0) & (column >= 0) & (column < frame.camera.width)
        farthest = _horizontal_range(frame)
        depth = np.where(inside, farthest[np.where(inside, column, 0).astype(np.int64)], 0.0)
        inside &= ahead <= np.minimum(depth, self._max_range_m)
        half = 0.5 * frame.camera.horizontal_fov
        confidence = np.cos(np.clip(np.arctan(tangent) / half, -1.0, 1.0) * 0.5 * math.pi) ** 2
        self._fuse(window, np.where(inside, confidence, 0.0), self.image_value(frame))

    def value_near(self, x: float, y: float, radius_m: float = 0.5) -> float:
        """Return the median value of the observed cells within a radius of a point, 0 for none."""
        if self._origin is None:
            return 0.0
        i, j = ((np.array([x, y]) - self._origin) / _CELL_M).astype(np.int64)
        r = round(radius_m / _CELL_M)
        a, b = max(0, i - r), max(0, j - r)
        values = self._value[a : max(0, i + r + 1), b : max(0, j + r + 1)]
        seen = self._confidence[a : max(0, i + r + 1), b : max(0, j + r + 1)] > 0.0
        return float(np.median(values[seen])) if seen.any() else 0.0

    def _cells_round(
        self, position: Float64Array
    ) -> tuple[tuple[slice, slice] | None, Float64Array, Float64Array]:
        """Return the window of cells in range and their offsets in metres from a position."""
        assert self._origin is not None, "observe() sets it"
        low = (position[:2] - self._max_range_m - self._origin) / _CELL_M
        high = (position[:2] + self._max_range_m - self._origin) / _CELL_M
        first = np.clip(low.astype(np.int64), 0, self._value.shape)
        last = np.clip(high.astype(np.int64) + 1, 0, self._value.shape)
        if (last <= first).any():
            return None, np.zeros(0), np.zeros(0)
        i, j = np.arange(first[0], last[0]), np.arange(first[1], last[1])
        x = (i + 0.5) * _CELL_M + self._origin[0] - position[0]
        y = (j + 0.5) * _CELL_M + self._origin[1] - position[1]
        window = (slice(int(first[0]), int(last[0])), slice(int(first[1]), int(last[1])))
        return window, x[:, None], y[None, :]

    def _fuse(self, window: tuple[slice, slice], confidence: Float64Array, value: float) -> None:
        old_value, old = self._value[window], self._confidence[window]
        total = confidence + old
        seen = confidence > 1e-6
        safe = np.where(seen, total, 1.0)
        mixed = (confidence * value + old * old_value) / safe
        self._value[window] = np.where(seen, mixed, old_value)
        self._confidence[window] = np.where(seen, (confidence**2 + old**2) / safe, old)


def _horizontal_range(frame: Frame) -> Float64Array:
    """Return (W,) the floor distance that each image column sees; infinite without returns."""
    depth = frame.depth.max(axis=0).astype(np.float64)
    # cos of the tilt: the share of the optical axis that runs along the floor.
    share = math.sqrt(max(1e-6, 1.0 - float(frame.T_world_camera[2, 2]) ** 2))
    return np.where(depth > 0.0, depth * share, np.inf)

"""The surface that a tracked camera has seen: one mean point and normal for each cell of a grid."""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ippon.camera import PinholeCamera
from ippon.geometry import Float64Array, invert_transform
from ippon.tracking.depth_points import SurfacePoints, cells, cells_between

MOST_COUNTED: Final = 50
"""Points that a cell averages; later ones do not count."""
MARGIN: Final = 0.1
"""Share of the image's size that surface beside it is taken, too."""
_RECENT_SHARE: Final = 0.05
"""Recent cells, as a share of the others, from which they are merged: that copies all."""


class _Cells:
    """Means of cells, in the order of their numbers."""

    def __init__(
        self, numbers: NDArray[np.int64], points: Float64Array, normals: Float64Array
    ) -> None:
        self.numbers, self.points, self.normals = numbers, points, normals
        self.counts = np.ones(len(numbers))

    def average(self, seen: "_Cells") -> NDArray[np.bool_]:
        """Average points in; returns (M,) whether each cell is one of these."""
        at = np.searchsorted(self.numbers, seen.numbers)
        known = np.zeros(len(seen.numbers), np.bool_)
        inside = at < len(self.numbers)
        known[inside] = self.numbers[at[inside]] == seen.numbers[inside]
        open_ = known.copy()
        open_[known] = self.counts[at[known]] < MOST_COUNTED
        rows = at[open_]
        weight = 1.0 / (self.counts[rows, None] + 1.0)
        self.points[rows] += weight * (seen.points[open_] - self.points[rows])
        self.normals[rows] += weight * (seen.normals[open_] - self.normals[rows])
        self.counts[rows] += 1.0
        return known

    def insert(self, new: "_Cells", rows: NDArray[np.intp]) -> None:
        """Take in some rows of cells that are none of these."""
        at = np.searchsorted(self.numbers, new.numbers[rows])
        self.numbers = np.insert(self.numbers, at, new.numbers[rows])
        self.points = np.insert(self.points, at, new.points[rows], axis=0)
        self.normals = np.insert(self.normals, at, new.normals[rows], axis=0)
        self.counts = np.insert(self.counts, at, new.counts[rows])

    def in_view(
        self, camera: PinholeCamera, T_world_camera: Float64Array, farthest_m: float, cell_m: float
    ) -> NDArray[np.int64]:
        """Return the rows that face a camera."""
        # Of a large place most is far away.
        near = self.around(T_world_camera[:3, 3], _reach_m(camera, farthest_m), cell_m)
        T_camera_world = invert_transform(T_world_camera)
        seen = SurfacePoints(self.points[near], self.normals[near]).moved(T_camera_world)
        x, y, z = seen.points.T
        ahead = (z > 0.0) & (z < farthest_m)
        ahead &= np.sum(seen.normals * seen.points, axis=1) < 0.0
        wide, high = MARGIN * camera.width, MARGIN * camera.height
        with np.errstate(divide="ignore", invalid="ignore"):
            u, v = camera.fx * x / z + camera.cx, camera.fy * y / z + camera.cy
            ahead &= (u > -wide) & (u < camera.width + wide)
            ahead &= (v > -high) & (v < camera.height + high)
        return near[ahead]

    def around(
        self, centre_world: Float64Array, reach_m: float, cell_m: float
    ) -> NDArray[np.int64]:
        """Return the rows of the points within a distance of a point."""
        x = float(centre_world[0])
        ends = cells_between(x - reach_m, x + reach_m, cell_m)
        begin, end = (int(row) for row in np.searchsorted(self.numbers, ends))
        away = self.points[begin:end] - centre_world
        return begin + np.flatnonzero(np.einsum("ni,ni->n", away, away) <= reach_m**2)


class SurfaceModel:
    """Averages the points of all frames; their pose must be known.

    Args:
        cell_m: Edge length of a cell.
    """

    def __init__(self, cell_m: float) -> None:
        self._cell_m = cell_m
        self._cells, self._recent = _none(), _none()
        """Recent ones apart, as each frame adds some."""

    def __len__(self) -> int:
        return len(self._cells.numbers) + len(self._recent.numbers)

    def add(self, seen: SurfacePoints) -> None:
        """Average the points of a frame in; world frame, at most one of each cell."""
        numbers, first = np.unique(cells(seen.points, self._cell_m), return_index=True)
        frame = _Cells(numbers, seen.points[first], seen.normals[first])
        new = np.flatnonzero(~(self._cells.average(frame) | self._recent.average(frame)))
        if not len(new):
            return
        self._recent.insert(frame, new)
        if len(self._recent.numbers) > _RECENT_SHARE * len(self._cells.numbers):
            self._cells.insert(self._recent, np.arange(len(self._recent.numbers)))
            self._recent = _none()

    def in_view(
        self, camera: PinholeCamera, T_world_camera: Float64Array, farthest_m: float
    ) -> SurfacePoints:
        """Return the surface that faces a camera, in the world frame; hidden surface, too."""
        both = (self._cells, self._recent)
        rows = [one.in_view(camera, T_world_camera, farthest_m, self._cell_m) for one in both]
        found = list(zip(both, rows, strict=True))
        order = np.argsort(np.concatenate([one.numbers[at] for one, at in found]))
        return SurfacePoints(
            np.concatenate([one.points[at] for one, at in found])[order],
            np.concatenate([one.normals[at] for one, at in found])[order],
        )


def _none() -> _Cells:
    return _Cells(np.zeros(0, np.int64), np.zeros((0, 3)), np.zeros((0, 3)))


def _reach_m(camera: PinholeCamera, farthest_m: float) -> float:
    """Return the distance of the farthest corner of what a camera sees, with its margin."""
    wide = max(camera.cx, camera.width - camera.cx) + MARGIN * camera.width
    high = max(camera.cy, camera.height - camera.cy) + MARGIN * camera.height
    return farthest_m * math.hypot(1.0, wide / camera.fx, high / camera.fy)

"""The surface that a tracked camera has seen: one mean point and normal for each cell of a grid."""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ippon.camera import PinholeCamera
from ippon.geometry import Float64Array, invert_transform
from ippon.tracking.depth_points import SurfacePoints, cells, cells_between

MOST_COUNTED: Final = 50
"""Points that a cell averages; later ones weigh as the last of them."""
MARGIN: Final = 0.1
"""Share of the image's size that surface beside it is taken, too."""


class SurfaceModel:
    """Averages the points of all frames; their pose must be known.

    Args:
        cell_m: Edge length of a cell.
    """

    def __init__(self, cell_m: float) -> None:
        self._cell_m = cell_m
        self._cells = np.zeros(0, np.int64)
        self._points = np.zeros((0, 3))
        self._normals = np.zeros((0, 3))
        self._counts = np.zeros(0)

    def __len__(self) -> int:
        return len(self._cells)

    def add(self, seen: SurfacePoints) -> None:
        """Average the points of a frame in; world frame, at most one of each cell."""
        numbers = cells(seen.points, self._cell_m)
        numbers, first = np.unique(numbers, return_index=True)
        points, normals = seen.points[first], seen.normals[first]
        at = np.searchsorted(self._cells, numbers)
        known = np.zeros(len(numbers), np.bool_)
        inside = at < len(self._cells)
        known[inside] = self._cells[at[inside]] == numbers[inside]
        open_ = known.copy()
        open_[known] = self._counts[at[known]] < MOST_COUNTED
        rows = at[open_]
        weight = 1.0 / (self._counts[rows, None] + 1.0)
        self._points[rows] += weight * (points[open_] - self._points[rows])
        self._normals[rows] += weight * (normals[open_] - self._normals[rows])
        self._counts[rows] += 1.0
        new = ~known
        self._cells = np.insert(self._cells, at[new], numbers[new])
        self._points = np.insert(self._points, at[new], points[new], axis=0)
        self._normals = np.insert(self._normals, at[new], normals[new], axis=0)
        self._counts = np.insert(self._counts, at[new], 1.0)

    def in_view(
        self, camera: PinholeCamera, T_world_camera: Float64Array, farthest_m: float
    ) -> SurfacePoints:
        """Return the surface that faces a camera, in the world frame; hidden surface, too."""
        # Of a large place most is far away.
        near = self._around(T_world_camera[:3, 3], _reach_m(camera, farthest_m))
        T_camera_world = invert_transform(T_world_camera)
        seen = SurfacePoints(self._points[near], self._normals[near]).moved(T_camera_world)
        x, y, z = seen.points.T
        ahead = (z > 0.0) & (z < farthest_m)
        ahead &= np.sum(seen.normals * seen.points, axis=1) < 0.0
        wide, high = MARGIN * camera.width, MARGIN * camera.height
        with np.errstate(divide="ignore", invalid="ignore"):
            u, v = camera.fx * x / z + camera.cx, camera.fy * y / z + camera.cy
            ahead &= (u > -wide) & (u < camera.width + wide)
            ahead &= (v > -high) & (v < camera.height + high)
        rows = near[ahead]
        return SurfacePoints(self._points[rows], self._normals[rows])

    def _around(self, centre_world: Float64Array, reach_m: float) -> NDArray[np.int64]:
        """Return the rows of the points within a distance of a point."""
        x = float(centre_world[0])
        ends = cells_between(x - reach_m, x + reach_m, self._cell_m)
        begin, end = (int(row) for row in np.searchsorted(self._cells, ends))
        away = self._points[begin:end] - centre_world
        return begin + np.flatnonzero(np.einsum("ni,ni->n", away, away) <= reach_m**2)


def _reach_m(camera: PinholeCamera, farthest_m: float) -> float:
    """Return the distance of the farthest corner of what a camera sees, with its margin."""
    wide = max(camera.cx, camera.width - camera.cx) + MARGIN * camera.width
    high = max(camera.cy, camera.height - camera.cy) + MARGIN * camera.height
    return farthest_m * math.hypot(1.0, wide / camera.fx, high / camera.fy)

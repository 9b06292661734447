"""Parts of a home's floor that support a robot: no stairs down, no holes."""

import math

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from ippon.compiling import njit
from ippon.geometry import Float64Array
from ippon.simulation.scene import Scene

_CELL_M = 0.05
_BRIDGED_GAP_M = 0.3
"""Gap that is closed between floors of two rooms, under the wall or door between them."""
_STEEPEST_NORMAL_Z = 0.7


class FloorSupport:
    """The floor at one height, as a grid of 5 cm cells."""

    def __init__(self, scene: Scene, floor_z_m: float, max_step_m: float, ring_m: float) -> None:
        """Find the floor.

        Args:
            scene: The home.
            floor_z_m: Height of the base.
            max_step_m: Surfaces within this distance of the floor's height support the base.
            ring_m: Distance of the wheels from the base's centre.
        """
        corners = scene.vertices[scene.faces].astype(np.float64)
        near = (np.abs(corners[..., 2] - floor_z_m) <= max_step_m + 1e-6).all(axis=1)
        flat = corners[near]
        normal = np.cross(flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0])
        level = np.abs(normal[:, 2]) > _STEEPEST_NORMAL_Z * np.linalg.norm(normal, axis=1)
        flat = np.ascontiguousarray(flat[level][..., :2])
        angles = np.arange(8) * (math.pi / 4.0)
        self._feet = ring_m * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        self._feet = np.concatenate([np.zeros((1, 2)), self._feet])
        self._origin, self._carries = _floor_cells(flat)

    def carries(self, x: float, y: float) -> bool:
        """Tell whether the floor supports the centre and the wheels of a base at (x, y) metres."""
        points = self._feet + np.array([x, y])
        cells = np.floor((points - self._origin) / _CELL_M).astype(np.int64)
        inside = ((cells >= 0) & (cells < self._carries.shape)).all(axis=1)
        if not inside.all():
            return False
        return bool(self._carries[cells[:, 0], cells[:, 1]].all())


def _floor_cells(triangles: Float64Array) -> tuple[Float64Array, NDArray[np.bool_]]:
    """Mark the cells of (N, 3, 2) triangles and close narrow gaps between them."""
    if len(triangles) == 0:
        return np.zeros(2), np.zeros((1, 1), dtype=np.bool_)
    margin = 2.0 * _BRIDGED_GAP_M
    origin = triangles.min(axis=(0, 1)) - margin
    extent = triangles.max(axis=(0, 1)) + margin - origin
    nx, ny = (math.ceil(e / _CELL_M) for e in extent)
    cells = np.zeros((nx, ny), dtype=np.bool_)
    _mark_kernel((triangles - origin) / _CELL_M - 0.5, cells)
    reach = 0.5 * _BRIDGED_GAP_M / _CELL_M
    grown = _distance_to(cells) <= reach
    return origin, _distance_to(~grown) > reach


def _distance_to(cells: NDArray[np.bool_]) -> Float64Array:
    distance = ndimage.distance_transform_edt(~cells)
    assert isinstance(distance, np.ndarray)
    return distance


@njit(cache=True, nogil=True)
def _mark_kernel(triangles: Float64Array, cells: NDArray[np.bool_]) -> None:
    """Mark cells whose centre (integer coordinates) lies in a triangle or on its edge."""
    for t in range(triangles.shape[0]):
        ax, ay = triangles[t, 0, 0], triangles[t, 0, 1]
        bx, by = triangles[t, 1, 0], triangles[t, 1, 1]
        cx, cy = triangles[t, 2, 0], triangles[t, 2, 1]
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        sign = 1.0 if area > 0.0 else -1.0
        for i in range(
            max(math.ceil(min(ax, bx, cx)), 0),
            min(math.floor(max(ax, bx, cx)), cells.shape[0] - 1) + 1,
        ):
            for j in range(
                max(math.ceil(min(ay, by, cy)), 0),
                min(math.floor(max(ay, by, cy)), cells.shape[1] - 1) + 1,
            ):
                e0 = ((bx - ax) * (j - ay) - (by - ay) * (i - ax)) * sign
                e1 = ((cx - bx) * (j - by) - (cy - by) * (i - bx)) * sign
                e2 = ((ax - cx) * (j - cy) - (ay - cy) * (i - cx)) * sign
                if e0 >= -1e-9 and e1 >= -1e-9 and e2 >= -1e-9:
                    cells[i, j] = True

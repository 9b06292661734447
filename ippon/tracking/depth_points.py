"""Points of a depth image with their normals."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ippon.camera import PinholeCamera
from ippon.geometry import Float64Array

WIDTH: Final = 320
"""Wider images are read at every second, third … pixel."""
BESIDE: Final = 2
"""Pixels of the reduced image between a point and the neighbours that give its normal."""
EDGE: Final = 0.08
"""Difference of depth to a neighbour, as a share of the depth, above which they are not on one
surface."""


_MIDDLE: Final = 1 << 20
"""Cells on either side of 0: 52 km at 5 cm."""
_ROW_BITS: Final = 42
"""Bits of a cell's number below those of its x."""


@dataclass(frozen=True, slots=True)
class SurfacePoints:
    """Points with normals, in one frame."""

    points: Float64Array
    """(N, 3) metres."""
    normals: Float64Array
    """(N, 3) unit vectors, towards the camera that saw them."""

    def __len__(self) -> int:
        return len(self.points)

    def moved(self, transform: Float64Array) -> "SurfacePoints":
        """Return them in another frame."""
        rotation = transform[:3, :3]
        return SurfacePoints(self.points @ rotation.T + transform[:3, 3], self.normals @ rotation.T)

    def thinned(self, cell_m: float) -> "SurfacePoints":
        """Return one point of each cell of a grid, metres."""
        _, first = np.unique(cells(self.points, cell_m), return_index=True)
        return SurfacePoints(self.points[first], self.normals[first])


def cells(points: Float64Array, cell_m: float) -> NDArray[np.int64]:
    """Return (N,) a number for each point's cell of a grid, the same for points of one cell."""
    index = np.floor(points / cell_m).astype(np.int64) + _MIDDLE
    return (index[:, 0] << _ROW_BITS) | (index[:, 1] << 21) | index[:, 2]


def cells_between(low_m: float, high_m: float, cell_m: float) -> tuple[int, int]:
    """Return the interval of the numbers of cells whose points may have x in an interval."""
    first, last = (math.floor(x / cell_m) + _MIDDLE for x in (low_m, high_m))
    return first << _ROW_BITS, (last + 1) << _ROW_BITS


def points_of(
    depth: NDArray[np.float32], camera: PinholeCamera, nearest_m: float, farthest_m: float
) -> SurfacePoints:
    """Return the points of a depth image, in the camera's frame, that have a normal.

    Args:
        depth: (H, W) metres, 0 for no return.
        camera: Its intrinsics.
        nearest_m: Nearer points are left out.
        farthest_m: And farther ones.
    """
    stride = max(1, round(camera.width / WIDTH))
    u = (np.arange(0, camera.width, stride, dtype=np.float32) - np.float32(camera.cx)) / camera.fx
    v = (np.arange(0, camera.height, stride, dtype=np.float32) - np.float32(camera.cy)) / camera.fy
    z = np.where(np.isfinite(depth), depth, 0.0)[::stride, ::stride].astype(np.float32)
    points = np.stack([u[None, :] * z, v[:, None] * z, z], axis=-1)
    b = BESIDE
    inner = points[b:-b, b:-b]
    right, left = points[b:-b, 2 * b :], points[b:-b, : -2 * b]
    below, above = points[2 * b :, b:-b], points[: -2 * b, b:-b]
    at = inner[..., 2]
    good = (at >= nearest_m) & (at <= farthest_m)
    for beside in (right, left, below, above):
        good &= (beside[..., 2] > 0.0) & (np.abs(beside[..., 2] - at) < EDGE * at)
    normals = np.cross((below - above)[good], (right - left)[good]).astype(np.float64)
    length = np.linalg.norm(normals, axis=1)
    solid = length > 0.0
    normals = normals[solid] / length[solid, None]
    points_camera = inner[good][solid].astype(np.float64)
    # Towards the camera.
    normals *= -np.sign(np.sum(normals * points_camera, axis=1))[:, None]
    return SurfacePoints(points_camera, normals)

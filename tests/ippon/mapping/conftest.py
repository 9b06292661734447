"""An analytic world of boxes, rendered exactly, so that tests know what is where."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import pytest
from numba import njit
from numpy.typing import NDArray

from ippon.camera import PinholeCamera
from ippon.frame import Frame
from ippon.geometry import R_BASE_CAMERA_LEVEL, make_transform, rotation_y, rotation_z
from ippon.mapping.arrays import MapArrays
from ippon.mapping.queries import to_metres
from ippon.observation import Heatmap


@dataclass
class BoxWorld:
    """Axis-aligned boxes, `(x0, y0, z0, x1, y1, z1)` metres; colour and label are per box."""

    boxes: list[tuple[float, float, float, float, float, float]] = field(default_factory=list)

    @classmethod
    def room(cls, width: float = 4.0, depth: float = 4.0, height: float = 2.5) -> "BoxWorld":
        """An empty room on z = 0 with walls 0.1 m thick, its corner at the origin."""
        w, d, h, t = width, depth, height, 0.1
        return cls(
            [
                (-t, -t, -t, w + t, d + t, 0.0),
                (-t, -t, h, w + t, d + t, h + t),
                (-t, -t, 0.0, 0.0, d + t, h),
                (w, -t, 0.0, w + t, d + t, h),
                (0.0, -t, 0.0, w, 0.0, h),
                (0.0, d, 0.0, w, d + t, h),
            ]
        )

    def render(
        self, camera: PinholeCamera, T_world_camera: NDArray[np.float64]
    ) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
        """Return depth along the optical axis (0 for none) and the box seen (-1 for none)."""
        directions = camera.rays() @ T_world_camera[:3, :3].T
        depth = np.zeros(directions.shape[:2], np.float32)
        seen = np.full(directions.shape[:2], -1)
        boxes = np.array(self.boxes, np.float64).reshape(-1, 6)
        _render_kernel(directions, T_world_camera[:3, 3].copy(), boxes, depth, seen)
        return depth, seen

    def frame(
        self,
        T_world_camera: NDArray[np.float64],
        *,
        camera: PinholeCamera | None = None,
        stamp_ns: int = 0,
        heatmap: Callable[[NDArray[np.int64]], Heatmap] | None = None,
        noise: Callable[[NDArray[np.float32]], NDArray[np.float32]] | None = None,
    ) -> Frame:
        """Render a frame; `heatmap` makes one of the image of box numbers."""
        camera = camera or small_camera()
        depth, seen = self.render(camera, T_world_camera)
        colors = np.array([[37 * n % 256, 91 * n % 256, 151 * n % 256] for n in range(100)])
        return Frame(
            stamp_ns=stamp_ns,
            color=colors[seen % 100].astype(np.uint8),
            depth=depth if noise is None else noise(depth),
            camera=camera,
            T_world_camera=T_world_camera,
            T_world_base=make_transform(np.eye(3), (*T_world_camera[:2, 3], 0.0)),
            tilt_rad=0.0,
            heatmap=None if heatmap is None else heatmap(seen),
        )


@njit(cache=True, error_model="numpy")
def _render_kernel(directions, origin, boxes, depth, seen):
    """Write the distance to the nearest box along each ray, and its number."""
    for v in range(depth.shape[0]):
        for u in range(depth.shape[1]):
            nearest = np.inf
            for number in range(len(boxes)):
                near, far = -np.inf, np.inf
                for axis in range(3):
                    a = (boxes[number, axis] - origin[axis]) / directions[v, u, axis]
                    b = (boxes[number, axis + 3] - origin[axis]) / directions[v, u, axis]
                    # A ray along a face has no number on one side: 0 / 0.
                    near = max(near, a if a < b or np.isnan(b) else b)
                    far = min(far, a if a > b or np.isnan(b) else b)
                if near <= far and 1e-6 < near < nearest:
                    nearest = near
                    seen[v, u] = number
            if nearest < np.inf:
                depth[v, u] = nearest


def small_camera() -> PinholeCamera:
    return PinholeCamera.from_horizontal_fov(200, 150, np.radians(79.0))


def look(x: float, y: float, z: float, yaw: float, tilt: float = 0.0) -> NDArray[np.float64]:
    """Return T_world_camera of a camera at (x, y, z), heading `yaw`, tilted up by `tilt`."""
    return make_transform(rotation_z(yaw) @ rotation_y(-tilt) @ R_BASE_CAMERA_LEVEL, (x, y, z))


def dense(arrays: MapArrays, name: str) -> tuple[NDArray[np.generic], NDArray[np.bool_]]:
    """Return a layer over the directory's box, and where the box has blocks.

    `distance` is in metres, cut off at 1.
    """
    if name == "distance":
        layer = to_metres(arrays.squared_distance, arrays.voxel_size, 1.0)
    else:
        layer = getattr(arrays, name)
    by_slab = name in ("ooi", "level")
    shape = np.array(arrays.directory.shape) * 8
    volume = np.zeros(shape, layer.dtype)
    has_block = np.zeros(shape, bool)
    for b in np.argwhere(arrays.directory >= 0):
        at = tuple(slice(8 * k, 8 * k + 8) for k in b)
        row = arrays.directory[tuple(b)]
        volume[at] = layer[arrays.slab[row] if by_slab else row].reshape(8, 8, 8)
        has_block[at] = True
    return volume, has_block


class Tools:
    """What the tests of this folder share."""

    World = BoxWorld
    look = staticmethod(look)
    dense = staticmethod(dense)
    camera = staticmethod(small_camera)

    @staticmethod
    def tour(
        stops: list[tuple[float, float]], height: float = 1.2, yaws: int = 6
    ) -> list[NDArray[np.float64]]:
        """Poses that look around, level, down and up, at each stop of a path."""
        return [
            look(x, y, height, 2 * np.pi * k / yaws, tilt)
            for x, y in stops
            for k in range(yaws)
            for tilt in (-0.6, 0.0, 0.35)
        ]


@pytest.fixture(scope="session")
def tools() -> Tools:
    return Tools()

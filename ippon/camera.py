"""The pinhole camera: axes x right, y down, z forward; images are indexed [v, u]."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True, kw_only=True)
class PinholeCamera:
    """Intrinsics in pixels, without distortion."""

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float

    def __post_init__(self) -> None:
        """Reject invalid intrinsics."""
        if not (1 <= self.width <= 16384 and 1 <= self.height <= 16384):
            raise ValueError(
                f"image size {self.width}x{self.height} is outside 1x1 to 16384x16384 pixels"
            )
        if not all(math.isfinite(f) and f > 0.0 for f in (self.fx, self.fy)):
            raise ValueError(f"focal lengths must be positive and finite; got {self.fx}, {self.fy}")
        if not (
            -self.width <= self.cx <= 2 * self.width and -self.height <= self.cy <= 2 * self.height
        ):
            raise ValueError(
                f"principal point ({self.cx}, {self.cy}) is far outside a "
                f"{self.width}x{self.height} image"
            )

    @classmethod
    def from_horizontal_fov(cls, width: int, height: int, fov: float) -> "PinholeCamera":
        """Return a camera with square pixels and a centred principal point.

        Args:
            width: Image width in pixels.
            height: Image height in pixels.
            fov: Horizontal field of view in radians.
        """
        f = 0.5 * width / math.tan(0.5 * fov)
        return cls(
            width=width, height=height, fx=f, fy=f, cx=0.5 * (width - 1), cy=0.5 * (height - 1)
        )

    @property
    def horizontal_fov(self) -> float:
        """Horizontal field of view in radians."""
        return 2.0 * math.atan(0.5 * self.width / self.fx)

    @property
    def vertical_fov(self) -> float:
        """Vertical field of view in radians."""
        return 2.0 * math.atan(0.5 * self.height / self.fy)

    def scaled_to(self, width: int, height: int) -> "PinholeCamera":
        """Return the camera of the same view at another image size."""
        sx, sy = width / self.width, height / self.height
        return PinholeCamera(
            width=width,
            height=height,
            fx=self.fx * sx,
            fy=self.fy * sy,
            cx=(self.cx + 0.5) * sx - 0.5,
            cy=(self.cy + 0.5) * sy - 0.5,
        )

    def rays(self) -> NDArray[np.float64]:
        """Return (H, W, 3) directions in the camera frame, one per pixel, with z = 1."""
        u = (np.arange(self.width) - self.cx) / self.fx
        v = (np.arange(self.height) - self.cy) / self.fy
        grid = np.empty((self.height, self.width, 3), dtype=np.float64)
        grid[..., 0] = u[None, :]
        grid[..., 1] = v[:, None]
        grid[..., 2] = 1.0
        return grid

    def project(
        self, points_camera: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return (N,) columns and (N,) rows of (N, 3) points with z > 0 in the camera frame."""
        x, y, z = points_camera.T
        return self.fx * x / z + self.cx, self.fy * y / z + self.cy

    def lift(
        self, u: NDArray[Any], v: NDArray[Any], depth: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return (N, 3) points in the camera frame at (N,) columns, rows and depths in metres."""
        return np.stack(
            [(u - self.cx) / self.fx * depth, (v - self.cy) / self.fy * depth, depth], axis=1
        )

    def back_project(self, depth: NDArray[np.float32]) -> NDArray[np.float32]:
        """Lift a depth image to points in the camera frame.

        Args:
            depth: (H, W) float32, metres along the optical axis; 0 marks no return.

        Returns:
            (N, 3) float32, metres, one row per valid pixel in row-major order.

        Raises:
            ValueError: The image is not of this camera's size.
        """
        if depth.shape != (self.height, self.width):
            raise ValueError(
                f"depth is {depth.shape}, the camera takes {(self.height, self.width)} (H, W)"
            )
        v, u = np.nonzero(depth > 0.0)
        z = depth[v, u]
        x = (u - self.cx) / self.fx * z
        y = (v - self.cy) / self.fy * z
        return np.stack([x, y, z], axis=1).astype(np.float32)

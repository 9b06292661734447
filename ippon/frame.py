"""One RGB-D frame: colour, depth, poses and, optionally, a heatmap."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ippon.camera import PinholeCamera
from ippon.errors import FrameRejectedError
from ippon.geometry import Float64Array, is_rigid
from ippon.observation import Heatmap

NANOSECONDS: Final = 1_000_000_000
"""Nanoseconds per second, for `stamp_ns`."""
FLOORS_APART_M: Final = 1.0
"""Difference of height from which a robot stands on another floor."""
UNDERFOOT_M: Final = 0.2
"""Depth below the robot's floor, metres, that counts as this floor, given the errors of depth and
pose. Lower surface may belong to another floor."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Frame:
    """Images and poses of one moment."""

    stamp_ns: int
    color: NDArray[np.uint8]
    """(H, W, 3) RGB."""
    depth: NDArray[np.float32]
    """(H, W) metres along the optical axis, registered to `color`; 0 marks no return."""
    camera: PinholeCamera
    """Intrinsics of `color` and `depth`."""
    T_world_camera: Float64Array
    T_world_base: Float64Array
    tilt_rad: float
    """Camera tilt in `T_world_camera`, positive up."""
    heatmap: Heatmap | None = None
    contact: bool = False
    """Whether the bumper is pressed or an obstacle stopped the base."""

    def __post_init__(self) -> None:
        """Check shapes, types and poses.

        Raises:
            FrameRejectedError: A shape, type or pose is invalid.
        """
        size = (self.camera.height, self.camera.width)
        if self.color.shape != (*size, 3) or self.color.dtype != np.uint8:
            raise FrameRejectedError(
                f"colour is {self.color.shape} {self.color.dtype}; the camera takes "
                f"{(*size, 3)} uint8"
            )
        if self.depth.shape != size or self.depth.dtype != np.float32:
            raise FrameRejectedError(
                f"depth is {self.depth.shape} {self.depth.dtype}; the camera takes {size} float32"
            )
        for name in ("T_world_camera", "T_world_base"):
            if not is_rigid(getattr(self, name)):
                raise FrameRejectedError(f"{name} is not a rigid transform")

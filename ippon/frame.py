"""One observation: colour, depth, pose and, where there is one, a heatmap."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ippon.camera import PinholeCamera
from ippon.errors import FrameRejectedError
from ippon.geometry import Float64Array, is_rigid
from ippon.observation import Heatmap

NANOSECONDS: Final = 1_000_000_000
"""In a second of `stamp_ns`."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Frame:
    """What the robot saw and where it was, at one moment."""

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
    """Camera tilt that `T_world_camera` was taken with, positive up."""
    heatmap: Heatmap | None = None
    contact: bool = False
    """The bumper is pressed, or the base was stopped by something."""

    def __post_init__(self) -> None:
        """Check shapes, types and poses.

        Raises:
            FrameRejectedError: Something that no camera or tracker could have measured.
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

"""One observation: colour, depth, pose and, where there is one, a heatmap."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ippon.camera import PinholeCamera
from ippon.errors import FrameRejectedError
from ippon.geometry import Float64Array, is_rigid

NANOSECONDS: Final = 1_000_000_000
"""In a second of `stamp_ns`."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Heatmap:
    """Label probabilities per pixel, as an open-vocabulary segmentation gives them.

    The last channel is the object of interest when `ooi` is set and is not itself one of the
    common labels; otherwise the channels are just the common labels.
    """

    labels: tuple[str, ...]
    """Common labels, one a channel, in the order of the channels."""
    ooi: str | None
    """Label of the object of interest that the segmentation was asked for."""
    probabilities: NDArray[np.uint8]
    """(h, w, C) uint8 in units of 1/255; (h, w) may be smaller than the image it belongs to."""

    def __post_init__(self) -> None:
        """Check that channels and labels agree."""
        expected = len(self.labels) + (self.ooi is not None and self.ooi not in self.labels)
        p = self.probabilities
        if p.ndim != 3 or p.dtype != np.uint8 or p.shape[2] != expected:
            raise ValueError(
                f"a heatmap of {len(self.labels)} labels and ooi {self.ooi!r} is (h, w, {expected})"
                f" uint8; got {p.shape} {p.dtype}"
            )

    @property
    def ooi_channel(self) -> int | None:
        """Channel of the object of interest, None when the segmentation was not asked for one."""
        if self.ooi is None:
            return None
        return self.labels.index(self.ooi) if self.ooi in self.labels else len(self.labels)


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

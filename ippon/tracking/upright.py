"""Whether a camera's images are upside down, by where their level surface faces."""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ippon.camera import PinholeCamera
from ippon.frame import Frame
from ippon.geometry import Float64Array, views_differ
from ippon.tracking.depth_points import points_of

UPSIDE_DOWN: Final = (
    "the camera's images are upside down, by their depth and poses: networks recognise little in "
    "them, and the floor may count as ceiling; turn the images by 180 degrees at the camera, or "
    "correct its transform"
)
LEAST_VIEWS: Final = 5
"""Views from which it is told."""
TIMES: Final = 4.0
"""Ratio of surface that is level if the images are upside down to such that is level if they are
not."""
LEAST_SHARE: Final = 0.05
"""Share of all surface that must be so."""
_LEVEL_COS: Final = math.cos(math.radians(15.0))
_ROLLED: Final = 0.7
"""Height of the lower edge of an image over its middle, from which the pose itself is upside
down."""
_NEAREST_M: Final = 0.3
_FARTHEST_M: Final = 5.0
_LEAST_POINTS: Final = 300
_APART_M: Final = 0.5
_APART_RAD: Final = math.radians(20.0)


class UprightCheck:
    """Compares what faces up by the poses with what would face up if they were wrong.

    Floors, tables and seats face up. A pose may leave out that the camera is mounted upside down:
    its true up is that of the pose turned about the optical axis. Or the whole world is upside
    down, as where up is taken from the poses of such a camera. Ceilings look like that, but a
    camera that looks ahead or down shows less of them than of the floor.
    """

    def __init__(self) -> None:
        self._level = self._level_if_mounted = self._level_if_turned = 0
        self._surface = self._views = self._rolled_views = 0
        self._last: Float64Array | None = None

    def add(self, frame: Frame) -> None:
        """Count a frame's surface, if it is seen from elsewhere than the last one."""
        self.add_view(frame.depth, frame.camera, frame.T_world_camera)

    def add_view(
        self, depth: NDArray[np.float32], camera: PinholeCamera, T_world_camera: Float64Array
    ) -> None:
        """Count the surface of a depth image, if it is seen from elsewhere than the last one.

        Args:
            depth: (H, W) metres along the optical axis; 0 for no return.
            camera: Its intrinsics.
            T_world_camera: Where it was taken from, by the poses.
        """
        T = T_world_camera
        if self._last is not None and not views_differ(T, self._last, _APART_M, _APART_RAD):
            return
        seen = points_of(depth, camera, _NEAREST_M, _FARTHEST_M)
        if len(seen) < _LEAST_POINTS:
            return
        self._last = T
        up = T[2, :3]
        self._level += _facing(seen.normals, up)
        self._level_if_mounted += _facing(seen.normals, up * (-1.0, -1.0, 1.0))
        self._level_if_turned += _facing(seen.normals, -up)
        self._surface += len(seen)
        self._views += 1
        self._rolled_views += int(T[2, 1] > _ROLLED)

    @property
    def is_upside_down(self) -> bool:
        """Whether enough views agree that the images are upside down."""
        return self._views >= LEAST_VIEWS and self._poses_are_wrong != self._is_rolled

    @property
    def is_world_upside_down(self) -> bool:
        """Whether enough views agree that the images are upright and the poses' world is not."""
        enough = self._views >= LEAST_VIEWS
        turned = self._level_if_turned >= self._level_if_mounted
        return enough and turned and self._poses_are_wrong and self._is_rolled

    @property
    def _poses_are_wrong(self) -> bool:
        most = max(self._level_if_mounted, self._level_if_turned)
        return most > TIMES * self._level and most > LEAST_SHARE * self._surface

    @property
    def _is_rolled(self) -> bool:
        return 2 * self._rolled_views > self._views


def _facing(normals: Float64Array, up: Float64Array) -> int:
    return int(np.count_nonzero(normals @ up > _LEVEL_COS))

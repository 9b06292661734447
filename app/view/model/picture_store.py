"""Camera images by pose, to show images of a voxel."""

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from app.messages.images import CompressedColor
from ippon.camera import PinholeCamera
from ippon.geometry import Float64Array, views_differ

KEPT: Final = 160
"""Number of pictures, about 5 MB."""
MOVED_M: Final = 0.3
TURNED_RAD: Final = math.radians(18.0)
_FAR_NS: Final = 500_000_000
"""An image this far from every pose was stamped by another clock."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StoredPicture:
    """One picture with its camera pose."""

    number: int
    stamp_ns: int
    encoded: bytes
    camera: PinholeCamera
    T_world_camera: Float64Array

    def pixel_of(self, point_world: Float64Array) -> tuple[int, int, float] | None:
        """Return column, row and depth in metres of a point, None if it is out of view."""
        x, y, z = (point_world - self.T_world_camera[:3, 3]) @ self.T_world_camera[:3, :3]
        if z < 0.1:
            return None
        camera = self.camera
        u, v = camera.fx * x / z + camera.cx, camera.fy * y / z + camera.cy
        if not (0 <= u < camera.width and 0 <= v < camera.height):
            return None
        return int(u), int(v), float(z)


class PictureStore:
    """Stores a picture each time the camera has moved."""

    def __init__(self) -> None:
        self._pictures: deque[StoredPicture] = deque(maxlen=KEPT)
        self._next = 0
        self._held: tuple[CompressedColor, PinholeCamera] | None = None

    def hold(self, image: CompressedColor, camera: PinholeCamera | None) -> None:
        """Hold an image until `place`: its pose may arrive after it."""
        self._held = None if camera is None else (image, camera)

    def place(self, poses: Sequence[tuple[int, Float64Array]]) -> None:
        """Store the held image with the pose that is nearest to it in time.

        If all are far from it in time, the camera has a clock of its own: then with the last pose.

        Args:
            poses: Stamp in nanoseconds and T_world_camera of the last poses, in order.
        """
        if self._held is None or not poses:
            return
        (image, camera), self._held = self._held, None
        # Of one stamp the last: the map may have been aligned since.
        nearest = min(reversed(poses), key=lambda pose: abs(pose[0] - image.stamp_ns))
        _, T_world_camera = poses[-1] if abs(nearest[0] - image.stamp_ns) > _FAR_NS else nearest
        self.add(image.stamp_ns, image.encoded, camera, T_world_camera)

    def add(
        self, stamp_ns: int, encoded: bytes, camera: PinholeCamera, T_world_camera: Float64Array
    ) -> None:
        """Store a picture, unless the last one was taken from nearly the same pose."""
        last = self._pictures[-1] if self._pictures else None
        if last and not views_differ(last.T_world_camera, T_world_camera, MOVED_M, TURNED_RAD):
            return
        self._pictures.append(
            StoredPicture(
                number=self._next,
                stamp_ns=stamp_ns,
                encoded=encoded,
                camera=camera,
                T_world_camera=T_world_camera.copy(),
            )
        )
        self._next += 1

    def clear(self) -> None:
        """Remove all pictures."""
        self._pictures.clear()
        self._held = None

    def find(self, number: int) -> StoredPicture | None:
        """Return a picture by its number, None if it was removed."""
        return next((p for p in tuple(self._pictures) if p.number == number), None)

    def showing(
        self, point_world: Float64Array, reach_m: float
    ) -> list[tuple[StoredPicture, int, int, float]]:
        """Return the pictures that may show a point, the closest first, with pixel and depth."""
        found: list[tuple[StoredPicture, int, int, float]] = []
        for picture in tuple(self._pictures):
            pixel = picture.pixel_of(point_world)
            if pixel is not None and pixel[2] <= reach_m:
                found.append((picture, *pixel))
        return sorted(found, key=lambda entry: entry[3])

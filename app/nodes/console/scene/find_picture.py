"""Camera images of a find or a candidate: outlined, cropped around it, and kept."""

from typing import Final

import numpy as np
import simplejpeg
from numpy.typing import NDArray

from app.messages.cdr import MessageError
from app.messages.images import CompressedColor, decompress_color
from app.messages.status import FindReport, Status, goal_of
from app.view.colors import FOUND
from app.view.model.voxel_pictures import VoxelPicture
from ippon.frame import NANOSECONDS

_LINE_PX = 3
_CROP_M = 0.7
"""Half the width of a crop in metres, at the distance of its centre."""
_LEAST_PX = 24
_KEPT: Final = 32
_LATE_S: Final = 3.0
"""An image this much later than a find may be of something else."""


def outlined(encoded: bytes, box_px: tuple[int, int, int, int] | None) -> bytes:
    """Return the camera image as JPEG with a green frame around the object.

    Args:
        encoded: The image as received.
        box_px: (u0, v0, u1, v1) of the object; None if it is not in the image.
    """
    if box_px is None:
        return encoded
    try:
        image = decompress_color(encoded).copy()
    except MessageError:
        return encoded
    _frame(image, box_px)
    return simplejpeg.encode_jpeg(image, quality=88, colorspace="RGB")


def crop(seen: VoxelPicture) -> bytes | None:
    """Return the part of a picture around a voxel as JPEG; None if it cannot be read."""
    try:
        image = decompress_color(seen.picture.encoded)
    except MessageError:
        return None
    height, width = image.shape[:2]
    half = max(int(seen.picture.camera.fx * _CROP_M / seen.depth_m), _LEAST_PX)
    half_u, half_v = min(half, width // 2), min(int(0.75 * half), height // 2)
    u = min(max(seen.u, half_u), width - half_u)
    v = min(max(seen.v, half_v), height - half_v)
    part = image[v - half_v : v + half_v, u - half_u : u + half_u]
    return simplejpeg.encode_jpeg(np.ascontiguousarray(part), quality=80, colorspace="RGB")


def _frame(image: NDArray[np.uint8], box_px: tuple[int, int, int, int]) -> None:
    height, width = image.shape[:2]
    u0, u1 = sorted((min(max(u, 0), width - 1)) for u in (box_px[0], box_px[2]))
    v0, v1 = sorted((min(max(v, 0), height - 1)) for v in (box_px[1], box_px[3]))
    outside = np.ones((height, width), dtype=bool)
    outside[v0 : v1 + 1, u0 : u1 + 1] = False
    image[outside] = image[outside] // 2
    top, left = max(v0 - _LINE_PX, 0), max(u0 - _LINE_PX, 0)
    bottom, right = v1 + _LINE_PX + 1, u1 + _LINE_PX + 1
    image[top:v0, left:right] = FOUND
    image[v1 + 1 : bottom, left:right] = FOUND
    image[top:bottom, left:u0] = FOUND
    image[top:bottom, u1 + 1 : right] = FOUND


class FindPictures:
    """Keeps the picture of each find: of a tour, an earlier find may wait for its verdict."""

    def __init__(self) -> None:
        self._kept: dict[tuple[int, int, tuple[float, float, float]], bytes] = {}

    def picture_of(self, find: FindReport, status: Status, image: CompressedColor) -> bytes | None:
        """Return the picture of the find; None if no image of it has arrived.

        Args:
            find: The find that is shown.
            status: The status that reports it.
            image: The latest image of the camera.
        """
        key = (find.goal_id, find.number, find.position_world)
        if key not in self._kept:
            if _is_late(image, find, status):
                return None
            self._kept[key] = outlined(image.encoded, find.box_px)
            if len(self._kept) > _KEPT:
                del self._kept[next(iter(self._kept))]
        return self._kept[key]


def _is_late(image: CompressedColor, find: FindReport, status: Status) -> bool:
    if find.stamp_ns is not None:
        return abs(image.stamp_ns - find.stamp_ns) > _LATE_S * NANOSECONDS
    # A recording of an earlier version.
    goal = goal_of(status, find.goal_id)
    took_s = None if goal is None else goal.took_s
    return took_s is not None and status.elapsed_s - took_s > _LATE_S

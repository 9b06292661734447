"""Camera images of a find or a candidate: outlined, or cropped around it."""

import numpy as np
import simplejpeg
from numpy.typing import NDArray

from app.messages.cdr import MessageError
from app.messages.images import decompress_color
from app.view.colors import FOUND
from app.view.model.voxel_pictures import VoxelPicture

_LINE_PX = 3
_CROP_M = 0.7
"""Half the width of a crop in metres, at the distance of its centre."""
_LEAST_PX = 24


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

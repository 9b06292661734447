"""Camera pictures made smaller, upright and marked with what the network sees."""

import math
from typing import Final

import numpy as np
import simplejpeg
from numpy.typing import NDArray
from PIL import Image

from app.messages.cdr import MessageError
from app.messages.images import check_size, decompress_color
from app.view.camera.stream_budget import Rung
from app.view.colors import FOUND
from ippon.geometry import Float64Array

_LEVEL: Final = 0.3
"""Horizontal share of the image plane below which a camera looks up or down, and has no roll."""
_FAINT: Final = 0.25
"""Probability from which a pixel is tinted."""
_TINT: Final = 0.4
"""Opacity of the tint at probability 1."""


def quarter_turns(T_world_camera: Float64Array) -> int:
    """Return how many quarter turns counterclockwise make an image of a camera upright.

    0 for a camera that looks straight up or down.
    """
    right, down, _ = T_world_camera[2, :3].tolist()
    if math.hypot(right, down) < _LEVEL:
        return 0
    return round(math.atan2(right, -down) / (0.5 * math.pi)) % 4


def turned(x: float, y: float, turns: int) -> tuple[float, float]:
    """Return where a point of an image, 0 to 1 in x and y, is after quarter turns."""
    for _ in range(turns):
        x, y = y, 1.0 - x
    return x, y


def scaled_picture(encoded: bytes, longest_px: int) -> NDArray[np.uint8]:
    """Decompress JPEG or PNG, at most `longest_px` on its longer side; never enlarged.

    JPEG is decoded at a reduced size, so that a 4K image costs little more than a small one.

    Returns:
        (H, W, 3) RGB; grey images are grey in all channels.

    Raises:
        MessageError: Damaged or too large.
    """
    if encoded.startswith(b"\x89PNG"):
        image = decompress_color(encoded)
    else:
        try:
            height, width = (int(side) for side in simplejpeg.decode_jpeg_header(encoded)[:2])
            check_size(width, height)
            share = min(1.0, longest_px / max(height, width))
            image = simplejpeg.decode_jpeg(
                encoded,
                colorspace="RGB",
                min_height=math.floor(height * share),
                min_width=math.floor(width * share),
            )
        except (ValueError, OSError) as error:
            raise MessageError(f"damaged JPEG of {len(encoded)} bytes: {error}") from error
    height, width = image.shape[:2]
    if max(height, width) <= longest_px:
        return image
    share = longest_px / max(height, width)
    size = (max(1, round(width * share)), max(1, round(height * share)))
    return np.asarray(Image.fromarray(image).resize(size, Image.Resampling.BOX))


def encoded_picture(
    encoded: bytes, rung: Rung, turns: int, heat: NDArray[np.uint8] | None = None
) -> bytes:
    """Return a camera image as JPEG of a rung of the ladder.

    Args:
        encoded: JPEG or PNG.
        rung: Size and quality.
        turns: Quarter turns counterclockwise.
        heat: (h, w) probability in units of 1/255 that is drawn in, of any size; None for none.

    Raises:
        MessageError: The image is damaged.
    """
    image = scaled_picture(encoded, rung.longest_px)
    if heat is not None and heat.size:
        image = _tinted(image, heat)
    image = np.ascontiguousarray(np.rot90(image, turns))
    return simplejpeg.encode_jpeg(image, quality=rung.quality, colorspace="RGB")


def _tinted(image: NDArray[np.uint8], heat: NDArray[np.uint8]) -> NDArray[np.uint8]:
    height, width = image.shape[:2]
    rows = (np.arange(height) * heat.shape[0]) // height
    columns = (np.arange(width) * heat.shape[1]) // width
    spread = heat[rows[:, None], columns[None, :]]
    likely = spread >= round(255 * _FAINT)
    if not likely.any():
        return image
    opacity = (spread[likely].astype(np.uint16) * round(256 * _TINT)) // 255
    color = np.array(FOUND, np.uint16)
    pixels = image[likely].astype(np.uint16)
    out = image.copy()
    out[likely] = (pixels * (256 - opacity)[:, None] + color * opacity[:, None]) >> 8
    out[likely & ~_inside(likely)] = FOUND
    return out


def _inside(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the pixels of a mask whose four neighbours two pixels away are in it, too."""
    padded = np.pad(mask, 2)
    return padded[:-4, 2:-2] & padded[4:, 2:-2] & padded[2:-2, :-4] & padded[2:-2, 4:]

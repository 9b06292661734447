"""Camera images, intrinsics and heatmaps as ROS 2 messages."""

import io
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import simplejpeg
from numpy.typing import NDArray
from PIL import Image as PillowImage
from PIL import UnidentifiedImageError

from app.messages import keys
from app.messages.cdr import MessageError, decode, encode, header, make, stamp_ns_of
from ippon.camera import PinholeCamera

MAX_PIXELS: Final = 4096 * 4096
PAIRED_S: Final = 0.02
"""Stamps of colour and depth that differ by no more belong together."""
GREY_16: Final = frozenset({"I;16", "I;16B", "I"})
"""Pillow's modes for grey PNG of 16 bits."""
_COMPRESSED: Final = "sensor_msgs/msg/CompressedImage"
_IMAGE: Final = "sensor_msgs/msg/Image"
_CHANNELS: Final = {
    "rgb8": (3, [0, 1, 2]), "bgr8": (3, [2, 1, 0]), "rgba8": (4, [0, 1, 2]),
    "bgra8": (4, [2, 1, 0]), "mono8": (1, [0, 0, 0]),
}  # fmt: skip
"""Bytes of a pixel, and which of them are red, green and blue."""
_INFO: Final = "sensor_msgs/msg/CameraInfo"


@dataclass(frozen=True, slots=True, kw_only=True)
class CompressedColor:
    """A compressed colour image."""

    stamp_ns: int
    frame_id: str
    encoded: bytes
    """JPEG or PNG."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StampedCamera:
    """Intrinsics with stamp and coordinate frame."""

    stamp_ns: int
    frame_id: str
    camera: PinholeCamera


def encode_color(
    color: NDArray[np.uint8], stamp_ns: int, frame_id: str, *, quality: int = 85
) -> bytes:
    """Write an (H, W, 3) RGB image as a JPEG CompressedImage."""
    jpeg = simplejpeg.encode_jpeg(np.ascontiguousarray(color), quality=quality, colorspace="RGB")
    return encode(
        _COMPRESSED,
        header=header(stamp_ns, frame_id),
        format="rgb8; jpeg compressed bgr8",
        data=np.frombuffer(jpeg, np.uint8),
    )


def decode_color(payload: bytes) -> CompressedColor:
    """Read a CompressedImage of colour without decompressing it.

    Raises:
        MessageError: Not such a message, or neither JPEG nor PNG.
    """
    message = decode(payload, _COMPRESSED)
    encoded = message.data.tobytes()
    if not encoded.startswith((b"\xff\xd8\xff", b"\x89PNG\r\n\x1a\n")):
        raise MessageError(
            f"a colour image is JPEG or PNG; format {message.format[:40]!r} with "
            f"{len(encoded)} bytes is neither"
        )
    return CompressedColor(
        stamp_ns=stamp_ns_of(message.header), frame_id=message.header.frame_id, encoded=encoded
    )


def decode_color_raw(payload: bytes) -> tuple[NDArray[np.uint8], int, str]:
    """Read an uncompressed colour Image.

    Returns:
        (H, W, 3) RGB, the stamp in nanoseconds and the frame.

    Raises:
        MessageError: Not such a message, another encoding, or sizes that contradict each other.
    """
    message = decode(payload, _IMAGE)
    if message.encoding not in _CHANNELS:
        raise MessageError(
            f"an uncompressed colour image is {', '.join(_CHANNELS)}; got encoding "
            f"{message.encoding[:40]!r}"
        )
    size, rgb = _CHANNELS[message.encoding]
    pixels = image_rows(message, np.dtype((np.void, size))).view(np.uint8)
    color = pixels.reshape(message.height, message.width, size)[:, :, rgb]
    return np.ascontiguousarray(color), stamp_ns_of(message.header), message.header.frame_id


def decompress_color(encoded: bytes) -> NDArray[np.uint8]:
    """Decompress JPEG or PNG to (H, W, 3) RGB.

    Raises:
        MessageError: Damaged, or more than `MAX_PIXELS` pixels.
    """
    if encoded.startswith(b"\x89PNG"):
        return read_png(encoded).astype(np.uint8, copy=False)
    try:
        height, width, _, _ = simplejpeg.decode_jpeg_header(encoded)
        check_size(int(width), int(height))
        return simplejpeg.decode_jpeg(encoded, colorspace="RGB")
    except (ValueError, OSError) as error:
        raise MessageError(f"damaged JPEG of {len(encoded)} bytes: {error}") from error


def encode_camera(camera: PinholeCamera, stamp_ns: int, frame_id: str) -> bytes:
    """Write intrinsics as a CameraInfo without distortion."""
    k = [camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0]
    p = [camera.fx, 0.0, camera.cx, 0.0, 0.0, camera.fy, camera.cy, 0.0, 0.0, 0.0, 1.0, 0.0]
    roi = make(
        "sensor_msgs/msg/RegionOfInterest", x_offset=0, y_offset=0, height=0, width=0,
        do_rectify=False,
    )  # fmt: skip
    return encode(
        _INFO, header=header(stamp_ns, frame_id), height=camera.height, width=camera.width,
        distortion_model="plumb_bob", d=np.zeros(5), k=np.array(k), r=np.eye(3).reshape(-1),
        p=np.array(p), binning_x=0, binning_y=0, roi=roi,
    )  # fmt: skip


def decode_camera(payload: bytes) -> StampedCamera:
    """Read a CameraInfo of a rectified image.

    Raises:
        MessageError: Not such a message, invalid intrinsics, or a distorted image.
    """
    message = decode(payload, _INFO, max_bytes=2**16)
    numbers = [float(x) for x in (*message.k, *message.d)]
    if not all(math.isfinite(x) for x in numbers):
        raise MessageError("camera info holds numbers that are not finite")
    if any(x != 0.0 for x in message.d):
        raise MessageError(
            "the camera image is distorted (camera info has d != 0); publish the rectified image"
        )
    try:
        camera = PinholeCamera(
            width=message.width,
            height=message.height,
            fx=float(message.k[0]),
            fy=float(message.k[4]),
            cx=float(message.k[2]),
            cy=float(message.k[5]),
        )
    except ValueError as error:
        raise MessageError(f"camera info: {error}") from error
    return StampedCamera(
        stamp_ns=stamp_ns_of(message.header),
        frame_id=keys.frame_name(message.header.frame_id),
        camera=camera,
    )


def check_size(width: int, height: int) -> None:
    """Refuse an image without pixels, or with more than `MAX_PIXELS`.

    Raises:
        MessageError: With the size.
    """
    if width < 1 or height < 1 or width * height > MAX_PIXELS:
        raise MessageError(f"an image of {width}x{height} pixels is not accepted")


def image_rows(message: Any, dtype: np.dtype[Any]) -> NDArray[Any]:
    """Return the (H, W) pixels of a sensor_msgs/Image, as a copy without row padding.

    Raises:
        MessageError: Sizes that are inconsistent or not accepted.
    """
    check_size(message.width, message.height)
    row = message.width * dtype.itemsize
    if message.step < row or message.data.size != message.step * message.height:
        raise MessageError(
            f"{message.encoding} {message.width}x{message.height} with rows of {message.step} "
            f"bytes does not come in {message.data.size} bytes"
        )
    rows = message.data.reshape(message.height, message.step)[:, :row]
    return np.ascontiguousarray(rows).view(dtype)


def read_png(
    data: bytes, *, modes: frozenset[str] = frozenset(), expected: str = ""
) -> NDArray[Any]:
    """Decompress a PNG.

    Args:
        data: The file.
        modes: Accepted Pillow modes; without any, the image is converted to RGB.
        expected: Description of accepted images, for the error.

    Raises:
        MessageError: Damaged, too large, or of another mode.
    """
    try:
        with PillowImage.open(io.BytesIO(data), formats=("PNG",)) as image:
            check_size(*image.size)
            if modes and image.mode not in modes:
                raise MessageError(f"{expected}; got mode {image.mode}")
            return np.asarray(image if modes else image.convert("RGB"))
    except (UnidentifiedImageError, OSError, SyntaxError, ValueError, EOFError) as error:
        raise MessageError(f"damaged PNG of {len(data)} bytes: {error}") from error
    except PillowImage.DecompressionBombError as error:
        raise MessageError(f"refused PNG: {error}") from error


COLOR_DECODERS: Final[dict[str, Callable[[bytes], NDArray[np.uint8]]]] = {
    keys.COLOR: lambda payload: decompress_color(decode_color(payload).encoded),
    keys.COLOR_RAW: lambda payload: decode_color_raw(payload)[0],
}
"""Return the (H, W, 3) RGB image of a message, by the key of its topic."""

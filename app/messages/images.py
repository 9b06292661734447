"""Camera images, intrinsics and heatmaps as ROS 2 messages."""

import io
import math
import struct
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
# Header of compressed_depth_image_transport before the PNG: format 0, and two parameters of
# quantisation, which 16UC1 does not use.
_DEPTH_HEADER: Final = struct.pack("<iff", 0, 0.0, 0.0)
_DEPTH_FORMAT: Final = "16UC1; compressedDepth png"


@dataclass(frozen=True, slots=True, kw_only=True)
class CompressedColor:
    """A compressed colour image."""

    stamp_ns: int
    frame_id: str
    encoded: bytes
    """JPEG or PNG."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DepthImage:
    """A depth image."""

    stamp_ns: int
    frame_id: str
    depth: NDArray[np.float32]
    """(H, W) metres, 0 marks no return."""


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


def encode_depth(depth: NDArray[np.float32], stamp_ns: int, frame_id: str) -> bytes:
    """Write (H, W) metres as millimetres in a PNG (compressedDepth).

    Anything beyond 65.5 m or not finite becomes 0, no return.
    """
    out = io.BytesIO()
    PillowImage.fromarray(_to_millimetres(depth)).save(out, "PNG", compress_level=1)
    return encode(
        _COMPRESSED,
        header=header(stamp_ns, frame_id),
        format=_DEPTH_FORMAT,
        data=np.frombuffer(_DEPTH_HEADER + out.getvalue(), np.uint8),
    )


def decode_depth(payload: bytes) -> DepthImage:
    """Read a compressedDepth image: of type 16UC1, or of 32FC1 with quantised inverse depth.

    Raises:
        MessageError: Not such a message, damaged, or of another type.
    """
    message, data = _compressed_depth(payload)
    values = read_png(
        data[len(_DEPTH_HEADER) :], modes=GREY_16, expected="depth is a 16-bit grey PNG"
    ).astype(np.float32)
    if message.format.startswith("16UC1"):
        depth = values * np.float32(1e-3)
    else:
        # By codec.cpp of compressed_depth_image_transport: inverse depth, 0 for no return.
        _, factor, offset = struct.unpack_from("<iff", data)
        with np.errstate(divide="ignore", invalid="ignore"):
            depth = np.float32(factor) / (values - np.float32(offset))
        depth[~(np.isfinite(depth) & (depth > 0.0) & (values > 0.0))] = 0.0
    return DepthImage(
        stamp_ns=stamp_ns_of(message.header), frame_id=message.header.frame_id, depth=depth
    )


def depth_png(payload: bytes) -> tuple[int, str, bytes]:
    """Return stamp in nanoseconds, frame and PNG, in millimetres, of a compressedDepth image.

    Raises:
        MessageError: Not such a message, empty, or of another type.
    """
    message, data = _compressed_depth(payload)
    if not message.format.startswith("16UC1"):
        image = decode_depth(payload)
        return depth_png(encode_depth(image.depth, image.stamp_ns, image.frame_id))
    return stamp_ns_of(message.header), message.header.frame_id, data[len(_DEPTH_HEADER) :]


def _compressed_depth(payload: bytes) -> tuple[Any, bytes]:
    """Return a compressedDepth message, and its data with their header."""
    message = decode(payload, _COMPRESSED)
    if not message.format.startswith(("16UC1", "32FC1")):
        raise MessageError(
            f"compressed depth is 16UC1 or 32FC1; got format {message.format[:40]!r}"
        )
    data = message.data.tobytes()
    if len(data) <= len(_DEPTH_HEADER):
        raise MessageError(f"compressed depth of {len(data)} bytes holds no image")
    return message, data


def encode_depth_raw(depth: NDArray[np.float32], stamp_ns: int, frame_id: str) -> bytes:
    """Write (H, W) metres as an Image 16UC1 in millimetres."""
    height, width = depth.shape
    return encode(
        _IMAGE,
        header=header(stamp_ns, frame_id),
        height=height,
        width=width,
        encoding="16UC1",
        is_bigendian=0,
        step=2 * width,
        data=_to_millimetres(depth).astype("<u2").reshape(-1).view(np.uint8),
    )


def decode_depth_raw(payload: bytes) -> DepthImage:
    """Read an Image 16UC1 (millimetres) or 32FC1 (metres; NaN and infinity mean no return).

    Raises:
        MessageError: Not such a message, or sizes that contradict each other.
    """
    message = decode(payload, _IMAGE)
    kinds = {"16UC1": ("u2", 1e-3), "mono16": ("u2", 1e-3), "32FC1": ("f4", 1.0)}
    if message.encoding not in kinds:
        raise MessageError(
            f"depth is 16UC1 in mm or 32FC1 in m; got encoding {message.encoding[:40]!r}"
        )
    code, scale = kinds[message.encoding]
    dtype = np.dtype((">" if message.is_bigendian else "<") + code)
    values = image_rows(message, dtype).astype(np.float32) * np.float32(scale)
    values[~(np.isfinite(values) & (values > 0.0))] = 0.0
    return DepthImage(
        stamp_ns=stamp_ns_of(message.header), frame_id=message.header.frame_id, depth=values
    )


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


def _to_millimetres(depth: NDArray[np.float32]) -> NDArray[np.uint16]:
    valid = np.isfinite(depth) & (depth > 0.0) & (depth < 65.5)
    return np.rint(np.where(valid, depth, 0.0) * 1000.0).astype(np.uint16)


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
DEPTH_DECODERS: Final[dict[str, Callable[[bytes], DepthImage]]] = {
    keys.DEPTH: decode_depth,
    keys.DEPTH_RAW: decode_depth_raw,
}
"""Return the depth image of a message, by the key of its topic."""

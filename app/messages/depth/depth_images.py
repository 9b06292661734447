"""Depth images as ROS 2 messages."""

import io
import struct
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from PIL import Image as PillowImage

from app.messages import keys
from app.messages.cdr import MessageError, decode, encode, header, stamp_ns_of
from app.messages.depth.rvl import decode_rvl
from app.messages.images import GREY_16, image_rows, read_png

_COMPRESSED: Final = "sensor_msgs/msg/CompressedImage"
_IMAGE: Final = "sensor_msgs/msg/Image"
# Header of compressed_depth_image_transport before the image: format 0, and two parameters of
# quantisation, which 16UC1 does not use.
_DEPTH_HEADER: Final = struct.pack("<iff", 0, 0.0, 0.0)
_DEPTH_FORMAT: Final = "16UC1; compressedDepth png"
_MILLIMETRES: Final = ("16UC1", "mono16")
"""Encodings of an image before it was compressed; the other is 32FC1, metres."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DepthImage:
    """A depth image."""

    stamp_ns: int
    frame_id: str
    depth: NDArray[np.float32]
    """(H, W) metres, 0 marks no return."""


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
    """Read a compressedDepth image, PNG or RVL: millimetres, or of 32FC1 quantised inverse depth.

    Raises:
        MessageError: Not such a message, damaged, or of another type.
    """
    message, data = _compressed_depth(payload)
    image = data[len(_DEPTH_HEADER) :]
    if _is_rvl(message):
        values = decode_rvl(image).astype(np.float32)
    else:
        values = read_png(image, modes=GREY_16, expected="depth is a 16-bit grey PNG").astype(
            np.float32
        )
    if message.format.startswith(_MILLIMETRES):
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
    if _is_rvl(message) or not message.format.startswith(_MILLIMETRES):
        image = decode_depth(payload)
        return depth_png(encode_depth(image.depth, image.stamp_ns, image.frame_id))
    return stamp_ns_of(message.header), message.header.frame_id, data[len(_DEPTH_HEADER) :]


def _compressed_depth(payload: bytes) -> tuple[Any, bytes]:
    """Return a compressedDepth message, and its data with their header."""
    message = decode(payload, _COMPRESSED)
    if not message.format.startswith((*_MILLIMETRES, "32FC1")):
        raise MessageError(
            f"compressed depth is 16UC1 or 32FC1; got format {message.format[:40]!r}"
        )
    data = message.data.tobytes()
    if len(data) <= len(_DEPTH_HEADER):
        raise MessageError(f"compressed depth of {len(data)} bytes holds no image")
    return message, data


def _is_rvl(message: Any) -> bool:
    """Tell whether a compressedDepth image is RVL; without the name of a codec it is PNG."""
    _, _, codec = message.format.partition("compressedDepth")
    if codec.strip() not in ("", "png", "rvl"):
        raise MessageError(
            f"compressed depth is PNG or RVL (`compressedDepth png`, `compressedDepth rvl`); got "
            f"format {message.format[:40]!r}"
        )
    return codec.strip() == "rvl"


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


def _to_millimetres(depth: NDArray[np.float32]) -> NDArray[np.uint16]:
    valid = np.isfinite(depth) & (depth > 0.0) & (depth < 65.5)
    return np.rint(np.where(valid, depth, 0.0) * 1000.0).astype(np.uint16)


DEPTH_DECODERS: Final[dict[str, Callable[[bytes], DepthImage]]] = {
    keys.DEPTH: decode_depth,
    keys.DEPTH_RAW: decode_depth_raw,
}
"""Return the depth image of a message, by the key of its topic."""

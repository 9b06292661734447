"""Raw depth images, compressed without loss: 16-bit PNG, as `compressed_depth_image_transport`."""

from __future__ import annotations

import logging
import struct
import zlib
from collections.abc import Callable

import numpy as np  # rclpy needs it, too: its messages hold arrays.

logger = logging.getLogger(__name__)

FORMAT = b"16UC1; compressedDepth png\0"
HEADER = bytes(12)
"""Parameters of quantisation, which 16UC1 does not have."""
MOST_PIXELS = 100_000_000


class DepthOutput:
    """Publishes raw depth images as PNG, and as they are where that cannot be.

    Args:
        put_raw: Publishes an Image.
        put_compressed: Publishes a CompressedImage.
    """

    def __init__(
        self, put_raw: Callable[[bytes], None], put_compressed: Callable[[bytes], None]
    ) -> None:
        self._put_raw, self._put_compressed = put_raw, put_compressed
        self._told = False

    def put(self, payload: bytes) -> int:
        """Publish an Image; return how many bytes went."""
        try:
            compressed = compress_depth(payload)
        except ValueError as error:
            compressed = None
            self._tell(f"cannot be compressed ({error})")
        else:
            if compressed is None:
                self._tell("is not 16UC1 (millimetres)")
        if compressed is None:
            self._put_raw(payload)
            return len(payload)
        self._put_compressed(compressed)
        return len(compressed)

    def _tell(self, problem: str) -> None:
        if not self._told:
            self._told = True
            logger.warning("depth %s: it is carried as it is", problem)


def compress_depth(payload: bytes) -> bytes | None:
    """Return a serialized sensor_msgs/CompressedImage of a serialized Image of type 16UC1.

    None for another type or order of bytes, which has to be carried as it is.

    Raises:
        ValueError: It is damaged.
    """
    if payload[:2] != b"\x00\x01":
        return None
    try:
        (length,) = struct.unpack_from("<I", payload, 12)
        at = _aligned(16 + length)
        height, width, named = struct.unpack_from("<III", payload, at)
        encoding = payload[at + 12 : at + 12 + named].rstrip(b"\0")
        at += 12 + named
        big_endian = payload[at]
        step, size = struct.unpack_from("<II", payload, _aligned(at + 1))
        start = _aligned(at + 1) + 8
    except (struct.error, IndexError) as error:
        raise ValueError(f"not an Image: {len(payload)} bytes") from error
    if encoding not in (b"16UC1", b"mono16") or big_endian:
        return None
    if not (0 < width * height <= MOST_PIXELS and step >= 2 * width and size >= step * height):
        raise ValueError(f"an image of {width} x {height} with {size} bytes")
    if len(payload) < start + size:
        raise ValueError(f"an image of {size} bytes is cut")
    png = _png(memoryview(payload)[start : start + size], width, height, step)
    head = payload[: 16 + length]
    data = HEADER + png
    text = _padded(head) + struct.pack("<I", len(FORMAT)) + FORMAT
    return _padded(text) + struct.pack("<I", len(data)) + data


def _png(rows: memoryview, width: int, height: int, step: int) -> bytes:
    pixels = np.frombuffer(rows, np.uint8).reshape(-1)[: step * height].reshape(height, step)
    high_first = pixels[:, : 2 * width].reshape(height, width, 2)[:, :, ::-1]
    filtered = np.empty((height, 1 + 2 * width), np.uint8)
    filtered[:, 0] = 1  # Each byte less the one of the pixel before it.
    lines = high_first.reshape(height, 2 * width)
    filtered[:, 1:3] = lines[:, :2]
    np.subtract(lines[:, 2:], lines[:, :-2], out=filtered[:, 3:])
    size = struct.pack(">IIBBBBB", width, height, 16, 0, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n"
        + _chunk(b"IHDR", size)
        + _chunk(b"IDAT", zlib.compress(filtered.tobytes(), 1))
        + _chunk(b"IEND", b"")
    )


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def _aligned(at: int) -> int:
    """Return the next multiple of 4 counted from the end of the encapsulation header."""
    return 4 + (at - 4 + 3) // 4 * 4


def _padded(data: bytes) -> bytes:
    return data + bytes(-(len(data) - 4) % 4)

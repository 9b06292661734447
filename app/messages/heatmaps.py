"""The data of a heatmap message: whole, or the largest labels of each pixel alone."""

from typing import Final

import numpy as np
import zstandard
from numpy.typing import NDArray

from app.messages.cdr import MessageError
from ippon.observation import HeatmapKind
from ippon.segmentation.compact_heatmap import TopClasses, keep_top, spread_out

RAW: Final = "raw"
WHOLE: Final = "zstd"
TOP: Final = "top-zstd"
MAX_SOURCE: Final = 80
"""Characters of a network's name."""


def pack_whole(probabilities: NDArray[np.uint8]) -> bytes:
    """Compress all channels."""
    return zstandard.ZstdCompressor(level=1).compress(np.ascontiguousarray(probabilities).data)


def pack_top(probabilities: NDArray[np.uint8], count: int, always: int | None) -> bytes:
    """Compress the `count` largest channels of each pixel; `always` is one of them."""
    top = keep_top(probabilities, count, always)
    narrow = probabilities.shape[2] <= 256
    planes = top.channels.astype(np.uint8 if narrow else "<u2")
    data = planes.tobytes() + top.values.tobytes()
    return zstandard.ZstdCompressor(level=3).compress(data)


def describe_encoding(packing: str, kind: HeatmapKind, source: str) -> str:
    """Return a message's encoding: how it is packed, and, of scores, of which network they are."""
    return packing if kind == "distribution" else f"{packing};{kind};{source[:MAX_SOURCE]}"


def read_encoding(encoding: str) -> tuple[str, HeatmapKind, str]:
    """Return packing, kind and source of a message's encoding.

    Raises:
        MessageError: Of another kind.
    """
    packing, *rest = encoding.split(";", 2)
    if not rest:
        return packing, "distribution", ""
    if rest[0] != "scores" or len(rest) < 2 or len(rest[1]) > MAX_SOURCE:
        raise MessageError(
            f"a heatmap's encoding is {WHOLE}, {TOP} or {WHOLE};scores;NETWORK; got "
            f"{encoding[:80]!r}"
        )
    return packing, "scores", rest[1]


def unpack(
    encoding: str, data: NDArray[np.uint8], shape: tuple[int, int, int]
) -> NDArray[np.uint8]:
    """Read the data of a heatmap message.

    Args:
        encoding: `raw`, `zstd` or `top-zstd`.
        data: As they came.
        shape: (h, w, C), already checked to be acceptable.

    Raises:
        MessageError: Damaged, or not of the size that the message states.
    """
    height, width, channels = shape
    expected = height * width * channels
    if encoding == RAW:
        if data.size != expected:
            raise MessageError(f"heatmap data are {data.size} bytes, the size says {expected}")
        return data.reshape(shape)
    if encoding == WHOLE:
        return _decompress(data, expected, expected).reshape(shape)
    if encoding == TOP:
        return _read_top(data, shape)
    raise MessageError(f"heatmap encoding is raw, zstd or top-zstd; got {encoding[:40]!r}")


def _read_top(data: NDArray[np.uint8], shape: tuple[int, int, int]) -> NDArray[np.uint8]:
    height, width, channels = shape
    index_type = np.dtype(np.uint8 if channels <= 256 else "<u2")
    per_label = height * width * (index_type.itemsize + 1)
    plain = _decompress(data, per_label, per_label * channels)
    if plain.size % per_label:
        raise MessageError(f"heatmap data unpack to {plain.size} bytes, no multiple of {per_label}")
    count = plain.size // per_label
    split = count * height * width * index_type.itemsize
    index = np.frombuffer(plain[:split].tobytes(), index_type).astype(np.uint16)
    planes = (count, height, width)
    top = TopClasses(index.reshape(planes), plain[split:].reshape(planes))
    try:
        return spread_out(top, channels)
    except ValueError as error:
        raise MessageError(f"heatmap data name {error}") from error


def _decompress(data: NDArray[np.uint8], least: int, most: int) -> NDArray[np.uint8]:
    packed = data.tobytes()
    try:
        # The frame states its size: checked before a byte of it is allocated.
        size = zstandard.frame_content_size(packed)
        if not least <= size <= most:
            wanted = f"{least}" if least == most else f"{least} to {most}"
            raise MessageError(f"heatmap data do not unpack to {wanted} bytes")
        return np.frombuffer(zstandard.ZstdDecompressor().decompress(packed), np.uint8)
    except zstandard.ZstdError as error:
        raise MessageError(f"damaged heatmap data: {error}") from error

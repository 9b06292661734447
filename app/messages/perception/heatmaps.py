"""Heatmaps as messages: complete, or the most probable labels of each pixel."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import zstandard
from numpy.typing import NDArray

from app.messages.cdr import MessageError, decode, encode, header, stamp_ns_of
from app.messages.images import check_size
from ippon.observation import Heatmap, HeatmapKind
from ippon.segmentation.compact_heatmap import TopClasses, expand_top, keep_top

MAX_LABELS: Final = 512
MAX_HEATMAP_BYTES: Final = 128 * 2**20
_HEATMAP: Final = "ippon_msgs/msg/Heatmap"
RAW: Final = "raw"
WHOLE: Final = "zstd"
TOP: Final = "top-zstd"
MAX_SOURCE: Final = 80
"""Maximum characters of a network's name."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StampedHeatmap:
    """A heatmap with the stamp of its colour image."""

    stamp_ns: int
    frame_id: str
    heatmap: Heatmap


def encode_heatmap(
    heatmap: Heatmap,
    stamp_ns: int,
    frame_id: str,
    *,
    keep: int | None = None,
    also: Sequence[str] = (),
) -> bytes:
    """Write a heatmap, compressed with zstd.

    Args:
        heatmap: The heatmap.
        stamp_ns: Stamp of the colour image.
        frame_id: Frame of the colour image.
        keep: Labels to keep per pixel, including the object of interest; None keeps all. Scores are
            always kept, because a missing score is evidence as well.
        also: Further objects of interest, kept in addition.
    """
    height, width, _ = heatmap.probabilities.shape
    if heatmap.kind == "scores":
        keep = None
    if keep is None:
        packed = pack_whole(heatmap.probabilities)
    else:
        goals = (heatmap.ooi_channel, *map(heatmap.channel_of, also))
        always = tuple(dict.fromkeys(channel for channel in goals if channel is not None))
        packed = pack_top(heatmap.probabilities, keep + len(also), always)
    return encode(
        _HEATMAP,
        header=header(stamp_ns, frame_id),
        height=height,
        width=width,
        labels=list(heatmap.labels),
        ooi=heatmap.ooi or "",
        encoding=describe_encoding(WHOLE if keep is None else TOP, heatmap.kind, heatmap.source),
        data=np.frombuffer(packed, np.uint8),
    )


def decode_heatmap(payload: bytes) -> StampedHeatmap:
    """Read a heatmap.

    Raises:
        MessageError: Not such a message, or its data have the wrong size.
    """
    message = decode(payload, _HEATMAP)
    labels, ooi = tuple(message.labels), message.ooi or None
    channels = len(labels) + (ooi is not None and ooi not in labels)
    if not 1 <= channels <= MAX_LABELS:
        raise MessageError(f"a heatmap has 1 to {MAX_LABELS} channels; got {channels}")
    check_size(message.width, message.height)
    expected = message.height * message.width * channels
    if expected > MAX_HEATMAP_BYTES:
        raise MessageError(
            f"a heatmap of {message.height}x{message.width}x{channels} is over "
            f"{MAX_HEATMAP_BYTES} bytes"
        )
    shape = (message.height, message.width, channels)
    packing, kind, source = read_encoding(message.encoding)
    return StampedHeatmap(
        stamp_ns=stamp_ns_of(message.header),
        frame_id=message.header.frame_id,
        heatmap=Heatmap(
            labels=labels,
            ooi=ooi,
            probabilities=unpack(packing, message.data, shape),
            kind=kind,
            source=source,
        ),
    )


def pack_whole(probabilities: NDArray[np.uint8]) -> bytes:
    """Compress all channels."""
    return zstandard.ZstdCompressor(level=1).compress(np.ascontiguousarray(probabilities).data)


def pack_top(probabilities: NDArray[np.uint8], count: int, always: Sequence[int]) -> bytes:
    """Compress the `count` largest channels of each pixel, always including `always`."""
    top = keep_top(probabilities, count, always)
    narrow = probabilities.shape[2] <= 256
    planes = top.channels.astype(np.uint8 if narrow else "<u2")
    data = planes.tobytes() + top.values.tobytes()
    return zstandard.ZstdCompressor(level=3).compress(data)


def describe_encoding(packing: str, kind: HeatmapKind, source: str) -> str:
    """Return a message's encoding: the packing, and for scores their network."""
    return packing if kind == "distribution" else f"{packing};{kind};{source[:MAX_SOURCE]}"


def read_encoding(encoding: str) -> tuple[str, HeatmapKind, str]:
    """Return packing, kind and source of a message's encoding.

    Raises:
        MessageError: The encoding is unknown.
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
        data: Data as received.
        shape: (h, w, C), checked before.

    Raises:
        MessageError: Damaged, or not of the size stated in the message.
    """
    height, width, channels = shape
    expected = height * width * channels
    if encoding == RAW:
        if data.size != expected:
            raise MessageError(f"heatmap data are {data.size} bytes, the stated size is {expected}")
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
        return expand_top(top, channels)
    except ValueError as error:
        raise MessageError(f"heatmap data name {error}") from error


def _decompress(data: NDArray[np.uint8], least: int, most: int) -> NDArray[np.uint8]:
    packed = data.tobytes()
    try:
        # The stated size is checked before memory is allocated.
        size = zstandard.frame_content_size(packed)
        if not least <= size <= most:
            wanted = f"{least}" if least == most else f"{least} to {most}"
            raise MessageError(f"heatmap data do not unpack to {wanted} bytes")
        return np.frombuffer(zstandard.ZstdDecompressor().decompress(packed), np.uint8)
    except zstandard.ZstdError as error:
        raise MessageError(f"damaged heatmap data: {error}") from error

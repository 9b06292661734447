"""File format of maps: a JSON header and arrays, versioned, compressed, with a checksum.

Layout: 8 bytes of magic, version (uint32), length of the header (uint32), the header as JSON, the
arrays one after the other as one zstd frame, and a BLAKE2b digest of everything before it. The
header lists name, dtype and shape of each array under "arrays"; numbers are little-endian.
"""

import hashlib
import json
import struct
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
import zstandard
from numpy.typing import NDArray

from ippon.atomic_file import replace_file
from ippon.decompression import unpack_zstd
from ippon.errors import MapFileError

MAGIC: Final = b"IPPONMAP"
VERSION: Final = 2
DIGEST_BYTES: Final = 32
MOST_BYTES: Final = 1 << 32
"""Bound on the arrays of a file, unless more is asked for."""
DTYPES: Final = ("|u1", "|i1", "<u2", "<i2", "<i4", "<i8", "<f4", "<f8")
_PREFIX = struct.Struct("<8sII")

Arrays = dict[str, NDArray[Any]]


def encode(header: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> bytes:
    """Return the file's bytes.

    Args:
        header: JSON values; "arrays" is added.
        arrays: Arrays of the types in `DTYPES`.
    """
    entries = [
        {"name": name, "dtype": a.dtype.newbyteorder("<").str, "shape": list(a.shape)}
        for name, a in arrays.items()
    ]
    text = json.dumps({**header, "arrays": entries}, sort_keys=True).encode()
    body = b"".join(
        np.ascontiguousarray(a, dtype=a.dtype.newbyteorder("<")).tobytes() for a in arrays.values()
    )
    packed = zstandard.ZstdCompressor(level=3).compress(body)
    content = _PREFIX.pack(MAGIC, VERSION, len(text)) + text + packed
    return content + _digest(content)


def decode(content: bytes, max_bytes: int = MOST_BYTES) -> tuple[dict[str, Any], Arrays]:
    """Read what `encode` wrote.

    Args:
        content: The file.
        max_bytes: Bound on the arrays' size; a header that asks for more is refused.

    Raises:
        MapFileError: No map, another version, damaged, or larger than `max_bytes`.
    """
    if len(content) < _PREFIX.size + DIGEST_BYTES or content[:8] != MAGIC:
        raise MapFileError("not a map file: it does not begin with IPPONMAP")
    _, version, header_length = _PREFIX.unpack_from(content)
    if version != VERSION:
        raise MapFileError(f"map file of version {version}; this program reads version {VERSION}")
    body_end = len(content) - DIGEST_BYTES
    if _digest(content[:body_end]) != content[body_end:]:
        raise MapFileError("map file is damaged: its checksum does not fit, or its end is missing")
    start = _PREFIX.size + header_length
    try:
        header = json.loads(content[_PREFIX.size : start])
        entries = [
            (str(e["name"]), _dtype(e["dtype"]), tuple(int(n) for n in e["shape"]))
            for e in header.pop("arrays")
        ]
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
        raise MapFileError(f"map file has no readable header: {error}") from error
    sizes = [dtype.itemsize * _count(shape) for _, dtype, shape in entries]
    if sum(sizes) > max_bytes:
        raise MapFileError(f"map file holds {sum(sizes)} bytes; at most {max_bytes} are read")
    try:
        body = unpack_zstd(content[start:body_end], max(1, sum(sizes)))
    except zstandard.ZstdError as error:
        raise MapFileError(f"map file cannot be unpacked: {error}") from error
    if len(body) != sum(sizes):
        raise MapFileError(f"map file holds {len(body)} bytes of arrays, not {sum(sizes)}")
    arrays: Arrays = {}
    offset = 0
    for (name, dtype, shape), size in zip(entries, sizes, strict=True):
        arrays[name] = np.frombuffer(body, dtype, _count(shape), offset).reshape(shape)
        offset += size
    return header, arrays


def write(path: Path, header: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> None:
    """Write a file atomically: a crash leaves the old file or the new one."""
    replace_file(path, encode(header, arrays))


def read(path: Path, max_bytes: int = MOST_BYTES) -> tuple[dict[str, Any], Arrays]:
    """Read a file; see `decode`, raises as it does, and OSError."""
    return decode(path.read_bytes(), max_bytes)


def _digest(content: bytes) -> bytes:
    return hashlib.blake2b(content, digest_size=DIGEST_BYTES).digest()


def _dtype(text: str) -> np.dtype[Any]:
    if text not in DTYPES:
        raise ValueError(f"dtype {text!r} is not one of {', '.join(DTYPES)}")
    return np.dtype(text)


def _count(shape: tuple[int, ...]) -> int:
    if any(n < 0 for n in shape):
        raise MapFileError(f"map file has an array of shape {shape}")
    count = 1
    for n in shape:
        count *= n
    return count

"""The records of an MCAP file that the reader needs (mcap.dev/spec)."""

import mmap
import struct
import zlib
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Final

import zstandard

from app.recording.errors import RecordingError
from ippon.decompression import unpack_zstd

RECORD_HEAD: Final = struct.Struct("<BQ")
CHUNK_HEAD: Final = struct.Struct("<QQQII")
"""First and last time, unpacked size, checksum, length of the compression's name."""
MESSAGE_HEAD: Final = struct.Struct("<HIQQ")
"""Channel, sequence, log time, publish time."""
MAX_CHUNK_BYTES: Final = 1 << 30

Bytes = bytes | mmap.mmap


class Opcode(IntEnum):
    """Kinds of records."""

    HEADER = 0x01
    FOOTER = 0x02
    SCHEMA = 0x03
    CHANNEL = 0x04
    MESSAGE = 0x05
    CHUNK = 0x06
    MESSAGE_INDEX = 0x07
    ATTACHMENT = 0x09
    METADATA = 0x0C
    DATA_END = 0x0F


@dataclass(frozen=True, slots=True, kw_only=True)
class Channel:
    """Messages of one topic."""

    topic: str
    type: str
    encoding: str
    metadata: dict[str, str]


@dataclass(frozen=True, slots=True, kw_only=True)
class Chunk:
    """Compressed messages of a time span."""

    start_ns: int
    end_ns: int
    offset: int
    """Position of the compressed bytes in the file."""
    length: int
    size: int
    """Unpacked."""
    checksum: int
    """CRC-32 of the uncompressed bytes; 0 if the writer stored none."""
    compression: str


@dataclass(slots=True)
class ChunkContent:
    """Content of a chunk."""

    definitions: list[tuple[int, bytes]] = field(default_factory=list[tuple[int, bytes]])
    """Schemas and channels, as records."""
    messages: dict[int, list[tuple[int, int]]] = field(
        default_factory=dict[int, list[tuple[int, int]]]
    )
    """Time and offset of each message, by channel."""


def unpack_chunk(packed: bytes, chunk: Chunk) -> bytes:
    """Return the records of a chunk.

    Args:
        packed: Its bytes in the file.
        chunk: What the file says of it.

    Raises:
        RecordingError: It is damaged, or its compression is not supported.
    """
    if chunk.size > MAX_CHUNK_BYTES:
        raise RecordingError(f"a chunk states an uncompressed size of {chunk.size} bytes: damaged")
    records = _unpacked(packed, chunk)
    if chunk.checksum and zlib.crc32(records) != chunk.checksum:
        raise RecordingError(f"the chunk at byte {chunk.offset} is damaged: its checksum differs")
    return records


def _unpacked(packed: bytes, chunk: Chunk) -> bytes:
    try:
        if chunk.compression == "zstd":
            return unpack_zstd(packed, chunk.size)
        if chunk.compression == "lz4":
            import lz4.frame  # noqa: PLC0415 (only bags of other programs use it)

            return lz4.frame.LZ4FrameDecompressor().decompress(packed, max_length=chunk.size)
    except (zstandard.ZstdError, RuntimeError) as error:
        raise RecordingError(f"the chunk at byte {chunk.offset} is damaged: {error}") from error
    if chunk.compression == "":
        return packed
    raise RecordingError(
        f"compression {chunk.compression[:20]!r} of chunks is not supported; zstd is"
    )


def index_chunk(records: bytes) -> ChunkContent:
    """Find the definitions and messages in an uncompressed chunk; an incomplete end is ignored."""
    content = ChunkContent()
    position = 0
    while position + RECORD_HEAD.size <= len(records):
        op, length = RECORD_HEAD.unpack_from(records, position)
        start, stop = position + RECORD_HEAD.size, position + RECORD_HEAD.size + length
        if stop > len(records):
            break
        if op == Opcode.MESSAGE:
            channel, _, time_ns, _ = MESSAGE_HEAD.unpack_from(records, start)
            content.messages.setdefault(channel, []).append((time_ns, position))
        elif op in (Opcode.SCHEMA, Opcode.CHANNEL):
            content.definitions.append((op, records[start:stop]))
        position = stop
    return content


def read_message(records: Bytes, offset: int) -> bytes:
    """Return the data of the message record at an offset.

    Raises:
        RecordingError: There is none.
    """
    if not 0 <= offset <= len(records) - RECORD_HEAD.size - MESSAGE_HEAD.size:
        raise RecordingError(f"no message at byte {offset}: the index is damaged")
    op, length = RECORD_HEAD.unpack_from(records, offset)
    start = offset + RECORD_HEAD.size
    if op != Opcode.MESSAGE or start + length > len(records):
        raise RecordingError(f"no message at byte {offset}: the index is damaged")
    return records[start + MESSAGE_HEAD.size : start + length]


def read_schema(body: bytes) -> tuple[int, str]:
    """Return number and name of a schema."""
    (number,) = struct.unpack_from("<H", body)
    name, _ = _text(body, 2)
    return number, name


def read_channel(body: bytes, schemas: dict[int, str]) -> tuple[int, Channel]:
    """Return number and content of a channel."""
    number, schema = struct.unpack_from("<HH", body)
    topic, at = _text(body, 4)
    encoding, at = _text(body, at)
    return number, Channel(
        topic=topic, type=schemas.get(schema, ""), encoding=encoding, metadata=_pairs(body, at)
    )


def read_attachment(data: Bytes, start: int) -> tuple[str, int, int]:
    """Return the name of an attachment, and the start and length of its data."""
    name, at = _text(data, start + 16)
    _, at = _text(data, at)
    (length,) = struct.unpack_from("<Q", data, at)
    return name, at + 8, length


def read_metadata(body: bytes) -> tuple[str, dict[str, str]]:
    """Return name and values of a metadata record."""
    name, at = _text(body, 0)
    return name, _pairs(body, at)


def _text(data: Bytes, at: int) -> tuple[str, int]:
    (length,) = struct.unpack_from("<I", data, at)
    return bytes(data[at + 4 : at + 4 + length]).decode("utf-8", "replace"), at + 4 + length


def _pairs(body: bytes, at: int) -> dict[str, str]:
    (length,) = struct.unpack_from("<I", body, at)
    at, stop = at + 4, at + 4 + length
    pairs: dict[str, str] = {}
    while at < stop:
        key, at = _text(body, at)
        pairs[key], at = _text(body, at)
    return pairs

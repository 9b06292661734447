"""Index of the messages of an MCAP file, built from the record headers.

The index at the end of the file is missing if the recorder was killed, so it is not used: the
headers of the chunks and their message indexes contain the same, and scanning them is fast.
"""

import mmap
import struct
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from app.recording.errors import RecordingError
from app.recording.reading.mcap_records import (
    CHUNK_HEAD,
    RECORD_HEAD,
    Bytes,
    Channel,
    Chunk,
    Opcode,
    index_chunk,
    read_attachment,
    read_channel,
    read_metadata,
    read_schema,
    unpack_chunk,
)
from ippon.frame import NANOSECONDS
from ippon.mapping import map_file

MAGIC: Final = b"\x89MCAP0\r\n"
BACKWARDS_NS: Final = 2 * NANOSECONDS
"""Largest step back in time from one chunk to the next that is accepted as disorder: the recorder
holds depth images for up to 1.5 s."""
_ENTRY: Final = np.dtype([("time", "<u8"), ("offset", "<u8")])
_WORDS: Final = struct.Struct("<HI")
OUTSIDE_CHUNKS: Final = -1
"""In place of a chunk, for a message that is in none."""
_LATEST: Final = np.uint64(2**63 - 1)
"""Largest time, nanoseconds since 1970: the year 2262."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ByteRange:
    """A part of the file."""

    offset: int
    length: int


@dataclass(slots=True, kw_only=True)
class Entries:
    """Messages of one channel, ordered by time."""

    time_ns: NDArray[np.int64]
    chunk: NDArray[np.int32]
    """Row of `FileIndex.chunks`, or `OUTSIDE_CHUNKS`."""
    offset: NDArray[np.int64]
    """In the unpacked chunk, or in the file; the number of the message in SQLite."""


@dataclass(slots=True, kw_only=True)
class FileIndex:
    """Channels, chunks, messages and attachments of a file."""

    channels: dict[int, Channel] = field(default_factory=dict[int, Channel])
    chunks: list[Chunk] = field(default_factory=list[Chunk])
    entries: dict[int, Entries] = field(default_factory=dict[int, Entries])
    attachments: dict[str, ByteRange] = field(default_factory=dict[str, ByteRange])
    metadata: dict[str, dict[str, str]] = field(default_factory=dict[str, dict[str, str]])
    profile: str = ""
    complete: bool = False
    """Whether the file was ended properly."""
    end: int = 0
    """End of the last complete record of the data."""
    problems: list[str] = field(default_factory=list[str])


def _not_ours(path: Path, start: bytes) -> str:
    if start == map_file.MAGIC:
        return (
            f"{path} is a map of `ippon navigate --map`, and not a recording: start the navigator "
            "and the console with it, and export it in the Session tab; `ippon memory --file` says "
            "what was remembered"
        )
    return (
        f"{path} is not a recording: it begins neither like an MCAP file nor like a bag in SQLite "
        "(.db3)"
    )


class Scanner:
    """Scans a file; repeated calls continue with what was appended since."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._data: Bytes = b""
        self._index = FileIndex(end=len(MAGIC))
        self._schemas: dict[int, str] = {}
        self._parts: dict[int, list[tuple[int, bytes]]] = {}
        """By channel: chunks and the entries of their message indexes, since the last call."""
        self._loose: dict[int, list[tuple[int, int]]] = {}
        """By channel: times and places of messages outside of chunks, since the last call."""
        self._indexed = True
        """Whether the last chunk is indexed."""
        self._read_to = -1
        """Chunk that was indexed by its content; its message index is ignored."""
        self._unended = ""
        self._undefined: set[int] = set()
        self._clock_set_back = False

    def scan(self, progress: Callable[[float], None] | None = None) -> FileIndex:
        """Continue where the last call ended, and return the index.

        Raises:
            RecordingError: The file cannot be read, or is not an MCAP file.
        """
        try:
            with self._path.open("rb") as file:
                if (start := file.read(len(MAGIC))) != MAGIC:
                    raise RecordingError(_not_ours(self._path, start))
                with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as self._data:
                    self._read_on(progress)
        except OSError as error:
            raise RecordingError(f"cannot read {self._path}: {error.strerror}") from error
        finally:
            self._data = b""
        return self._index

    def _read_on(self, progress: Callable[[float], None] | None) -> None:
        index, size = self._index, len(self._data)
        index.problems = [text for text in index.problems if text != self._unended]
        self._read_records(progress)
        if not index.complete and self._read_to != len(index.chunks) - 1:
            # The file may be cut off between the indexes of the chunk's channels.
            self._indexed = False
        self._complete_chunk()
        if not index.complete:
            self._unended = (
                f"the file was not ended: its index is missing, and {size - index.end} bytes at "
                f"its end are not a complete record"
            )
            index.problems.append(self._unended)
        self._merge()

    def _read_records(self, progress: Callable[[float], None] | None) -> None:
        data, index, size = self._data, self._index, len(self._data)
        position = told = index.end
        while position + RECORD_HEAD.size <= size:
            op, length = RECORD_HEAD.unpack_from(data, position)
            start, stop = position + RECORD_HEAD.size, position + RECORD_HEAD.size + length
            if stop > size:
                return
            if op in (Opcode.DATA_END, Opcode.FOOTER):
                index.complete = data[size - len(MAGIC) :] == MAGIC
                return
            try:
                self._take(op, start, stop)
            except (struct.error, ValueError, IndexError) as error:
                index.problems.append(f"the record at byte {position} is damaged: {error}")
                return
            index.end = position = stop
            if progress is not None and position - told > size // 50:
                told = position
                progress(position / size)

    def _take(self, op: int, start: int, stop: int) -> None:
        data, index = self._data, self._index
        if op == Opcode.CHUNK:
            self._complete_chunk()
            chunk = _chunk_at(data, start, stop)
            self._check_clock(chunk)
            index.chunks.append(chunk)
            self._indexed = False
        elif op == Opcode.MESSAGE_INDEX:
            channel, size = _WORDS.unpack_from(data, start)
            size = min(size, stop - start - _WORDS.size)
            if size >= _ENTRY.itemsize and self._read_to != len(index.chunks) - 1:
                whole = size - size % _ENTRY.itemsize
                first = start + _WORDS.size
                self._note(channel, data[first : first + whole])
            self._indexed = True
        elif op == Opcode.MESSAGE:
            channel, _, time_ns = struct.unpack_from("<HIQ", data, start)
            self._loose.setdefault(channel, []).append((time_ns, start - RECORD_HEAD.size))
        elif op in (Opcode.SCHEMA, Opcode.CHANNEL):
            self._take_definition(op, data[start:stop])
        elif op == Opcode.ATTACHMENT:
            name, offset, length = read_attachment(data, start)
            index.attachments[name] = ByteRange(offset=offset, length=length)
        elif op == Opcode.METADATA:
            name, values = read_metadata(data[start:stop])
            index.metadata[name] = values
        elif op == Opcode.HEADER:
            (length,) = struct.unpack_from("<I", data, start)
            index.profile = data[start + 4 : start + 4 + length].decode("utf-8", "replace")

    def _check_clock(self, chunk: Chunk) -> None:
        back_ns = self._index.chunks[-1].end_ns - chunk.start_ns if self._index.chunks else 0
        if back_ns > BACKWARDS_NS and not self._clock_set_back:
            self._clock_set_back = True
            self._index.problems.append(
                f"the recorder's clock was set back by {back_ns * 1e-9:.1f} s: messages from "
                f"before and after are mixed over this span"
            )

    def _note(self, channel: int, entries: bytes) -> None:
        chunk = len(self._index.chunks) - 1
        if channel not in self._index.channels:
            self._read_chunk(chunk)
        self._parts.setdefault(channel, []).append((chunk, entries))

    def _read_chunk(self, chunk: int) -> dict[int, list[tuple[int, int]]]:
        """Read a chunk's schemas and channels; return the positions of its messages by channel."""
        try:
            one = self._index.chunks[chunk]
            packed = self._data[one.offset : one.offset + one.length]
            found = index_chunk(unpack_chunk(packed, one))
        except RecordingError as error:
            self._index.problems.append(str(error))
            return {}
        for op, body in found.definitions:
            self._take_definition(op, body)
        return found.messages

    def _take_definition(self, op: int, body: bytes) -> None:
        if op == Opcode.SCHEMA:
            number, name = read_schema(body)
            self._schemas[number] = name
        else:
            number, channel = read_channel(body, self._schemas)
            self._index.channels[number] = channel

    def _complete_chunk(self) -> None:
        """Index a chunk whose message index is missing by its content."""
        if self._indexed:
            return
        self._indexed = True
        chunk = self._read_to = len(self._index.chunks) - 1
        for channel, entries in self._read_chunk(chunk).items():
            others = [part for part in self._parts.get(channel, []) if part[0] != chunk]
            self._parts[channel] = [*others, (chunk, np.array(entries, _ENTRY).tobytes())]

    def _tell_undated(self, count: int) -> None:
        text = f"the index is damaged: {count} messages have no possible time, and are left out"
        if text not in self._index.problems:
            self._index.problems.append(text)

    def _merge(self) -> None:
        """Add to the index what was found since the last call."""
        entries = self._index.entries
        for channel in self._parts.keys() | self._loose.keys():
            if channel in self._index.channels:
                found = self._found(self._parts.pop(channel, []), self._loose.pop(channel, []))
                before = entries.get(channel)
                entries[channel] = found if before is None else _joined(before, found)
            elif channel not in self._undefined:
                self._undefined.add(channel)
                text = f"messages of channel {channel}, which is not defined"
                self._index.problems.append(text)

    def _found(self, parts: list[tuple[int, bytes]], loose: list[tuple[int, int]]) -> Entries:
        packed = b"".join(entries for _, entries in parts)
        rows = np.concatenate([np.frombuffer(packed, _ENTRY), np.array(loose, _ENTRY)])
        counts = [*(len(entries) // _ENTRY.itemsize for _, entries in parts), len(loose)]
        chunk = np.repeat(np.array([*(c for c, _ in parts), OUTSIDE_CHUNKS], np.int32), counts)
        dated = rows["time"] <= _LATEST
        if not dated.all():
            self._tell_undated(int(np.count_nonzero(~dated)))
            rows, chunk = rows[dated], chunk[dated]
        found = Entries(
            time_ns=rows["time"].astype(np.int64),
            chunk=chunk,
            offset=rows["offset"].astype(np.int64),
        )
        return _rows(found, np.argsort(found.time_ns, kind="stable"))


def _joined(before: Entries, after: Entries) -> Entries:
    """Return the messages of two parts of a channel; only where they overlap is sorted."""
    if not len(after.time_ns):
        return before
    apart = int(np.searchsorted(before.time_ns, after.time_ns[0], "right"))
    late = _chained(_rows(before, slice(apart, None)), after)
    order = np.argsort(late.time_ns, kind="stable")
    return _chained(_rows(before, slice(apart)), _rows(late, order))


def _chained(first: Entries, second: Entries) -> Entries:
    return Entries(
        time_ns=np.concatenate([first.time_ns, second.time_ns]),
        chunk=np.concatenate([first.chunk, second.chunk]),
        offset=np.concatenate([first.offset, second.offset]),
    )


def _rows(entries: Entries, rows: slice | NDArray[np.int64]) -> Entries:
    return Entries(
        time_ns=entries.time_ns[rows], chunk=entries.chunk[rows], offset=entries.offset[rows]
    )


def _chunk_at(data: Bytes, start: int, stop: int) -> Chunk:
    first, last, size, checksum, length = CHUNK_HEAD.unpack_from(data, start)
    at = start + CHUNK_HEAD.size
    compression = data[at : at + length].decode("ascii", "replace")
    at += length + 8
    return Chunk(
        start_ns=first,
        end_ns=last,
        offset=at,
        length=stop - at,
        size=size,
        checksum=checksum,
        compression=compression,
    )

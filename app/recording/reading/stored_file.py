"""One file of a recording, of the format that its first bytes tell."""

import os
import tempfile
from collections import OrderedDict
from collections.abc import Callable
from pathlib import Path
from typing import Final, Protocol

import zstandard

from app.recording.errors import RecordingError
from app.recording.reading.file_index import OUTSIDE_CHUNKS, FileIndex, Scanner
from app.recording.reading.mcap_records import RECORD_HEAD, read_message, unpack_chunk
from app.recording.reading.sqlite_file import SQLITE_MAGIC, SqliteFile
from ippon.decompression import unpack_zstd

ZSTD_MAGIC: Final = b"\x28\xb5\x2f\xfd"
"""Start of a compressed file, or message: CDR begins with a zero."""
CACHE_BYTES: Final = 64 * 2**20
"""Size of the uncompressed chunks in memory, of all files: about a minute of a session."""
MOST_MESSAGE_BYTES: Final = 2**28


class StoredFile(Protocol):
    """A file of messages."""

    path: Path
    index: FileIndex

    def refresh(self) -> bool:
        """Read what was appended; return whether there was anything."""
        ...

    def message(self, chunk: int, offset: int) -> bytes:
        """Return the data of a message at its place in the index.

        Raises:
            RecordingError: It is damaged.
        """
        ...

    def attachment(self, name: str) -> bytes | None:
        """Return an attachment, None if it is missing."""
        ...

    def close(self) -> None:
        """Close the file."""
        ...


class ChunkCache:
    """The uncompressed chunks that were read last, of all files of a recording."""

    def __init__(self) -> None:
        self._chunks: OrderedDict[tuple[Path, int], bytes] = OrderedDict()
        self._bytes = 0

    def get(self, file: Path, number: int, unpack: Callable[[], bytes]) -> bytes:
        """Return a chunk, unpacked if it is not kept."""
        records = self._chunks.get((file, number))
        if records is not None:
            self._chunks.move_to_end((file, number))
            return records
        records = self._chunks[file, number] = unpack()
        self._bytes += len(records)
        while self._bytes > CACHE_BYTES and len(self._chunks) > 1:
            _, old = self._chunks.popitem(last=False)
            self._bytes -= len(old)
        return records


class McapFile:
    """An MCAP file, which may still grow.

    Messages are read and not mapped into memory: pages of a mapped file count as memory of the
    process, and a bag has gigabytes of them.
    """

    def __init__(
        self, path: Path, cache: ChunkCache, progress: Callable[[float], None] | None = None
    ) -> None:
        self.path = path
        self._cache = cache
        self._scanner = Scanner(path)
        self._scanned = path.stat().st_size
        """Size of the file before it was scanned: what came meanwhile may not be in the index."""
        self.index = self._scanner.scan(progress)
        self._file = path.open("rb", buffering=0)
        self._size = os.fstat(self._file.fileno()).st_size

    def refresh(self) -> bool:
        """Read what was appended to an unfinished file; return whether there was anything."""
        try:
            size = os.fstat(self._file.fileno()).st_size
        except OSError as error:
            raise RecordingError(f"cannot read {self.path}: {error.strerror}") from error
        if self.index.complete or size <= self._scanned:
            return False
        end, self._scanned, self._size = self.index.end, size, size
        self._scanner.scan()
        return self.index.end > end or self.index.complete

    def message(self, chunk: int, offset: int) -> bytes:
        """Return the data of a message: see `StoredFile`."""
        if chunk == OUTSIDE_CHUNKS:
            head = self._bytes(offset, RECORD_HEAD.size)
            length = RECORD_HEAD.unpack(head)[1] if len(head) == RECORD_HEAD.size else 0
            return read_message(head + self._bytes(offset + RECORD_HEAD.size, length), 0)
        return read_message(
            self._cache.get(self.path, chunk, lambda: self._unpacked(chunk)), offset
        )

    def _unpacked(self, number: int) -> bytes:
        chunk = self.index.chunks[number]
        return unpack_chunk(self._bytes(chunk.offset, chunk.length), chunk)

    def _bytes(self, offset: int, length: int) -> bytes:
        try:
            return os.pread(self._file.fileno(), min(length, self._size), offset)
        except (OSError, OverflowError, ValueError) as error:
            raise RecordingError(f"no message at byte {offset}: the index is damaged") from error

    def attachment(self, name: str) -> bytes | None:
        """Return an attachment, None if it is missing."""
        span = self.index.attachments.get(name)
        return None if span is None else self._bytes(span.offset, span.length)

    def close(self) -> None:
        """Close the file."""
        self._file.close()


class OpenedFiles:
    """The files of a recording, those that were compressed as a whole unpacked beside.

    Unpacked files lie in the folder for temporary files until `close`.
    """

    def __init__(self) -> None:
        self._cache = ChunkCache()
        self._folder: tempfile.TemporaryDirectory[str] | None = None

    def open(self, path: Path, progress: Callable[[float], None] | None = None) -> StoredFile:
        """Open a file.

        Raises:
            RecordingError: It cannot be read, or is of no known format.
        """
        if _start(path).startswith(ZSTD_MAGIC):
            unpacked = self._unpacked(path)
            try:
                return self._known(unpacked, progress)
            except RecordingError as error:
                raise RecordingError(str(error).replace(str(unpacked), str(path))) from error
        return self._known(path, progress)

    def _known(self, path: Path, progress: Callable[[float], None] | None) -> StoredFile:
        if _start(path) == SQLITE_MAGIC:
            return SqliteFile(path)
        return McapFile(path, self._cache, progress)

    def _unpacked(self, path: Path) -> Path:
        self._folder = self._folder or tempfile.TemporaryDirectory(prefix="ippon-bag-")
        target = Path(self._folder.name) / path.stem
        with path.open("rb") as packed, target.open("wb") as file:
            try:
                zstandard.ZstdDecompressor().copy_stream(packed, file)
            except zstandard.ZstdError as error:
                raise RecordingError(f"{path} is damaged: {error}") from error
            except OSError as error:
                raise RecordingError(
                    f"{path} cannot be unpacked to {target.parent}: {error.strerror}; TMPDIR names "
                    "another folder"
                ) from error
        return target

    def close(self) -> None:
        """Remove what was unpacked."""
        if self._folder is not None:
            self._folder.cleanup()


def _start(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            return file.read(len(SQLITE_MAGIC))
    except OSError as error:
        raise RecordingError(f"cannot read {path}: {error.strerror}") from error


def unpack_message(data: bytes) -> bytes:
    """Return the data of a message, which rosbag2 may have compressed by itself.

    Raises:
        RecordingError: They are damaged.
    """
    if not data.startswith(ZSTD_MAGIC):
        return data
    try:
        return unpack_zstd(data, MOST_MESSAGE_BYTES)
    except zstandard.ZstdError as error:
        raise RecordingError(f"a compressed message is damaged: {error}") from error

"""Reading of a recording: the messages of any time span, in order."""

import mmap
import os
from collections import Counter, OrderedDict
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from app.recording.channels import USUAL, Names, key_of, to_wire
from app.recording.errors import RecordingError
from app.recording.reading.file_index import Entries, FileIndex, Scanner
from app.recording.reading.mcap_records import read_message, unpack_chunk

CACHE_BYTES: Final = 64 * 2**20
"""Number of uncompressed chunks in memory: about a minute of a session."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordedMessage:
    """One recorded message."""

    time_ns: int
    """Time of recording, nanoseconds since 1970."""
    key: str
    """Key under the robot's prefix."""
    payload: bytes


class Recording:
    """An open file. Not thread-safe: one thread owns it."""

    def __init__(
        self,
        path: Path,
        progress: Callable[[float], None] | None = None,
        names: Names = USUAL,
    ) -> None:
        """Open a file, or a session's folder, and index its messages.

        Args:
            path: The file or folder.
            progress: Called with the share that is indexed.
            names: Topics of a robot that has names of its own.

        Raises:
            RecordingError: There is no file, or it has no known message.
        """
        self.path = file_of(path)
        self._scanner = Scanner(self.path)
        self.index: FileIndex = self._scanner.scan(progress)
        self.damaged: Counter[str] = Counter()
        """Number of unreadable messages, by error."""
        self._names = names
        self._entries: dict[str, list[tuple[Entries, str]]] = {}
        self.start_ns = self.end_ns = 0
        self._adopt()
        self._cache: OrderedDict[int, bytes] = OrderedDict()
        self._cached = 0
        self._file = self.path.open("rb")
        self._data = mmap.mmap(self._file.fileno(), 0, access=mmap.ACCESS_READ)

    def refresh(self) -> bool:
        """Read what was appended to an unfinished file; return whether there was anything.

        Raises:
            RecordingError: It can no longer be read.
        """
        try:
            size = os.fstat(self._file.fileno()).st_size
        except OSError as error:
            raise RecordingError(f"cannot read {self.path}: {error.strerror}") from error
        if self.index.complete or size <= len(self._data):
            return False
        end = self.index.end
        self._scanner.scan()
        self._adopt()
        self._data.close()
        self._data = mmap.mmap(self._file.fileno(), 0, access=mmap.ACCESS_READ)
        return self.index.end > end or self.index.complete

    def _adopt(self) -> None:
        self._entries.clear()
        for number, entries in self.index.entries.items():
            channel = self.index.channels[number]
            key = key_of(channel.topic, channel.type, channel.metadata, self._names)
            if key is not None and channel.encoding == "cdr":
                self._entries.setdefault(key, []).append((entries, channel.type))
        ranges = [
            (e.time_ns[0], e.time_ns[-1])
            for found in self._entries.values()
            for e, _ in found
            if len(e.time_ns)
        ]
        if not ranges:
            raise RecordingError(_nothing(self.path, self.index))
        self.start_ns = int(min(first for first, _ in ranges))
        self.end_ns = int(max(last for _, last in ranges))

    def close(self) -> None:
        """Close the file."""
        self._data.close()
        self._file.close()

    @property
    def keys(self) -> tuple[str, ...]:
        """Keys with messages."""
        return tuple(self._entries)

    @property
    def duration_s(self) -> float:
        """Time from the first message to the last."""
        return (self.end_ns - self.start_ns) * 1e-9

    def times_ns(self, key: str) -> NDArray[np.int64]:
        """Return the times of the messages of a key, in order."""
        found = [entries.time_ns for entries, _ in self._entries.get(key, ())]
        return np.sort(np.concatenate(found)) if found else np.empty(0, np.int64)

    def latest(self, key: str, time_ns: int) -> RecordedMessage | None:
        """Return the last readable message of a key up to a time, None before the first."""
        found: RecordedMessage | None = None
        for entries, kind in self._entries.get(key, ()):
            for row in range(int(np.searchsorted(entries.time_ns, time_ns, "right")) - 1, -1, -1):
                if found is not None and entries.time_ns[row] <= found.time_ns:
                    break
                message = self._read(key, entries, kind, row)
                if message is not None:
                    found = message
                    break
        return found

    def first(self, key: str) -> RecordedMessage | None:
        """Return the first readable message of a key."""
        return next(self.all_messages((key,)), None)

    def between(
        self, after_ns: int, until_ns: int, keys: Iterable[str] | None = None
    ) -> Iterator[RecordedMessage]:
        """Yield the messages of a time span in order, without its start and with its end.

        Args:
            after_ns: Start; messages at this time are excluded.
            until_ns: End; messages at this time are included.
            keys: Keys to read; None for all.
        """
        sources: list[tuple[str, Entries, str, int]] = []
        times: list[NDArray[np.int64]] = []
        rows: list[NDArray[np.int64]] = []
        for key in self._entries if keys is None else keys:
            for entries, kind in self._entries.get(key, ()):
                low, high = np.searchsorted(entries.time_ns, [after_ns, until_ns], "right")
                if high > low:
                    sources.append((key, entries, kind, int(low)))
                    times.append(entries.time_ns[low:high])
                    rows.append(_places(entries, int(low), int(high)))
        if not sources:
            return
        source = np.concatenate([np.full(len(t), n) for n, t in enumerate(times)])
        within = np.concatenate([np.arange(len(t)) for t in times])
        # Messages with equal times are in the order of the file.
        order = np.lexsort((np.concatenate(rows), np.concatenate(times)))
        for n, k in zip(source[order].tolist(), within[order].tolist(), strict=True):
            key, entries, kind, low = sources[n]
            message = self._read(key, entries, kind, low + k)
            if message is not None:
                yield message

    def all_messages(self, keys: Iterable[str] | None = None) -> Iterator[RecordedMessage]:
        """Yield every message in order."""
        return self.between(self.start_ns - 1, self.end_ns, keys)

    def attachment(self, name: str) -> bytes | None:
        """Return an attachment, None if it is missing."""
        span = self.index.attachments.get(name)
        return None if span is None else self._data[span.offset : span.offset + span.length]

    def _read(self, key: str, entries: Entries, kind: str, row: int) -> RecordedMessage | None:
        chunk, offset = int(entries.chunk[row]), int(entries.offset[row])
        try:
            records = self._data if chunk < 0 else self._chunk(chunk)
            payload = to_wire(kind, read_message(records, offset))
        except RecordingError as error:
            self.damaged[str(error)] += 1
            return None
        return RecordedMessage(time_ns=int(entries.time_ns[row]), key=key, payload=payload)

    def _chunk(self, number: int) -> bytes:
        records = self._cache.get(number)
        if records is None:
            records = unpack_chunk(self._data, self.index.chunks[number])
            self._cache[number] = records
            self._cached += len(records)
            while self._cached > CACHE_BYTES and len(self._cache) > 1:
                _, old = self._cache.popitem(last=False)
                self._cached -= len(old)
        else:
            self._cache.move_to_end(number)
        return records


def _places(entries: Entries, low: int, high: int) -> NDArray[np.int64]:
    """Return sort keys by position in the file."""
    return (entries.chunk[low:high].astype(np.int64) << 32) + entries.offset[low:high]


def file_of(path: Path) -> Path:
    """Return the MCAP file of a path: itself, or the file in a session's folder.

    Raises:
        RecordingError: There is no such file, or there are several.
    """
    if path.is_dir():
        files = sorted(path.glob("*.mcap"))
        if not files:
            raise RecordingError(f"{path} holds no .mcap file")
        if len(files) > 1:
            names = ", ".join(file.name for file in files[:3]) + (", …" if len(files) > 3 else "")
            raise RecordingError(
                f"{path} holds {len(files)} recordings, {names}: name one of them; the parts of a "
                "split bag are joined by `mcap merge`"
            )
        return files[0]
    if not path.exists():
        raise RecordingError(f"there is no {path}")
    return path


def _nothing(path: Path, index: FileIndex) -> str:
    topics = sorted({channel.topic for channel in index.channels.values()})
    if not topics:
        return f"{path} holds no message: the recording ended before its first chunk was written"
    return (
        f"{path} has no topic that can be shown; it has {', '.join(topics[:8])}, and a recording "
        "of a robot has .../camera/color/image_raw/compressed, .../tf or .../status"
    )

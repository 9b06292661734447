"""Reading of a recording: the messages of any time span, in order."""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from app.recording.channels import USUAL, Names, key_of, to_wire
from app.recording.errors import RecordingError
from app.recording.reading.bag_files import files_of
from app.recording.reading.file_index import Entries, FileIndex
from app.recording.reading.stored_file import OpenedFiles, StoredFile, unpack_message
from ippon.frame import NANOSECONDS

WINDOW_NS: Final = 60 * NANOSECONDS
"""Time span of which the order of the messages is computed at once."""
_MOST_NAMED: Final = 20
"""Topics that an error names."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordedMessage:
    """One recorded message."""

    time_ns: int
    """Time of recording, nanoseconds since 1970."""
    key: str
    """Key under the robot's prefix."""
    payload: bytes


@dataclass(frozen=True, slots=True, kw_only=True)
class OtherTopic:
    """A topic of a recording that stands for no key: nothing of it is read."""

    topic: str
    type: str
    messages: int


@dataclass(frozen=True, slots=True, kw_only=True)
class _Source:
    """The messages of one topic in one file."""

    part: int
    """Number of the file."""
    file: StoredFile
    entries: Entries
    topic: str
    type: str


class Recording:
    """An open recording: a file, or the parts of a bag. Not thread-safe: one thread owns it."""

    def __init__(
        self,
        path: Path,
        progress: Callable[[float], None] | None = None,
        names: Names = USUAL,
    ) -> None:
        """Open a file, a session's folder or a bag, and index its messages.

        Args:
            path: The file or folder.
            progress: Called with the share that is indexed.
            names: Topics of a robot that has names of its own.

        Raises:
            RecordingError: There is no file, or it has no known message.
        """
        paths = files_of(path)
        self.path = paths[0]
        self.damaged: Counter[str] = Counter()
        """Number of unreadable messages, by error."""
        self._names = names
        self._sources: dict[str, list[_Source]] = {}
        self.start_ns = self.end_ns = 0
        self._opened = OpenedFiles()
        self._files: list[StoredFile] = []
        self._unreadable: list[str] = []
        try:
            self._open(paths, progress)
            self.index: FileIndex = self._joined_index()
            self._adopt()
        except BaseException:
            self.close()
            raise

    def _open(self, paths: list[Path], progress: Callable[[float], None] | None) -> None:
        for n, path in enumerate(paths):

            def told(share: float, before: int = n) -> None:
                if progress is not None:
                    progress((before + share) / len(paths))

            try:
                self._files.append(self._opened.open(path, told))
            except RecordingError as error:
                if len(paths) == 1:
                    raise
                self._unreadable.append(str(error))
        if not self._files:
            raise RecordingError(self._unreadable[0])

    def _joined_index(self) -> FileIndex:
        """Return the index of the file; of several, what they have in common."""
        if len(self._files) == 1 and not self._unreadable:
            return self._files[0].index
        indexes = [file.index for file in self._files]
        channels = [channel for index in indexes for channel in index.channels.values()]
        return FileIndex(
            channels=dict(enumerate(channels)),
            metadata={name: text for index in indexes for name, text in index.metadata.items()},
            complete=all(index.complete for index in indexes) and not self._unreadable,
            problems=[
                *self._unreadable,
                *(
                    f"{file.path.name}: {text}"
                    for file in self._files
                    for text in file.index.problems
                ),
            ],
        )

    def refresh(self) -> bool:
        """Read what was appended to an unfinished file; return whether there was anything.

        Raises:
            RecordingError: It can no longer be read.
        """
        grown = [file.refresh() for file in self._files]
        if not any(grown):
            return False
        self.index = self._joined_index()
        self._adopt()
        return True

    def _adopt(self) -> None:
        self._sources.clear()
        for part, file in enumerate(self._files):
            for number, entries in file.index.entries.items():
                channel = file.index.channels[number]
                key = key_of(channel.topic, channel.type, channel.metadata, self._names)
                if key is not None and channel.encoding == "cdr" and len(entries.time_ns):
                    source = _Source(
                        part=part,
                        file=file,
                        entries=entries,
                        topic=channel.topic,
                        type=channel.type,
                    )
                    self._sources.setdefault(key, []).append(source)
        times = [source.entries.time_ns for found in self._sources.values() for source in found]
        if not times:
            raise RecordingError(_nothing(self.path, self.index))
        self.start_ns = int(min(one[0] for one in times))
        self.end_ns = int(max(one[-1] for one in times))

    def close(self) -> None:
        """Close the files."""
        for file in self._files:
            file.close()
        self._opened.close()

    @property
    def keys(self) -> tuple[str, ...]:
        """Keys with messages."""
        return tuple(self._sources)

    def topics(self, key: str) -> list[str]:
        """Return the topics whose messages have a key, in the order of their names."""
        return sorted({source.topic for source in self._sources.get(key, ())})

    def others(self) -> tuple[OtherTopic, ...]:
        """Return the topics that stand for no key, by name; those of several files once."""
        counts: Counter[tuple[str, str]] = Counter()
        used = {(one.topic, one.type) for found in self._sources.values() for one in found}
        for file in self._files:
            for number, channel in file.index.channels.items():
                name = channel.topic, channel.type
                if name not in used:
                    counts[name] += _count(file.index, number)
        return tuple(
            OtherTopic(topic=topic, type=kind, messages=n)
            for (topic, kind), n in sorted(counts.items())
        )

    @property
    def duration_s(self) -> float:
        """Time from the first message to the last."""
        return (self.end_ns - self.start_ns) * 1e-9

    def times_ns(self, key: str) -> NDArray[np.int64]:
        """Return the times of the messages of a key, in order."""
        found = [source.entries.time_ns for source in self._sources.get(key, ())]
        return np.sort(np.concatenate(found)) if found else np.empty(0, np.int64)

    def latest(self, key: str, time_ns: int) -> RecordedMessage | None:
        """Return the last readable message of a key up to a time, None before the first."""
        found: RecordedMessage | None = None
        for source in self._sources.get(key, ()):
            times = source.entries.time_ns
            for row in range(int(np.searchsorted(times, time_ns, "right")) - 1, -1, -1):
                if found is not None and times[row] <= found.time_ns:
                    break
                message = self._read(key, source, row)
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
        used = [
            (key, source)
            for key in (self._sources if keys is None else keys)
            for source in self._sources.get(key, ())
        ]
        while (first_ns := _next_ns(used, after_ns)) is not None and first_ns <= until_ns:
            stop_ns = min(first_ns + WINDOW_NS, until_ns)
            yield from self._window(used, after_ns, stop_ns)
            after_ns = stop_ns

    def _window(
        self, used: list[tuple[str, _Source]], after_ns: int, until_ns: int
    ) -> Iterator[RecordedMessage]:
        """Yield the messages of a short span, ordered by time, file and place in the file."""
        rows: list[NDArray[np.int64]] = []
        for n, (_, source) in enumerate(used):
            entries = source.entries
            low, high = np.searchsorted(entries.time_ns, [after_ns, until_ns], "right")
            columns = np.empty((high - low, 5), np.int64)
            columns[:, 0] = entries.time_ns[low:high]
            columns[:, 1] = source.part
            columns[:, 2] = _places(entries, int(low), int(high))
            columns[:, 3] = n
            columns[:, 4] = np.arange(low, high)
            rows.append(columns)
        table = np.concatenate(rows)
        order = np.lexsort((table[:, 2], table[:, 1], table[:, 0]))
        for n, row in table[order, 3:].tolist():
            key, source = used[n]
            message = self._read(key, source, row)
            if message is not None:
                yield message

    def all_messages(self, keys: Iterable[str] | None = None) -> Iterator[RecordedMessage]:
        """Yield every message in order."""
        return self.between(self.start_ns - 1, self.end_ns, keys)

    def attachment(self, name: str) -> bytes | None:
        """Return an attachment, None if it is missing."""
        found = (file.attachment(name) for file in self._files)
        return next((data for data in found if data is not None), None)

    def _read(self, key: str, source: _Source, row: int) -> RecordedMessage | None:
        entries = source.entries
        try:
            data = source.file.message(int(entries.chunk[row]), int(entries.offset[row]))
            payload = to_wire(source.type, unpack_message(data))
        except RecordingError as error:
            self.damaged[str(error)] += 1
            return None
        return RecordedMessage(time_ns=int(entries.time_ns[row]), key=key, payload=payload)


def _places(entries: Entries, low: int, high: int) -> NDArray[np.int64]:
    """Return sort keys by position in the file."""
    return (entries.chunk[low:high].astype(np.int64) << 32) + entries.offset[low:high]


def _next_ns(used: list[tuple[str, _Source]], after_ns: int) -> int | None:
    """Return the time of the first message after a time, None after the last one."""
    found: list[int] = []
    for _, source in used:
        times = source.entries.time_ns
        row = int(np.searchsorted(times, after_ns, "right"))
        if row < len(times):
            found.append(int(times[row]))
    return min(found, default=None)


def _count(index: FileIndex, channel: int) -> int:
    entries = index.entries.get(channel)
    return 0 if entries is None else len(entries.time_ns)


def _nothing(path: Path, index: FileIndex) -> str:
    topics = sorted({f"{one.topic} ({one.type})" for one in index.channels.values()})
    if not topics:
        return f"{path} holds no message: the recording ended before its first chunk was written"
    listed = ", ".join([*topics[:_MOST_NAMED], *(["…"] if len(topics) > _MOST_NAMED else [])])
    return (
        f"{path} has no topic that can be shown; it has {listed}, and a recording "
        "of a robot has .../camera/color/image_raw/compressed, .../tf or .../status"
    )

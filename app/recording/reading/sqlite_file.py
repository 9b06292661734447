"""A file of a rosbag2 folder in SQLite: tables of topics and of messages."""

import sqlite3
from contextlib import ExitStack
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from app.recording.errors import RecordingError
from app.recording.reading.file_index import OUTSIDE_CHUNKS, Entries, FileIndex
from app.recording.reading.mcap_records import Channel

SQLITE_MAGIC: Final = b"SQLite format 3\0"
_ROWS: Final = 50_000
"""Rows of the index that are read at a time."""


class SqliteFile:
    """A .db3 file, as it was when it was opened."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.index = FileIndex(complete=True)
        try:
            with ExitStack() as on_error:
                self._file = _opened(path)
                on_error.callback(self._file.close)
                self._read_index()
                on_error.pop_all()
        except (sqlite3.Error, OverflowError, ValueError) as error:
            raise RecordingError(f"{path} is damaged: {error}") from error

    def _read_index(self) -> None:
        table = self._messages()
        for number, topic, kind, encoding in self._file.execute(
            "SELECT id, name, type, serialization_format FROM topics"
        ):
            self.index.channels[number] = Channel(
                topic=topic, type=kind, encoding=encoding, metadata={}
            )
            own = table[table[:, 0] == number]
            self.index.entries[number] = Entries(
                time_ns=own[:, 1],
                chunk=np.full(len(own), OUTSIDE_CHUNKS, np.int32),
                offset=own[:, 2],
            )

    def _messages(self) -> NDArray[np.int64]:
        """Return (N, 3) topic, time and number of all messages, ordered by time."""
        rows = self._file.execute(
            "SELECT topic_id, timestamp, id FROM messages ORDER BY timestamp, id"
        )
        parts: list[NDArray[np.int64]] = []
        while found := rows.fetchmany(_ROWS):
            parts.append(np.array(found, np.int64))
        return np.concatenate(parts) if parts else np.empty((0, 3), np.int64)

    def refresh(self) -> bool:
        """Return False: what is appended is not read."""
        return False

    def message(self, chunk: int, offset: int) -> bytes:
        """Return the data of a message: see `StoredFile`."""
        assert chunk == OUTSIDE_CHUNKS
        try:
            found = self._file.execute("SELECT data FROM messages WHERE id = ?", (offset,))
            row = found.fetchone()
        except sqlite3.Error as error:
            raise RecordingError(f"a message is damaged: {error}") from error
        if row is None or not isinstance(row[0], bytes):
            raise RecordingError(f"no message has the number {offset}: the index is damaged")
        return row[0]

    def attachment(self, name: str) -> bytes | None:
        """Return None: there are none in SQLite."""
        del name

    def close(self) -> None:
        """Close the file."""
        self._file.close()


def _opened(path: Path) -> sqlite3.Connection:
    """Open a file for reading; with its write-ahead log, where it has one that can be read."""
    address = path.resolve().as_uri()
    file = sqlite3.connect(f"{address}?mode=ro", uri=True, check_same_thread=False)
    try:
        file.execute("SELECT 1 FROM topics").fetchone()
    except sqlite3.OperationalError:
        # On a disk that cannot be written there is no place for the lock of a log.
        file.close()
        file = sqlite3.connect(f"{address}?immutable=1", uri=True, check_same_thread=False)
    except sqlite3.Error:
        file.close()
        raise
    return file

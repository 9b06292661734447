"""Writes messages to an MCAP file that rosbag2 opens; a crash loses at most the last second."""

from collections import Counter
from contextlib import suppress
from pathlib import Path
from typing import IO, Any, Final

import yaml
from mcap.writer import CompressionType, Writer

from app.process.file_lock import hold
from app.recording.channels import KEY, Topic, quality_of_service, to_recorded, topic_of
from app.recording.writing.bag_metadata import write_bag_metadata

FILE_NAME: Final = "session_0.mcap"
CHUNK_BYTES: Final = 1 << 20
CHUNK_S: Final = 0.5
"""Age at which a chunk is closed: a crash loses only the open chunk."""
PROFILE: Final = "ros2"


class SessionWriter:
    """Writes one session into one new folder. One thread owns it."""

    def __init__(self, folder: Path, robot: str) -> None:
        """Make the folder and begin the file.

        Raises:
            OSError: The folder exists already, or cannot be written.
        """
        folder.mkdir(parents=True, exist_ok=False)
        self.folder = folder
        self.path = folder / FILE_NAME
        self._robot = robot
        self._file: IO[bytes] = self.path.open("wb")
        hold(self._file)
        self._mcap = Writer(self._file, chunk_size=CHUNK_BYTES, compression=CompressionType.ZSTD)
        self._mcap.start(profile=PROFILE, library="ippon")
        self._channels: dict[str, tuple[int, Topic]] = {}
        self._schemas: dict[str, int] = {}
        self._counts: Counter[Topic] = Counter()
        self._start_ns: int | None = None
        self._end_ns = 0
        self._open_since: float | None = None

    @property
    def messages(self) -> int:
        """Messages written so far."""
        return self._counts.total()

    @property
    def written_bytes(self) -> int:
        """Size of the file."""
        return self._file.tell()

    @property
    def duration_s(self) -> float:
        """Time from the first message to the last one, seconds."""
        return 0.0 if self._start_ns is None else (self._end_ns - self._start_ns) * 1e-9

    def add(self, key: str, payload: bytes, log_ns: int, now_s: float) -> None:
        """Write one message.

        Args:
            key: Under the robot's prefix.
            payload: Encoded message.
            log_ns: Time of arrival, nanoseconds since 1970.
            now_s: The same time on a monotonic clock.
        """
        channel, topic = self._channel(key)
        if self._open_since is None:
            self._open_since = now_s
        self._mcap.add_message(channel, log_ns, to_recorded(topic, payload), log_ns)
        self._counts[topic] += 1
        self._start_ns = log_ns if self._start_ns is None else min(self._start_ns, log_ns)
        self._end_ns = max(self._end_ns, log_ns)
        self.flush_if_due(now_s)

    def flush_if_due(self, now_s: float) -> None:
        """Close the open chunk when it is old enough."""
        if self._open_since is not None and now_s - self._open_since >= CHUNK_S:
            self.flush()

    def flush(self) -> None:
        """Flush the file."""
        close_chunk(self._mcap)
        self._file.flush()
        self._open_since = None

    def note_metadata(self, name: str, values: dict[str, str]) -> None:
        """Write named values beside the messages."""
        self._mcap.add_metadata(name, values)

    def attach(self, name: str, media_type: str, data: bytes, log_ns: int) -> None:
        """Write a file into the recording."""
        self._mcap.add_attachment(
            create_time=log_ns, log_time=log_ns, name=name, media_type=media_type, data=data
        )

    def close(self) -> None:
        """Write the indexes and `metadata.yaml`."""
        try:
            self._mcap.finish()
        finally:
            self._file.close()
        start_ns = self._start_ns or 0
        write_bag_metadata(self.folder, FILE_NAME, self._counts, start_ns, self._end_ns)

    def abandon(self) -> None:
        """Close a file that can no longer be written."""
        try:
            self._file.close()
        except OSError:
            # After a failed write, closing fails for the same reason.
            return

    def discard(self) -> None:
        """Remove a file that could not be begun or completed, and its folder."""
        self.abandon()
        with suppress(OSError):
            self.path.unlink(missing_ok=True)
            self.folder.rmdir()

    def _channel(self, key: str) -> tuple[int, Topic]:
        known = self._channels.get(key)
        if known is None:
            topic = topic_of(self._robot, key)
            known = self._channels[key] = (register(self._mcap, topic, self._schemas), topic)
        return known


def register(mcap: Writer, topic: Topic, schemas: dict[str, int]) -> int:
    """Register a topic, and its type if new; return the number of the channel."""
    schema = schemas.get(topic.type)
    if schema is None:
        schema = mcap.register_schema(topic.type, "ros2msg", topic.schema.encode())
        schemas[topic.type] = schema
    metadata = {
        "offered_qos_profiles": yaml.safe_dump([quality_of_service(topic)], sort_keys=False),
        "topic_type_hash": topic.type_hash,
        KEY: topic.key,
    }
    return mcap.register_channel(topic.name, "cdr", schema, metadata)


def close_chunk(mcap: Any) -> None:
    """Close the open chunk by a private method, because the library closes chunks by size only."""
    mcap._Writer__finalize_chunk()  # noqa: SLF001

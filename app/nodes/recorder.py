"""The recorder as a process: writes every message of a robot's network to a file, unchanged."""

import logging
import time
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final, TypeVar

import msgspec

from app.links.network.requests import RequestRefusedError
from app.links.network.session import LinkError
from app.messages import keys
from app.messages.control import decode, encode
from app.messages.recording import RecordingStatus, RecordRequest
from app.messages.status import Event, Status
from app.nodes.recorder_network import RecorderNetwork
from app.process.stop_signal import ProcessStopSignal, StopSignal
from app.recording.errors import RecordingError
from app.recording.notes import Note, add_note
from app.recording.writing.limits import RecordingLimits
from app.recording.writing.session import Session
from app.recording.writing.write_queue import QueuedMessage, WriteQueue

logger = logging.getLogger(__name__)

T = TypeVar("T")

STATUS_EVERY_S: Final = 0.5
LIMITS_EVERY_S: Final = 1.0
SILENT_S: Final = 4.0
"""Silence after which the connection is opened again."""
IDLE_S: Final = 0.1
REPLY_S: Final = 5.0


@dataclass(frozen=True, slots=True, kw_only=True)
class RecorderConfig:
    """Endpoint, folder and limits of the recorder."""

    connect: str = "tcp/127.0.0.1:7447"
    robot: str = "ippon"
    root: Path
    """Folder of the sessions."""
    limits: RecordingLimits = field(default_factory=RecordingLimits)
    sensor_hz: float = 2.0
    """Depth images and heatmaps recorded per second of the robot's clock; 0 records all."""
    wait: bool = False
    """Record only on request."""

    def __post_init__(self) -> None:
        """Refuse an invalid prefix or rate."""
        keys.check_prefix(self.robot)
        if not 0.0 <= self.sensor_hz <= 1000.0:
            raise ValueError(
                f"the rate of recorded images lies in 0 to 1000 per second; got {self.sensor_hz:g}"
            )


class Recorder:
    """Writes received messages; the thread that calls `run` owns the file."""

    def __init__(self, config: RecorderConfig) -> None:
        self._config = config
        self._queue = WriteQueue()
        self._network = RecorderNetwork(
            config.connect, config.robot, self._queue.put, self._handle, lambda: self._status
        )
        self._requests: deque[tuple[RecordRequest, Future[RecordingStatus]]] = deque()
        self._session: Session | None = None
        self._began_s = 0.0
        """Monotonic time at which the session began."""
        self._status = RecordingStatus(state="off", text="nothing is recorded")
        self._heard_at = 0.0
        self._last_status = b""
        """The navigator's last status: events have its robot's clock."""
        self._published_at = self._checked_at = 0.0

    def run(self, stop: StopSignal) -> None:
        """Record until stopped.

        Raises:
            LinkError: No navigator answers at the start.
        """
        self._network.open()
        self._heard_at = time.monotonic()
        try:
            if not self._config.wait:
                self._begin()
            while not stop.is_set():
                self._step()
            self._write_waiting(0.0)
        finally:
            self._end("the recorder was stopped")
            self._network.close()

    def _step(self) -> None:
        self._write_waiting(IDLE_S)
        while self._requests:
            request, reply = self._requests.popleft()
            if request.action == "stop":
                # First what came before it; a request that is refused meanwhile ends nothing.
                self._write_waiting(0.0)
            if not reply.set_running_or_notify_cancel():
                continue  # It was refused meanwhile, and is sent again.
            try:
                reply.set_result(self._answer(request))
            except (RecordingError, RequestRefusedError) as error:
                reply.set_exception(RequestRefusedError(str(error)))
        now = time.monotonic()
        self._guarded(lambda session: session.writer.flush_if_due(now))
        if now - self._checked_at >= LIMITS_EVERY_S:
            self._checked_at = now
            self._check_limits()
        if now - self._published_at >= STATUS_EVERY_S:
            self._published_at = now
            self._publish_status()
        if now - self._heard_at > SILENT_S:
            self._reopen()

    # -- the file ----------------------------------------------------------------------------

    def _begin(self) -> None:
        config = self._config
        self._began_s = time.monotonic()
        try:
            self._session = Session(
                config.root, config.robot, config.limits, time.time_ns(), config.sensor_hz
            )
        except OSError as error:
            self._fail(f"a recording cannot be written to {config.root}: {error.strerror}")
            return
        folder = str(self._session.writer.folder)
        self._status = RecordingStatus(state="recording", text="recording", session=folder)
        logger.info("recording %s to %s", config.robot, folder)
        self._network.catch_up()

    def _write_waiting(self, timeout_s: float) -> None:
        """Write all queued messages; wait at most `timeout_s` for the first."""
        for one in self._queue.take(timeout_s):
            self._heard_at = one.now_s
            if one.key == keys.STATUS:
                self._last_status = one.payload
            self._write(one)

    def _write(self, one: QueuedMessage) -> None:
        self._guarded(
            lambda session: session.add(
                one.key, one.payload, self._time_ns(session, one.now_s), one.now_s
            )
        )

    def _time_ns(self, session: Session, now_s: float) -> int:
        """Return a moment as a time of the session, which goes on evenly when the clock is set.

        A robot without a clock of its own has its time set once it finds a network.
        """
        return session.start_ns + round((now_s - self._began_s) * 1e9)

    def _guarded(self, work: Callable[[Session], T]) -> T | None:
        """Use the file; an error of the disk ends the recording, not the recorder."""
        session = self._session
        if session is None:
            return None
        try:
            return work(session)
        except OSError as error:
            self._session = None
            self._network.end_kept()
            session.writer.abandon()
            self._fail(f"the recording ended: {error.strerror} ({session.writer.folder})")
            return None

    def _check_limits(self) -> None:
        # A folder that was removed is noticed here: its open file takes what is written.
        verdict, session = self._guarded(Session.check), self._session
        if verdict is None or session is None:
            return
        if verdict.stop:
            self._end(verdict.text)
            self._announce(f"the recording ended: {verdict.text}")
        elif verdict.text and verdict.text != self._status.warning:
            logger.warning("%s", verdict.text)
        writer = session.writer
        self._status = msgspec.structs.replace(
            self._status,
            seconds=time.monotonic() - self._began_s,
            written_bytes=self._status.written_bytes if verdict.stop else writer.written_bytes,
            messages=writer.messages,
            dropped=session.timeline.dropped,
            warning=verdict.text,
        )

    def _end(self, reason: str) -> None:
        session, self._session = self._session, None
        if session is None:
            return
        self._network.end_kept()
        folder = str(session.writer.folder)
        size, count = session.writer.written_bytes, session.writer.messages
        try:
            session.close()
        except OSError as error:
            session.writer.abandon()
            self._fail(f"the recording could not be ended: {error.strerror} ({folder})")
            return
        self._status = RecordingStatus(
            state="off",
            text=f"not recording: {reason}",
            session=folder,
            seconds=time.monotonic() - self._began_s,
            written_bytes=size,
            messages=count,
            dropped=session.timeline.dropped,
        )
        logger.info("%s: %d messages, %.1f MB; %s", folder, count, size / 1e6, reason)

    def _fail(self, text: str) -> None:
        self._status = RecordingStatus(state="failed", text=text, session=self._status.session)
        logger.error("%s", text)
        self._announce(text)

    # -- requests ----------------------------------------------------------------------------

    def _handle(self, request: RecordRequest) -> RecordingStatus:
        """Answer a request, in the thread of its key, after the writing thread has executed it."""
        reply: Future[RecordingStatus] = Future()
        self._requests.append((request, reply))
        self._queue.wake()
        try:
            return reply.result(timeout=REPLY_S)
        except TimeoutError:
            if not reply.cancel():
                return reply.result()  # It is under way.
            raise RequestRefusedError("the recorder is busy writing; try again") from None

    def _answer(self, request: RecordRequest) -> RecordingStatus:
        if request.action == "start":
            if self._session is None:
                self._begin()
        elif request.action == "stop":
            self._end(f"ended by {request.requester or 'a request'}")
        else:
            self._add_note(request)
        self._publish_status()
        return self._status

    def _add_note(self, request: RecordRequest) -> None:
        session = self._session
        if session is None:
            raise RequestRefusedError("there is no recording for the note; start one first")
        if request.action == "note" and not request.text.strip():
            raise RequestRefusedError("the note is empty")
        note = Note(
            time_ns=self._time_ns(session, time.monotonic()),
            kind="note" if request.action == "note" else "mark",
            text=request.text.strip(),
            author=request.requester,
        )
        add_note(session.writer.path, note)

    # -- the network -------------------------------------------------------------------------

    def _reopen(self) -> None:
        self._network.close()
        # Also without an answer: the next attempt waits as long.
        self._heard_at = time.monotonic()
        try:
            self._network.open()
        except LinkError as error:
            logger.debug("%s", error)
            return
        if self._session is not None:
            self._network.mark_gap()
            # Topics that are published on change alone may have changed meanwhile.
            self._network.catch_up()

    def _publish_status(self) -> None:
        self._network.publish(keys.RECORDING, encode(self._status))

    def _announce(self, text: str) -> None:
        event = Event(stamp_ns=self._stamp_ns(), kind="error", text=text)
        self._network.publish(keys.EVENT, encode(event))

    def _stamp_ns(self) -> int:
        """Return the robot's time as of the last status; 0 where there is none."""
        try:
            return decode(self._last_status or self._network.last(keys.STATUS), Status).stamp_ns
        except msgspec.DecodeError:
            return 0


def run_recorder(config: RecorderConfig) -> None:
    """Record until SIGINT or SIGTERM.

    Raises:
        LinkError: No navigator answers.
    """
    Recorder(config).run(ProcessStopSignal())

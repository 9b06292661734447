"""The playback thread: one session, or two on one timeline."""

import logging
import math
import queue
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future
from pathlib import Path
from typing import Final, Literal, TypeVar

import msgspec

from app.messages import keys
from app.nodes.console.critical_thread import OnFailure, critical_thread
from app.nodes.console.scene.state_feed import StateFeed
from app.nodes.review.player import Emit, Player
from app.nodes.review.session_figures import ReviewSession, opening_s, review_session
from app.process.file_lock import is_held
from app.recording.errors import RecordingError
from app.recording.notes import Note, NoteText, add_note
from app.recording.reading.recording import Recording
from app.view.words import ENGLISH, Words

logger = logging.getLogger(__name__)

_T = TypeVar("_T")

TICK_S: Final = 0.04
MIN_SPEED: Final = 0.25
MAX_SPEED: Final = 16.0
FOLLOW_S: Final = 2.0
"""Interval between checks of a file that is being written."""
IMAGE_S: Final = 5.0
"""Longest time to wait for an image of a moment."""
GROWING_S: Final = 10.0
"""Time without growth after which a file that no recorder holds counts as complete."""
MOST_STEPS: Final = 1_000_000


class ReviewCommand(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Command of the timeline."""

    action: Literal["play", "pause", "seek", "speed", "step", "note", "mark"]
    value: float = 0.0
    """Seconds to seek to, times real time, or frames to step."""
    text: NoteText = ""
    """Text of a note or mark."""


class ReviewState(msgspec.Struct, frozen=True, kw_only=True):
    """State of the playback, sent to every page when it changes."""

    version: int
    """Increases when another recording is shown or its notes change: then request
    `ReviewSession`. That of another review, which a browser keeps pictures of, is another."""
    position_s: float
    playing: bool
    speed: float
    ended: bool = False
    """The end is reached: nothing more can be played."""
    growing: bool = False
    """The recording is still being written."""
    problem: str = ""


class Playback:
    """Owns the recordings; its thread runs all operations in order."""

    def __init__(
        self,
        emits: tuple[Emit, ...],
        state_feed: StateFeed,
        on_failure: OnFailure,
        say: Words = ENGLISH,
        has_room: Callable[[], bool] = lambda: True,
    ) -> None:
        """Create a playback without recordings.

        Args:
            emits: Receivers of the messages of the first and the second session.
            state_feed: Receives `ReviewState`.
            on_failure: Called when a thread has failed.
            say: The words for what was said in the sessions.
            has_room: Whether the receivers keep up; while they do not, nothing is played.
        """
        self._emits, self._say = emits, say
        self._state_feed, self._has_room = state_feed, has_room
        self._work: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()
        self._players: list[Player] = []
        self._playing = False
        self._speed = 1.0
        self._version = 0
        self._unwritten = ""
        """Why the note of the last command was not written."""
        self._unread = ""
        """Why what was recorded meanwhile could not be read at the last check."""
        self._jump_to: float | None = None
        self._steps = 0
        """Images to step after that."""
        self._played_at = 0.0
        """Time up to which was played: that of a jump does not count."""
        self._looked_at = 0.0
        self._grew_at = -math.inf
        self._held = False
        """A recorder was writing one of the recordings at the last check."""
        self._stop = threading.Event()
        self._session = ReviewSession(sessions=[], duration_s=0.0, marks=[], notes=[], problems=[])
        self._thread = critical_thread("playback", self._run, on_failure)

    @property
    def session(self) -> ReviewSession:
        """The sessions that are shown."""
        return self._session

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def close(self) -> None:
        """End."""
        self._stop.set()
        self._work.put(lambda: None)
        self._thread.join(timeout=5.0)
        for player in self._players:
            player.recording.close()

    def show(self, paths: list[Path]) -> None:
        """Replace the shown recordings.

        Raises:
            RecordingError: A recording cannot be shown; the previous ones stay.
        """
        self._in_thread(lambda: self._open(paths)).result()

    def image_at(self, at_s: float, lane: int) -> bytes | None:
        """Return the payload of the camera image at a moment; None if there is none.

        Args:
            at_s: Seconds since the beginning of the recording.
            lane: Session: 0 for the first, 1 for the second.
        """
        try:
            return self._in_thread(lambda: self._image_at(at_s, lane)).result(IMAGE_S)
        except TimeoutError:
            return None

    def _in_thread(self, work: Callable[[], _T]) -> "Future[_T]":
        """Queue work for the playback's thread; a `RecordingError` of it is raised to who waits."""
        done: Future[_T] = Future()

        def run() -> None:
            try:
                done.set_result(work())
            except RecordingError as error:
                done.set_exception(error)

        self._work.put(run)
        return done

    def _image_at(self, at_s: float, lane: int) -> bytes | None:
        if not 0 <= lane < len(self._players):
            return None
        recording = self._players[lane].recording
        last = recording.latest(keys.COLOR, recording.start_ns + round(at_s * 1e9))
        return None if last is None else last.payload

    def command(self, command: ReviewCommand) -> None:
        """Queue a command of a page."""
        self._work.put(lambda: self._do(command))

    def _run(self) -> None:
        self._played_at = time.monotonic()
        while not self._stop.is_set():
            self._do_what_waits()
            now = time.monotonic()
            if self._playing:
                self._advance((now - self._played_at) * self._speed)
            self._played_at = now
            if now - self._looked_at >= FOLLOW_S:
                self._looked_at = now
                self._follow(now)
            self._tell()

    def _do_what_waits(self) -> None:
        """Run the queued commands; of several jumps only the last one, and steps together."""
        waiting: list[Callable[[], None]] = []
        try:
            waiting.append(self._work.get(timeout=TICK_S))
            while True:
                waiting.append(self._work.get_nowait())
        except queue.Empty:
            pass
        for work in waiting:
            work()
        self._jump()

    def _jump(self) -> None:
        position_s, self._jump_to = self._jump_to, None
        if position_s is not None:
            for player in self._players:
                player.seek(position_s)
            self._played_at = time.monotonic()
        steps, self._steps = self._steps, 0
        if steps:
            for player in self._players:
                player.step(steps, jumps=not self._has_room())

    def _open(self, paths: list[Path]) -> None:
        recordings: list[Recording] = []
        try:
            recordings.extend(Recording(path) for path in paths)
        except RecordingError:
            for recording in recordings:
                recording.close()
            raise
        for player in self._players:
            player.recording.close()
        self._players = [
            Player(recording, emit)
            for recording, emit in zip(recordings, self._emits, strict=False)
        ]
        self._playing, self._grew_at = False, -math.inf
        self._unwritten = self._unread = ""
        self._held = self._is_recorded()
        for recording in recordings:
            for problem in () if self._held else recording.index.problems:
                logger.warning("%s: %s; showing what can be read", recording.path, problem)
        self._describe()
        self._jump_to, self._steps = opening_s(self._session), 0

    def _follow(self, now: float) -> None:
        """Read new messages of recordings that are still being written."""
        open_ended = [p for p in self._players if not p.recording.index.complete]
        self._held = self._is_recorded()
        try:
            # Every recording is refreshed, whether an earlier one grew or not.
            grown = [player.refresh() for player in open_ended]
            if any(grown):
                self._grew_at = now
                self._describe()
            self._unread = ""
        except RecordingError as error:
            self._unread = str(error)

    @property
    def _growing(self) -> bool:
        open_ended = any(not p.recording.index.complete for p in self._players)
        return open_ended and (self._held or time.monotonic() - self._grew_at < GROWING_S)

    def _is_recorded(self) -> bool:
        """Return whether a recorder on this machine is writing one of the recordings."""
        try:
            return any(
                not p.recording.index.complete and is_held(p.recording.path) for p in self._players
            )
        except OSError:
            # A file that was removed stays readable while it is open.
            return False

    def _describe(self) -> None:
        self._version = max(self._version + 1, time.time_ns() // 1_000_000)
        self._session = review_session(self._players, self._say)

    def _do(self, command: ReviewCommand) -> None:
        if not self._players:
            return
        self._unwritten = ""
        if command.action not in {"seek", "step"}:
            self._jump()
        match command.action:
            case "play":
                if all(player.ended for player in self._players):
                    self._jump_to = 0.0
                    self._jump()
                self._playing = True
            case "pause":
                self._playing = False
            case "seek":
                self._jump_to, self._steps = command.value, 0
            case "speed":
                self._speed = min(max(command.value, MIN_SPEED), MAX_SPEED)
            case "step":
                self._playing = False
                self._steps += round(min(max(command.value, -MOST_STEPS), MOST_STEPS))
            case "note" | "mark":
                self._note(command)

    def _note(self, command: ReviewCommand) -> None:
        player = self._players[0]
        kind: Literal["note", "mark"] = "note" if command.action == "note" else "mark"
        note = Note(time_ns=player.time_ns, kind=kind, text=command.text.strip(), author="review")
        try:
            add_note(player.recording.path, note)
        except RecordingError as error:
            self._unwritten = str(error)
            return
        self._describe()

    def _advance(self, seconds: float) -> None:
        """Play for a time, or less where the receivers do not keep up.

        A review asks for no message again, so that none may be lost: in short parts none is, also
        after a thread was held up.
        """
        part_s = TICK_S * self._speed
        while seconds > 0.0 and self._has_room():
            for player in self._players:
                player.advance(min(seconds, part_s))
            seconds -= part_s
        if all(player.ended for player in self._players) and not self._growing:
            self._playing = False

    def _tell(self) -> None:
        position = max((player.position_s for player in self._players), default=0.0)
        state = ReviewState(
            version=self._version,
            position_s=round(position, 2),
            playing=self._playing,
            speed=self._speed,
            ended=bool(self._players) and all(player.ended for player in self._players),
            growing=self._growing,
            problem=self._say.said(self._unwritten or self._unread),
        )
        self._state_feed.post(msgspec.json.encode(state))

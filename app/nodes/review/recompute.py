"""Recomputation of a session: the present code on its images, with its goals and new settings."""

import dataclasses
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Final

import msgspec

from app.links.robot_streams.assembler import AssemblerConfig, FrameAssembler, assemble
from app.links.robot_streams.robot_detector import RobotDetector
from app.messages import keys
from app.messages.cdr import MessageError
from app.messages.control import decode, encode
from app.messages.motion import decode_twist
from app.messages.scene import encode_voxels
from app.messages.status import Event, LevelRow, LevelTable, Status, Timings
from app.nodes.navigator.map_publisher import cloud_of, plan_messages
from app.nodes.navigator.status_report import find_report
from app.nodes.review.settings import Settings
from app.recording.errors import RecordingError
from app.recording.reading.recording import RecordedMessage, Recording
from app.recording.writing.limits import RecordingLimits
from app.recording.writing.session import Session
from ippon.errors import FrameRejectedError
from ippon.frame import Frame
from ippon.guidance.language.naming import resolve_object
from ippon.guidance.levels import Guidance, LabelLevel
from ippon.mapping.objects.surface_changes import SurfaceTracker
from ippon.mission.goal import Goal
from ippon.mission.mission import Mission
from ippon.mission.snapshot import Snapshot
from ippon.observation_model import ObservationModels
from ippon.vocabulary import in_words

FUSED: Final = (
    keys.COLOR, keys.CAMERA_INFO, keys.TF, keys.TF_STATIC, keys.DEPTH, keys.DEPTH_RAW, *keys.SEEN,
    keys.CONTACT,
)  # fmt: skip
KEYFRAME_NS: Final = 10_000_000_000
COPIED: Final = (keys.COLOR, keys.CAMERA_INFO, keys.TF, keys.TF_STATIC)
TOLD: Final = (keys.LEVELS, keys.EVENT, keys.STATUS)
SAME_EVENTS: Final = frozenset({"rejected", "cancelled"})
"""Events of the operator that change the map."""


class Recomputation:
    """Recomputation of one session, step by step, in `mission`."""

    def __init__(self, recording: Recording, settings: Settings) -> None:
        """Create the mission of the recomputation.

        Raises:
            RecordingError: The session has no status of a navigator, or a tour of several goals.
        """
        status = recording.first(keys.STATUS)
        if status is None:
            raise RecordingError(f"{recording.path} has no {keys.STATUS} and cannot be recomputed")
        if _has_tour(recording):
            raise RecordingError(
                f"{recording.path} has a search for several objects in one tour, which cannot be "
                "recomputed: the recording has the levels of one of them at a time"
            )
        config = settings.navigator
        mission = config.mission.counted()
        self.mission = Mission(mission, config.profile, config.labels, config.seed)
        if config.observation_model is not None:
            self.mission.voxel_map.set_models(ObservationModels([config.observation_model]))
        self.frames = 0
        """Number of integrated frames."""
        self.refused = 0
        """Number of frames that the map refused."""
        self._recording = recording
        self._settings = settings
        self._status = decode(status.payload, Status)
        self._answered = _answered(recording)
        self._begun_ns = _begun(recording)
        self._operator = [e for e in _events(recording) if e.kind in SAME_EVENTS]
        self._tables: list[LevelTable] = []
        self._goal_id: int | None = None
        self._tracker = SurfaceTracker(self.mission.voxel_map)
        self._stamp_ns = -1
        self._last: Snapshot | None = None
        self._keyframe_ns: int | None = None

    def messages(self) -> Iterator[RecordedMessage]:
        """Yield the messages of the robot and of a navigator with these settings, in order."""
        navigator = self._settings.navigator
        config = AssemblerConfig(camera_clock_offset_s=navigator.camera_clock_offset_s)
        assembler = FrameAssembler(config, RobotDetector(navigator.detector))
        for message in self._recording.all_messages((*FUSED, *TOLD)):
            if message.key in COPIED:
                yield message
            try:
                goal = self.mission.goal
                assembler.detector.ask(
                    self.mission.voxel_map.labels, None if goal is None else goal.object
                )
                self._take(assembler, message)
                frame = assembler.take() if message.key in FUSED else None
            except (MessageError, FrameRejectedError, msgspec.DecodeError, ValueError):
                self.refused += 1
                continue
            if frame is not None:
                before = self.frames
                if not self._answered or frame.stamp_ns in self._answered:
                    for key, payload in self._step(frame, message.time_ns):
                        yield RecordedMessage(time_ns=message.time_ns, key=key, payload=payload)
                if self.frames == before:
                    # A late heatmap belongs to a frame in the map, or is ignored.
                    assembler.forget(frame.stamp_ns)
            late = assembler.take_late()
            if late is not None:
                self.mission.learn(late)

    def _take(self, assembler: FrameAssembler, message: RecordedMessage) -> None:
        payload = message.payload
        match message.key:
            case keys.LEVELS:
                self._tables.append(decode(payload, LevelTable))
            case keys.STATUS:
                self._status = decode(payload, Status)
            case _:
                assemble(assembler, message.key, message.payload)

    def _step(self, frame: Frame, time_ns: int) -> Iterator[tuple[str, bytes]]:
        yield from self._told(frame.stamp_ns)
        try:
            result = self.mission.step(frame)
        except FrameRejectedError:
            self.refused += 1
            return
        self.frames += 1
        yield from self._shown(result.snapshot, time_ns)

    def _told(self, stamp_ns: int) -> Iterator[tuple[str, bytes]]:
        """Apply the operator's actions before this frame."""
        while self._operator and self._operator[0].stamp_ns <= stamp_ns:
            event = self._operator.pop(0)
            if event.kind == "rejected":
                self.mission.goals.reject_find(number=event.find)
            else:
                self.mission.goals.cancel_goal()
        waiting, self._tables = self._tables, []
        for table in waiting:
            new = table.goal_id != self._goal_id
            if new and self._begun_ns.get(table.goal_id, stamp_ns) > stamp_ns:
                # The search began with a later frame.
                self._tables.append(table)
                continue
            yield from self._search(table, new=new)

    def _search(self, table: LevelTable, *, new: bool) -> Iterator[tuple[str, bytes]]:
        labels = self.mission.voxel_map.labels
        levels = self._settings.levels_of(table)
        reasons = {row.label: row.reason for row in table.rows}
        changed = self._settings.levels
        rows = tuple(
            LabelLevel(
                label=label,
                level=levels[label],
                reason="changed for this recomputation" if label in changed else reasons[label],
            )
            for label in labels
            if label in levels
        )
        if len(rows) != len(labels):
            raise RecordingError("the recorded levels have other labels than the configuration")
        guidance = Guidance(
            ooi=table.object, context=table.context, provider=table.provider, rows=rows
        )
        if new:
            self._goal_id = table.goal_id
            named = resolve_object(table.object, labels)
            goal = Goal(
                goal_id=table.goal_id,
                object=table.object,
                display=in_words(table.object),
                context=table.context,
                category=named.category,
            )
            self.mission.goals.set_goal(goal, guidance)
        else:
            self.mission.goals.set_guidance(guidance)
        shown = [LevelRow(label=r.label, level=r.level.text, reason=r.reason) for r in rows]
        yield keys.LEVELS, encode(msgspec.structs.replace(table, rows=shown))

    def _shown(self, snapshot: Snapshot, time_ns: int) -> Iterator[tuple[str, bytes]]:
        stamp = snapshot.stamp_ns
        for event in snapshot.events:
            told = Event(
                stamp_ns=stamp,
                kind=event.kind,  # pyright: ignore[reportArgumentType]
                text=event.text,
                goal_id=self._goal_id,
                find=event.find,
            )
            yield keys.EVENT, encode(told)
        yield keys.MAP_VOXELS, self._voxels(stamp, whole=False)
        if self._keyframe_ns is None or time_ns - self._keyframe_ns >= KEYFRAME_NS:
            self._keyframe_ns = time_ns
            yield keys.MAP_KEYFRAME, self._voxels(stamp, whole=True)
        yield from plan_messages(snapshot, self._last)
        self._last = snapshot
        yield keys.STATUS, encode(self._state(snapshot))

    def _voxels(self, stamp_ns: int, *, whole: bool) -> bytes:
        delta = self._tracker.keyframe() if whole else self._tracker.update()
        self._stamp_ns = max(stamp_ns, self._stamp_ns + 1)
        voxel_m = self.mission.config.map.voxel_size_m
        return encode_voxels(cloud_of(delta, self._stamp_ns, voxel_m))

    def _state(self, snapshot: Snapshot) -> Status:
        find, goal = snapshot.find, snapshot.goal
        return msgspec.structs.replace(
            self._status,
            stamp_ns=snapshot.stamp_ns,
            state=snapshot.state.value,
            why=snapshot.why,
            find=find_report(find, goal) if find is not None and goal is not None else None,
            timings=Timings(),
            frames=self.frames,
            elapsed_s=snapshot.elapsed_s,
            path_length_m=snapshot.path_length_m,
            best_ooi=snapshot.best_ooi,
            explored_m2=snapshot.explored_m2,
            voxel_size_m=self.mission.config.map.voxel_size_m,
            map_revision=self.mission.voxel_map.revision,
            notes=["recomputed"],
        )


def recompute(
    recording: Recording, settings: Settings, root: Path, progress: Callable[[float], None]
) -> Path:
    """Write the session recomputed with these settings; return its folder.

    Args:
        recording: The session.
        settings: Settings of the recomputation.
        root: Folder for the new session.
        progress: Called with the fraction that is done.

    Raises:
        RecordingError: It has no usable frame, or the folder cannot be written.
    """
    work = Recomputation(recording, settings)
    robot = f"{settings.navigator.robot}_recomputed"
    config = dataclasses.replace(settings.navigator, robot=robot)
    try:
        session = Session(root, robot, RecordingLimits(min_free_gb=0.0), time.time_ns())
        try:
            session.add(keys.CONFIGURATION, msgspec.json.encode(config), recording.start_ns, 0.0)
            _write(work, recording, session, progress)
        except BaseException:
            # A part of a session would be listed, and shown, as one.
            session.writer.discard()
            raise
    except OSError as error:
        raise RecordingError(f"cannot write to {root}: {error.strerror}") from error
    return session.writer.folder


def _write(
    work: Recomputation, recording: Recording, session: Session, progress: Callable[[float], None]
) -> None:
    start = recording.start_ns
    for message in work.messages():
        at_s = (message.time_ns - start) * 1e-9
        session.add(message.key, message.payload, message.time_ns, at_s)
        progress(at_s / max(recording.duration_s, 1e-9))
    if not work.frames:
        raise RecordingError(
            f"{recording.path} has no frame: depth images and poses are needed ({work.refused} "
            "parts could not be used)"
        )
    session.close()


def _answered(recording: Recording) -> frozenset[int]:
    """Return the stamps of answered frames, because a slow navigator skips some.

    There are none where goals were sent: while one is in force, no velocity tells of an answer.
    """
    if keys.NAVIGATION_GOAL in recording.keys:
        return frozenset()
    stamps: set[int] = set()
    for message in recording.all_messages((keys.CMD_VEL,)):
        try:
            stamps.add(decode_twist(message.payload).stamp_ns)
        except MessageError:
            # Undecodable commands are skipped.
            continue
    return frozenset(stamps)


def _has_tour(recording: Recording) -> bool:
    for message in recording.all_messages((keys.STATUS,)):
        try:
            if decode(message.payload, Status).tour:
                return True
        except msgspec.DecodeError:
            # A status of another version is skipped.
            continue
    return False


def _events(recording: Recording) -> list[Event]:
    events: list[Event] = []
    for message in recording.all_messages((keys.EVENT,)):
        try:
            events.append(decode(message.payload, Event))
        except msgspec.DecodeError:
            # Events of other versions are skipped.
            continue
    return events


def _begun(recording: Recording) -> dict[int, int]:
    """Return by number of a goal the stamp at which its search began first.

    A search that was under way when the recording began is not among them.
    """
    begun: dict[int, int] = {}
    for event in _events(recording):
        if event.kind == "goal_set" and event.goal_id is not None:
            begun.setdefault(event.goal_id, event.stamp_ns)
    return begun

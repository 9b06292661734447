"""The navigator as a process: frames and requests in, commands and pictures of the search out."""

import logging
import math
import re
import time
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Final

import msgspec
import zenoh

from app.links.language_model.interface import LanguageModelInterface
from app.links.network.latched_topic import LatchedTopic
from app.links.network.sender import Sender
from app.messages import keys
from app.messages.control import (
    Event,
    SegmentationLabels,
    encode,
)
from app.nodes.navigator.command.command_mux import CommandMux
from app.nodes.navigator.command.command_stream import CommandStream
from app.nodes.navigator.config import NavigatorConfig
from app.nodes.navigator.frame_intake import FrameIntake, Stopwatch
from app.nodes.navigator.map_publisher import MapPublisher
from app.nodes.navigator.profile_check import profile_mismatches
from app.nodes.navigator.services.control_service import ControlService
from app.nodes.navigator.services.drive_service import DriveService
from app.nodes.navigator.services.goal_service import GoalService, Operation
from app.nodes.navigator.services.guidance_service import GuidanceService
from app.nodes.navigator.services.preview_service import PreviewService
from app.nodes.navigator.state.goal_queue import GoalQueue
from app.nodes.navigator.state.persistence import SavedState, StatePersistence
from app.nodes.navigator.status_report import StatusReport, proximity_table
from app.process.stop_signal import StopSignal
from ippon.command import Command
from ippon.errors import FrameRejectedError
from ippon.frame import Frame
from ippon.mission.collision_filter import moves_base
from ippon.mission.mission import Mission
from ippon.mission.snapshot import Snapshot

logger = logging.getLogger(__name__)

IDLE_S: Final = 0.05
STATUS_EVERY_S: Final = 0.4
COMPARE_EVERY_S: Final = 5.0
"""How often a robot is compared with its profile."""
_DIGITS: Final = re.compile(r"[\d.]+")
BLIND: Final = "objects are not told apart; the search goes on"


class Navigator:
    """Owns the mission; everything that touches it runs in the thread that calls `run`."""

    def __init__(
        self,
        config: NavigatorConfig,
        session: zenoh.Session,
        model: LanguageModelInterface | None = None,
        kept: SavedState | None = None,
    ) -> None:
        robot = config.robot
        self.config = config
        self._mission = Mission(
            config.mission, config.profile, config.labels, config.seed,
            voxel_map=kept.voxel_map if kept else None, clock=time.monotonic,
        )  # fmt: skip
        self._goals = GoalQueue(config.max_queue)
        self._watch = Stopwatch()
        self._sender = Sender()
        self._stream = CommandStream(session, robot, config.command_hz, config.stale_s)
        self._events = session.declare_publisher(
            f"{robot}/{keys.EVENT}", congestion_control=zenoh.CongestionControl.BLOCK
        )
        self._lease = ControlService(session, robot)
        self._intake = FrameIntake(session, robot, self._report_bad_message)
        self._guidance = GuidanceService(
            session,
            robot,
            config.labels,
            self._goals,
            model=model,
            look_every_s=config.look_every_s,
            put=self._put,
            say=self._say,
            authorize=self._lease.authorize,
        )
        self._goal_service = GoalService(
            session,
            robot,
            self._goals,
            self._guidance,
            wheels=self._stream,
            wake=self._intake.wake,
            authorize=self._lease.authorize,
        )
        self._mux = CommandMux(
            session,
            robot,
            config.profile,
            self._stream,
            config.stale_s,
            refuse=self._lease.refuse_hand,
            on_takeover=lambda: self._goal_service.put(lambda mission: mission.cancel_go_to()),
        )
        self._drive_service = DriveService(
            session,
            robot,
            self._mux,
            self._goal_service.put,
            self._sender,
            self._goals,
            self._lease.authorize,
        )
        self._preview_service = PreviewService(session, robot, self._goals, self._goal_service.put)
        self._map = MapPublisher(
            session, robot, self._mission.voxel_map, config.keyframe_every_s, self._sender
        )
        self._status = LatchedTopic(session, f"{robot}/{keys.STATUS}", self._sender)
        self._labels = LatchedTopic(session, f"{robot}/{keys.LABELS}", self._sender)
        self._proximity = LatchedTopic(session, f"{robot}/{keys.LEVELS}", self._sender)
        self._keyframes = session.declare_queryable(
            f"{robot}/{keys.MAP_KEYFRAME}", self._queue_keyframe
        )
        self._report = StatusReport(config, version("ippon"))
        self._snapshot: Snapshot | None = None
        self._status_at = 0.0
        self._hold_until = 0.0
        self._lost: tuple[str, ...] = ()
        self._mismatches: tuple[str, ...] = ()
        self._compared_at = -math.inf
        self._heatmap_gone = False
        self._blind_since = 0.0
        self._shown_search: object = None
        self._asked_for: SegmentationLabels | None = None
        self._configuration = LatchedTopic(session, f"{robot}/{keys.CONFIGURATION}", self._sender)
        self._configuration.put(msgspec.json.encode(config))
        self._ask_for_labels()
        # Whoever hears this may ask at once: all that is asked for is served by now.
        self._alive = session.liveliness().declare_token(f"{robot}/{keys.NAVIGATOR_ALIVE}")
        self._persistence = (
            StatePersistence(Path(config.keep_map), self._say) if config.keep_map else None
        )
        if kept is not None and kept.requests:
            self._mission.stop()
            for request in kept.requests:
                accepted = self._goal_service.search(request)
                self._guidance.restore(accepted.goal_id, request.levels)
            self._say("stopped", "goals of before are taken up: press Resume to let the robot go")

    def run(self, stop: StopSignal) -> None:
        """Answer frames and requests until stopped."""
        while not stop.is_set():
            self._goal_service.run_queued(self._mission)
            self._map.answer()
            self._start_next_goal()
            self._ask_for_labels()
            self._show_guidance()
            frame = self._intake.take(IDLE_S)
            if frame is not None:
                self._step(frame)
            self._learn_late()
            # While frames wait, a slow step is not the robot's silence.
            if frame is None or self._lost:
                self._watch_streams()
            self._watch_heatmap()
            told = self._watch_lease()
            if frame is not None or told or time.monotonic() - self._status_at > STATUS_EVERY_S:
                self._publish_status()

    def close(self) -> None:
        """Leave the robot standing."""
        self._mux.close()
        self._stream.close()
        self._guidance.close()
        self._sender.close()
        if self._persistence is not None:
            self._persistence.close(self._mission.voxel_map, self._goals)

    # -- a frame -----------------------------------------------------------------------------

    def _step(self, frame: Frame) -> None:
        started = time.perf_counter()
        try:
            self._mission.observe(frame)
        except FrameRejectedError as error:
            self._intake.refuse_frame(str(error), frame.stamp_ns)
            self._stream.give(Command(tilt_rad=frame.tilt_rad), frame.stamp_ns)
            return
        self._intake.accept()
        self._compare(frame)
        self._guidance.look(frame.color)
        by_hand = self._mux.by_hand()
        if by_hand is not None:
            self._mission.go_on_from(by_hand)
        fused = self._watch.lap("map", started)
        result = self._mission.decide(frame)
        self._watch.lap("plan", fused)
        self._watch.lap("step", started)
        snapshot = self._snapshot = result.snapshot
        self._report.planned(snapshot.plan)
        waypoint = self._mission.waypoint
        command = self._mux.follow(
            result.command,
            frame,
            self._mission.voxel_map.arrays(),
            waypoint.xy if waypoint is not None else None,
        )
        if moves_base(result.command) and not moves_base(command):
            self._mission.not_followed()
        self._report.command_given(command)
        answered = self._watch.lap("answer", self._intake.arrived_at)
        self._map.publish(snapshot)
        self._watch.lap("publish", answered)
        self._take_note(snapshot)
        if self._persistence is not None:
            self._persistence.keep(self._mission.voxel_map, self._goals)

    def _compare(self, frame: Frame) -> None:
        """Look now and then whether the robot is what its profile says."""
        now = time.monotonic()
        if now - self._compared_at < COMPARE_EVERY_S:
            return
        self._compared_at = now
        told = {_DIGITS.sub("", text) for text in self._mismatches}
        self._mismatches = profile_mismatches(self.config.profile, frame)
        for text in self._mismatches:
            if _DIGITS.sub("", text) not in told:
                logger.warning("profile %s: %s", self.config.profile.name, text)
                self._say("error", f"robot profile {self.config.profile.name}: {text}")

    def _learn_late(self) -> None:
        """Take in what a slow segmentation has told only now of one older frame."""
        late = self._intake.take_late()
        if late is not None:
            self._mission.learn(late)

    def _take_note(self, snapshot: Snapshot) -> None:
        for event in snapshot.events:
            self._say(event.kind, event.text)
            if event.kind == "confirmed":
                self._hold_until = 0.0
        outcome = snapshot.outcome
        goal, _, _ = self._goals.statuses()
        if outcome is not None and goal is not None and goal.outcome == "active":
            self._goals.conclude(outcome)
            self._hold_until = time.monotonic() + self.config.hold_find_s

    # -- goals and levels --------------------------------------------------------------------

    def _put(self, operation: Operation) -> None:
        self._goal_service.put(operation)

    def _start_next_goal(self) -> None:
        search = self._goals.next(hold=time.monotonic() < self._hold_until)
        if search is None:
            return
        search = self._guidance.fitted(search)
        self._mission.set_goal(search.goal, search.guidance)
        self._report.goal_set(time.monotonic() if search.waited else search.asked_at)
        logger.info("goal %d: %s", search.goal.goal_id, search.goal.display)

    def _ask_for_labels(self) -> None:
        """Tell the segmentation what to tell apart, where that is something else than before."""
        goal = self._mission.goal
        ooi = goal.object if goal is not None else None
        if ooi is None and self._asked_for is not None:
            # After the end of a search its object is looked for on: nothing is gained by a change.
            ooi = self._asked_for.ooi
        request = SegmentationLabels(labels=list(self._mission.voxel_map.labels), ooi=ooi)
        if request != self._asked_for:
            self._asked_for = request
            self._labels.put(encode(request))

    def _show_guidance(self) -> None:
        active = self._goals.active()
        if active is None or active is self._shown_search:
            return
        self._shown_search = active
        self._proximity.put(encode(proximity_table(active, self._mission.rooms.note)))

    # -- streams and status ------------------------------------------------------------------

    def _watch_streams(self) -> None:
        if self._intake.frames == 0:
            return
        lost = self._intake.lost(self.config.lost_s)
        names = tuple(name for name, _ in lost)
        if names and not self._lost:
            self._stream.drop()
            self._say("stream_lost", f"no {', '.join(names)} for {self.config.lost_s:g} s: waiting")
        elif self._lost and not names:
            self._say("stream_back", f"{', '.join(self._lost)} is back")
        self._lost = names

    def _watch_heatmap(self) -> None:
        """Report that the segmentation, which was there, is gone; the search goes on without."""
        now = time.monotonic()
        age_s = self._intake.monitors["heatmap"].age_s()
        image_age_s = self._intake.monitors["colour"].age_s()
        if self._lost:
            self._blind_since = now
        if age_s is None or image_age_s is None or self._lost:
            return
        # Only the time in which there were images counts: a silent robot is another matter.
        silent_s = min(age_s - image_age_s, now - self._blind_since)
        gone = silent_s > self.config.heatmap_lost_s
        if gone and not self._heatmap_gone and self._mission.goal is not None:
            self._heatmap_gone = True
            self._say("stream_lost", f"no heatmap for {age_s:.0f} s: {BLIND}")
        elif self._heatmap_gone and not gone:
            self._heatmap_gone = False
            self._say("stream_back", "heatmap is back")

    def _watch_lease(self) -> bool:
        """Report who holds control now; a hand whose lease is over lets go."""
        news, changed, lost = self._lease.watch()
        for text in news:
            self._say("lease", text)
        if lost:
            self._mux.let_go()
        return changed

    def _publish_status(self) -> None:
        self._status_at = time.monotonic()
        status = self._report.status(
            self._snapshot,
            self._mission,
            goals=self._goals,
            intake=self._intake,
            watch=self._watch,
            lost=self._lost,
            drive=self._mux.status(),
            lease=self._lease.status(),
            notes=(
                *self._guidance.notes(),
                *((f"no heatmap: {BLIND}",) * self._heatmap_gone),
                *(f"robot profile: {text}" for text in self._mismatches),
            ),
        )
        self._goal_service.state = status.state
        self._status.put(encode(status))

    def _queue_keyframe(self, query: zenoh.Query) -> None:
        if self._map.ask(query):
            self._intake.wake()
        else:
            query.drop()

    def _report_bad_message(self, text: str) -> None:
        logger.warning("message skipped: %s", text)
        self._say("bad_message", text)

    def _say(self, kind: str, text: str) -> None:
        snapshot, (goal, _, _) = self._snapshot, self._goals.statuses()
        event = Event(
            stamp_ns=snapshot.stamp_ns if snapshot else 0,
            kind=kind,  # pyright: ignore[reportArgumentType]
            text=text,
            goal_id=goal.goal_id if goal else None,
        )
        payload = encode(event)
        self._sender.put(len(payload), partial(self._events.put, payload))
        logger.info("%s: %s", kind, text)

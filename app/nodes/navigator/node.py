"""The navigator: frames and requests in, commands, map and status out."""

import logging
import time
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Final

import numpy as np
import zenoh

from app.links.language_model.interface import LanguageModelInterface
from app.links.network.sender import Sender
from app.links.robot_streams.robot_detector import RobotDetector
from app.memory.memory_file import memory_path
from app.memory.room_names import room_names_path
from app.messages import keys
from app.nodes.navigator.command.command_stream import CommandStream
from app.nodes.navigator.command.goal_output import GoalOutput
from app.nodes.navigator.config import NavigatorConfig
from app.nodes.navigator.event_publisher import EventPublisher
from app.nodes.navigator.frame_intake import FrameIntake, Stopwatch
from app.nodes.navigator.localization.alignment import in_map_frame
from app.nodes.navigator.localization.map_check import MapCheck
from app.nodes.navigator.localization.pose_tracker import pose_tracker
from app.nodes.navigator.map_publisher import MapPublisher
from app.nodes.navigator.memory_keeper import MemoryKeeper
from app.nodes.navigator.profile_check import ProfileCheck
from app.nodes.navigator.restoration import restore_goals, run_state
from app.nodes.navigator.services.memory_service import MemoryService
from app.nodes.navigator.services.operation_queue import OperationQueue
from app.nodes.navigator.services.request_services import RequestServices, declare_endpoints
from app.nodes.navigator.services.room_service import RoomService
from app.nodes.navigator.state.goal_queue import GoalQueue
from app.nodes.navigator.state.persistence import SavedState, persistence_of
from app.nodes.navigator.state_publisher import StatePublisher
from app.nodes.navigator.status_report import StatusReport
from app.nodes.navigator.stream_conversion import StreamConverter
from app.nodes.navigator.stream_watch import StreamWatch
from app.process.stop_signal import StopSignal
from ippon.command import Command, GoalOutcome
from ippon.errors import FrameRejectedError
from ippon.frame import Frame
from ippon.geometry import Float64Array
from ippon.mission.mission import Mission
from ippon.mission.safe_motion import moves_base
from ippon.mission.snapshot import Snapshot, StepResult
from ippon.observation_model import ObservationModels

logger = logging.getLogger(__name__)

IDLE_S: Final = 0.05
STATUS_EVERY_S: Final = 0.4


class Navigator:
    """Owns the mission; everything that touches the mission runs in the thread that calls `run`."""

    def __init__(
        self,
        config: NavigatorConfig,
        session: zenoh.Session,
        model: LanguageModelInterface | None = None,
        saved: SavedState | None = None,
        T_map_world: Float64Array | None = None,
        robot_notes: Callable[[], tuple[str, ...]] = tuple,
    ) -> None:
        self.config, self._robot_notes = config, robot_notes
        robot = config.robot
        self._T_map_world, self._alignment_note = T_map_world, ""
        self._mission = Mission(
            config.mission, config.profile, config.labels, config.seed,
            voxel_map=saved.voxel_map if saved else None, clock=time.monotonic,
        )  # fmt: skip
        if config.observation_model is not None:
            models = ObservationModels([config.observation_model])
            self._mission.voxel_map.set_models(models)
        self._snapshot: Snapshot | None = None
        self._goals = GoalQueue(config.max_queue)
        self._sender = Sender()
        self._stopwatch = Stopwatch()
        self._report = StatusReport(config, version("ippon"))
        self._events = EventPublisher(session, robot, self._goals, self._sender)
        self._intake = FrameIntake(
            session, robot, self._events.report_bad_message, RobotDetector(config.detector),
            config.camera_clock_offset_s,
        )  # fmt: skip
        self._converter = StreamConverter(session, robot, config.profile, self._intake)
        self._tracker = pose_tracker(session, config, self._intake, self._events)
        self._operations = OperationQueue(self._intake.wake)
        self._stream = CommandStream(
            session, robot, config.command_hz, config.stale_s, self._goal_output(session),
            velocities=config.profile.takes_velocities,
        )  # fmt: skip
        self._services = RequestServices(
            session, config, self._goals, self._stream, operations=self._operations,
            events=self._events, sender=self._sender, model=model,
        )  # fmt: skip
        if self._services.opinions is not None:
            self._mission.opinions.ask = self._services.opinions.ask
        self._streams = StreamWatch(config, self._intake, self._events.report, self._stream.drop)
        self._profile = ProfileCheck(config.profile, self._events.report)
        self._map = self._serve_map(session)
        known = saved and saved.voxel_map
        self._kept = MapCheck(known, self._events.report, config)
        self._memory = self._keep_memory(session, map_was_read=known is not None)
        self._memory_service = self._serve_memory(session)
        self._state = StatePublisher(session, config, self._sender)
        self._state.publish_alignment(np.eye(4) if T_map_world is None else T_map_world)
        self._state.publish_labels(self._mission)
        # Clients may send requests as soon as they see the token: every endpoint is declared.
        self._alive = session.liveliness().declare_token(f"{robot}/{keys.NAVIGATOR_ALIVE}")
        self._persistence = persistence_of(config.keep_map, self._events.report, self._kept.waits)
        restore_goals(
            saved, self._services, self._goals, self._mission, self._events.report,
            resume=config.resume,
        )  # fmt: skip

    def run(self, stop: StopSignal) -> None:
        """Answer frames and requests until stopped."""
        while not stop.is_set():
            self._operations.run_queued(self._mission)
            self._map.answer()
            self._start_next_goal()
            if self._persistence is not None:
                self._persistence.keep_state(self._goals, run_state(self._services, self._mission))
            asked = self._state.publish_labels(self._mission)
            self._intake.assembler.detector.ask(asked.labels, asked.ooi, asked.also)
            self._state.publish_levels(self._goals.active(), self._mission.rooms.text)
            self._converter.check()
            if self._tracker is not None:
                self._tracker.check()
            frame = self._intake.take(IDLE_S)
            if frame is not None:
                self._step(frame)
            self._learn_late_heatmap()
            # While frames wait, a slow step does not count as silence of the robot.
            if frame is None or self._streams.lost:
                self._streams.check_required()
            self._streams.check_heatmap(searching=self._mission.goal is not None)
            lease_changed = self._watch_lease()
            status_due = time.monotonic() - self._state.status_at > STATUS_EVERY_S
            if frame is not None or lease_changed or status_due:
                self._publish_status()

    def close(self) -> None:
        """Stop the robot, end the threads and save the state."""
        self._services.mux.close()
        self._stream.close()
        self._converter.close()
        if self._tracker is not None:
            self._tracker.close()
        self._services.guidance.close()
        self._services.sentences.close()
        if self._services.opinions is not None:
            self._services.opinions.close()
        self._sender.close()
        if self._persistence is not None:
            self._persistence.close(self._mission.voxel_map, self._goals)
        self._memory.close()

    def report_alignment(self, note: str) -> None:
        """Tell the operator how the robot's frame was aligned to the map, or why it was not."""
        self._alignment_note = note
        self._events.report("memory", note)

    # -- a frame -----------------------------------------------------------------------------

    def _step(self, frame: Frame) -> None:
        """Integrate a frame, decide, command, publish."""
        started = time.perf_counter()
        frame = in_map_frame(frame, self._T_map_world)
        if self._kept.check(frame, held=self._mission.operator.held is not None):
            self._mission.operator.stop()
        try:
            self._mission.observe(frame)
        except FrameRejectedError as error:
            self._intake.refuse_frame(str(error), frame.stamp_ns)
            self._stream.give(Command(tilt_rad=frame.tilt_rad), frame.stamp_ns)
            return
        self._intake.accept()
        self._profile.check(frame)
        self._services.guidance.look(frame.color)
        by_hand = self._services.mux.by_hand()
        if by_hand is not None:
            self._mission.motion.resume_from(by_hand, manual=True)
        fused = self._stopwatch.lap("map", started)
        age_s = time.perf_counter() - self._intake.arrived_at
        result = self._mission.decide(frame, age_s)
        self._stopwatch.lap("plan", fused)
        self._stopwatch.lap("step", started)
        self._snapshot = result.snapshot
        self._events.stamp_ns = result.snapshot.stamp_ns
        self._goals.elapsed_s = result.snapshot.elapsed_s
        self._report.planned(result.snapshot.plan)
        self._command(result, frame, time.perf_counter() - self._intake.arrived_at)
        answered = self._stopwatch.lap("answer", self._intake.arrived_at)
        self._map.publish(result.snapshot)
        self._stopwatch.lap("publish", answered)
        self._conclude(result.snapshot)
        self._memory.step(frame, self._mission.search, self._mission.floor_z_m)
        if self._persistence is not None:
            self._persistence.keep_map(self._mission.voxel_map)

    def _command(self, result: StepResult, frame: Frame, age_s: float) -> None:
        """Command what the mission or the operator wants, after the safety filter."""
        waypoint = self._mission.operator.waypoint
        command = self._services.mux.follow(
            result.command,
            frame,
            self._mission.voxel_map.arrays(),
            waypoint,
            age_s,
            self._mission.planned_floor_z_m,
        )
        if moves_base(result.command) and not moves_base(command):
            self._mission.motion.resume_from(Command())
        self._report.command_given(command)

    def _conclude(self, snapshot: Snapshot) -> None:
        """Report the step's events, and end the active goals whose search has an outcome."""
        ended: list[int] = []
        outcome, (goal, _, _) = snapshot.outcome, self._goals.statuses()
        if snapshot.goal is not None and not snapshot.tour:
            self._goals.note_finds(snapshot.goal.goal_id, snapshot.counted, snapshot.rejected)
        if snapshot.tour and snapshot.goal is not None:
            ended = self._goals.follow_tour(snapshot.goal.goal_id, snapshot.tour)
        elif outcome is not None and goal is not None and goal.outcome == "active":
            self._goals.conclude(outcome, goal.goal_id, snapshot.find)
            ended = [goal.goal_id]
        for event in snapshot.events:
            # The end of a search is reported for its goal, which does not lead any more.
            self._events.report(event.kind, event.text, event.goal_id, event.find)
            if event.kind == "confirmed" and self._goals.announced() is None:
                self._services.goals.availability.hold(0.0)
        if ended:
            self._services.goals.availability.hold(self.config.hold_find_s)

    def _learn_late_heatmap(self) -> None:
        """Integrate the heatmap of an earlier frame that a slow segmentation has sent now."""
        late = self._intake.take_late()
        if late is not None:
            self._mission.learn(in_map_frame(late, self._T_map_world))

    def _keep_memory(self, session: zenoh.Session, *, map_was_read: bool) -> MemoryKeeper:
        """Return the memory, with what is kept beside the map; answer requests about rooms."""
        keep_map = self.config.keep_map
        names = room_names_path(Path(keep_map)) if keep_map else None
        rooms = RoomService(self._operations, self._events.report, names, map_was_read=map_was_read)
        self._room_endpoints = declare_endpoints(
            session, self.config.robot, rooms, self._services.authorize
        )
        self._mission.rooms.set_names(rooms.names)
        self._services.hear_of_rooms(rooms)
        path = memory_path(Path(keep_map)) if keep_map else None
        return MemoryKeeper(
            self._mission.voxel_map,
            self.config.robot,
            self._events.report,
            path,
            map_was_read=map_was_read,
            room_names=lambda: rooms.names,
            map_waits=self._kept.waits,
        )

    def _goal_output(self, session: zenoh.Session) -> GoalOutput | None:
        """Return what sends goals to a robot that navigates by itself; None for another robot."""
        navigation = self._mission.navigation
        if navigation is None:
            return None
        follower = navigation.follower

        def report(number: int, outcome: GoalOutcome) -> None:
            self._operations.enqueue(lambda _: follower.report(number, outcome))

        return GoalOutput(session, self.config.robot, report, self._T_map_world)

    def _serve_map(self, session: zenoh.Session) -> MapPublisher:
        """Publish the map, and answer requests for all of it."""
        published, every_s = self._mission.voxel_map, self.config.keyframe_every_s
        publisher = MapPublisher(session, self.config.robot, published, every_s, self._sender)
        publisher.serve(session, self._intake.wake)
        return publisher

    def _serve_memory(self, session: zenoh.Session) -> MemoryService:
        """Answer questions about remembered things; sentences and goals may name them."""
        self._services.sentences.things = lambda: self._memory.instances
        self._services.goals.things = self._services.sentences.things
        return MemoryService(
            session, self.config.robot, self._memory, self._operations,
            self._services.control.authorize,
        )  # fmt: skip

    # -- goals -------------------------------------------------------------------------------

    def _start_next_goal(self) -> None:
        now = time.monotonic()
        started = self._goals.next(now, hold=self._services.goals.availability.holds)
        if not started:
            return
        searches = [self._services.guidance.fitted(search) for search in started]
        first = searches[0]
        if len(searches) > 1:
            self._mission.goals.set_goals([(one.goal, one.guidance) for one in searches])
        else:
            self._mission.goals.set_goal(first.goal, first.guidance)
        self._report.goal_set(now if first.waited else first.asked_at)
        for search in searches:
            self._mission.goals.count_again(search.goal.goal_id, search.counted, search.rejected)
            logger.info("goal %d: %s", search.goal.goal_id, search.goal.display)
        # What an earlier run has judged is not recalled.
        self._memory.begin(*self._mission.goals.running)

    # -- status ------------------------------------------------------------------------------

    def _watch_lease(self) -> bool:
        """Report lease events; return whether the lease's status changed."""
        events, changed, lost = self._services.control.watch()
        for text in events:
            self._events.report("lease", text)
        if lost:
            self._services.mux.let_go()
        return changed

    def _publish_status(self) -> None:
        status = self._report.status(
            self._snapshot,
            self._mission,
            goals=self._goals,
            intake=self._intake,
            watch=self._stopwatch,
            lost=self._streams.lost,
            drive=self._services.mux.status(),
            lease=self._services.control.status(),
            notes=(
                *self._robot_notes(),
                *self._services.guidance.notes(),
                *self._streams.notes(),
                *self._intake.notes(),
                *self._profile.notes(),
                *filter(None, (self._alignment_note, self._memory.problem, self._kept.note)),
            ),
            localization=(self._tracker and self._tracker.problem) or self._kept.problem,
            room_of=self._memory.room_of,
        )
        self._services.goals.state = status.state
        self._services.goals.availability.status = status
        self._state.publish_status(status)

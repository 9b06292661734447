"""Assembles the status message, which is published twice per second and after each step."""

import math
import time
from collections import deque
from collections.abc import Callable, Sequence
from typing import Final

import msgspec

from app.messages.driving import DriveStatus, WalkStatus
from app.messages.lease import LeaseStatus
from app.messages.status import (
    FindAttribute,
    FindReport,
    GoalStatus,
    LevelRow,
    LevelTable,
    MissionState,
    Status,
    Timings,
)
from app.nodes.navigator.config import NavigatorConfig
from app.nodes.navigator.frame_intake import FrameIntake, Stopwatch
from app.nodes.navigator.state.goal_queue import GoalQueue
from app.nodes.navigator.state.planned_search import PlannedSearch
from ippon.command import Command
from ippon.mapping.objects.surface_voxels import N_FREE, N_USED
from ippon.memory.instance import Point
from ippon.mission.goal import Goal
from ippon.mission.mission import Mission
from ippon.mission.search import Search
from ippon.mission.snapshot import Find, Snapshot
from ippon.planning.plan import Plan

PLAN_WINDOW: Final = 50
"""Frames over which truncated plans are counted; if half are truncated, the operator is told."""
STILL = 1e-3
_CAMERA: Final = {"colour", "depth"}
"""Streams whose silence explains a lost pose, and not the other way round."""
GOES_ON = ("looking_around", "searching", "approaching", "manual")


class StatusReport:
    """Assembles the status, and measures the time from a query to the first motion."""

    def __init__(self, config: NavigatorConfig, version: str) -> None:
        self._config = config
        self._version = version
        self._since = 0.0
        self._first_command_at: float | None = None
        self.first_motion_s: float | None = None
        self._last_tilt: float | None = None
        self._plan: Plan | None = None
        self._cut_short: deque[bool] = deque(maxlen=PLAN_WINDOW)

    def goal_set(self, since: float) -> None:
        """Start measuring the time to first motion of a goal requested at a monotonic time."""
        self._since = since
        self.first_motion_s = None

    def command_given(self, command: Command) -> None:
        """Record a command, for the time from query to first motion.

        Time before the robot's first command does not count.
        """
        now = time.monotonic()
        self._first_command_at = self._first_command_at or now
        turned = self._last_tilt is not None and abs(command.tilt_rad - self._last_tilt) > STILL
        moves = abs(command.linear_m_s) > STILL or abs(command.yaw_rate_rad_s) > STILL or turned
        self._last_tilt = command.tilt_rad
        if moves and self.first_motion_s is None and self._since > 0.0:
            self.first_motion_s = now - max(self._since, self._first_command_at)

    def planned(self, plan: Plan | None) -> None:
        """Record the latest plan; a plan that was recorded before counts once."""
        if plan is not None and plan is not self._plan:
            self._cut_short.append(plan.cut_short)
        self._plan = plan

    def status(
        self,
        snapshot: Snapshot | None,
        mission: Mission,
        *,
        goals: GoalQueue,
        intake: FrameIntake,
        watch: Stopwatch,
        lost: Sequence[tuple[str, float | None]],
        drive: DriveStatus,
        lease: LeaseStatus,
        notes: tuple[str, ...] = (),
        localization: str = "",
        room_of: Callable[[Point], str] = lambda _: "",
    ) -> Status:
        """Return the current status."""
        active, queue, history = goals.statuses()
        state, why = _state(snapshot, mission, lost, intake, localization)
        return Status(
            robot=self._config.robot,
            version=self._version,
            stamp_ns=snapshot.stamp_ns if snapshot else 0,
            wall_ns=time.time_ns(),
            state=state,
            why=why,
            goal=active and with_room(active, room_of),
            queue=queue,
            history=[with_room(goal, room_of) for goal in history],
            find=_find(snapshot, mission),
            streams=[monitor.status() for monitor in intake.monitors.values()],
            timings=Timings(
                step_ms=watch.median_ms("step"),
                map_ms=watch.median_ms("map"),
                plan_ms=watch.median_ms("plan"),
                publish_ms=watch.median_ms("publish"),
                frame_age_ms=watch.median_ms("answer"),
                first_motion_s=self.first_motion_s,
            ),
            frames=intake.frames,
            elapsed_s=elapsed_s_of(active, snapshot),
            path_length_m=snapshot.path_length_m if snapshot else 0.0,
            best_ooi=snapshot.best_ooi if snapshot else 0.0,
            explored_m2=mission.voxel_map.explored_m2(),
            surface_voxels=_surface_voxels(mission),
            voxel_size_m=mission.config.map.voxel_size_m,
            map_revision=mission.voxel_map.revision,
            notes=[*notes, *self._slow_planning()],
            drive=drive,
            lease=lease,
            tour=[with_room(goal, room_of) for goal in goals.tour()],
            walk=_walk(snapshot) if state in GOES_ON else None,
            localization=localization or intake.refused,
        )

    def _slow_planning(self) -> tuple[str, ...]:
        budget_s, often = self._config.mission.planner.step_budget_s, sum(self._cut_short)
        if budget_s is None or 2 * often < PLAN_WINDOW:
            return ()
        text = (
            f"planning exceeded its {1e3 * budget_s:g} ms in {often} of the last {PLAN_WINDOW} "
            "frames: this machine is slow or busy, and fewer viewpoints are evaluated"
        )
        return (text,)


def elapsed_s_of(goal: GoalStatus | None, snapshot: Snapshot | None) -> float:
    """Return the time since the search began, or its duration if it has ended."""
    if goal is not None and goal.took_s is not None:
        return goal.took_s
    return snapshot.elapsed_s if snapshot else 0.0


def _state(
    snapshot: Snapshot | None,
    mission: Mission,
    lost: Sequence[tuple[str, float | None]],
    intake: FrameIntake,
    localization: str,
) -> tuple[MissionState, str]:
    if mission.state.value == "stopped":
        return "stopped", "stopped: press Resume to continue"
    if lost and intake.ended:
        return "ended", intake.ended
    if lost and localization and not _CAMERA & {name for name, _ in lost}:
        return "lost", localization
    if lost:
        silent = ", ".join(f"{name} ({age_s or 0.0:.1f} s)" for name, age_s in lost)
        return "lost", f"waiting for {silent}"
    if intake.refused:
        return "lost", f"frames are refused: {intake.refused}"
    if snapshot is None:
        if intake.frames == 0 and intake.camera_refused:
            return "starting", f"camera info is refused: {intake.camera_refused}"
        if intake.frames == 0 and localization:
            return "starting", localization
        if intake.frames == 0:
            missing = intake.assembler.missing()
            return "starting", f"waiting for the robot's {missing or 'first frame'}"
        return "starting", "waiting"
    return mission.state.value, snapshot.why


def _walk(snapshot: Snapshot | None) -> WalkStatus | None:
    walk = None if snapshot is None else snapshot.walk
    if walk is None:
        return None
    return WalkStatus(
        step=walk.step.value,
        turn_deg=round(math.degrees(walk.turn_rad)),
        walk_m=round(walk.walk_m, 1),
        way_m=round(walk.way_m, 1),
        look_up_deg=round(math.degrees(walk.look_up_rad)),
    )


def _find(snapshot: Snapshot | None, mission: Mission) -> FindReport | None:
    """Return the find of the present search, of a tour the one announced last."""
    tour = mission.goals.tour
    if tour is not None:
        one = tour.announced
        return None if one is None else _report(one, one.find)
    if snapshot is None or mission.search is None:
        return None
    return _report(mission.search, snapshot.find)


def _report(search: Search, find: Find | None) -> FindReport | None:
    if find is None:
        return None
    report = find_report(find, search.goal)
    return msgspec.structs.replace(report, perhaps=search.is_reconsidered(find))


def _surface_voxels(mission: Mission) -> int:
    tally = mission.voxel_map.surface.tally
    return int(tally[N_USED] - 1 - tally[N_FREE])


def find_report(find: Find, goal: Goal) -> FindReport:
    """Return a find as the status reports it."""
    return FindReport(
        goal_id=goal.goal_id,
        number=find.number,
        stamp_ns=find.stamp_ns,
        object=goal.object,
        position_world=find.position_world,
        size_m=find.size_m,
        probability=find.probability,
        voxels=find.voxels,
        box_px=find.box_px,
        out_of_reach_m=find.out_of_reach_m,
        attributes=[
            FindAttribute(
                value=one.text, kind=one.kind, verdict=one.verdict, by=one.by, seen=one.seen
            )
            for one in find.attributes
        ],
    )


def with_room(goal: GoalStatus, room_of: Callable[[Point], str]) -> GoalStatus:
    """Return a goal with the rooms of its finds."""
    if goal.position_world is None and not goal.counted:
        return goal
    return msgspec.structs.replace(
        goal,
        room="" if goal.position_world is None else room_of(goal.position_world),
        counted=[
            msgspec.structs.replace(one, room=room_of(one.position_world)) for one in goal.counted
        ],
    )


def level_table(search: PlannedSearch, rooms: str = "") -> LevelTable:
    """Return the levels of a search and their origin, with how said rooms are used, if any."""
    guidance = search.guidance
    return LevelTable(
        goal_id=search.goal.goal_id,
        object=guidance.ooi,
        context=guidance.context,
        provider=guidance.provider,
        elapsed_ms=search.elapsed_ms,
        rows=[
            LevelRow(label=row.label, level=row.level.text, reason=row.reason)
            for row in guidance.rows
        ],
        notes=[*filter(None, [rooms]), *guidance.notes],
        asking=search.asking,
        from_cache=search.from_cache,
        prompt=search.prompt,
        reply=search.reply,
    )

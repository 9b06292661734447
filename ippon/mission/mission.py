"""One search after another on one map: the loop of the paper.

A frame goes in, a command comes out. The map fuses the frame (Sec. Object Probability Mapping), the
levels of the goal colour it (Sec. Semantic Guidance), the planner weighs gain against travel time
(Sec. Informative Path Planning), and the search ends in front of the object.
"""

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ippon.command import Command
from ippon.control.drive import DriveMode
from ippon.control.follower import FollowerConfig, PathFollower
from ippon.control.safety import filter_command
from ippon.frame import Frame
from ippon.geometry import Float64Array, yaw_of
from ippon.guidance.levels import Guidance, LevelProbabilities
from ippon.guidance.room_levels import RoomLevels
from ippon.guidance.rooms import RoomConfig
from ippon.mapping.arrays import MapArrays
from ippon.mapping.voxel_map import MapConfig, VoxelMap
from ippon.mission.clusters import OoiVoxels, cluster_finds
from ippon.mission.explanation import explain
from ippon.mission.finding import LOOKED_AT_RADIUS_M, distance_m, looked_at, nearest_find
from ippon.mission.goal import Goal
from ippon.mission.inspection import Preview, with_levels
from ippon.mission.look_around import LookAround, LookAroundConfig
from ippon.mission.recovery import NANOSECONDS, Recovery, RecoveryConfig
from ippon.mission.snapshot import Find, MissionEvent, MissionState, Snapshot, StepResult
from ippon.mission.termination import termination_voxels
from ippon.mission.travel_pitch import TravelPitch, TravelPitchConfig
from ippon.mission.waypoint import Steerable, Waypoint, way_length
from ippon.planning.interface import Planner
from ippon.planning.plan import NodeKind, Plan
from ippon.planning.planner import PlannerConfig, ViewpointPlanner
from ippon.planning.regions import RegionWeights
from ippon.robot import RobotProfile

WAITING = "waiting for a goal"
HELD_TEXT = {
    MissionState.STOPPED: "stopped: press Resume to go on",
    MissionState.PAUSED: "paused",
}
DRIVE_TEXT = {
    DriveMode.AUTO: "the robot drives by itself again",
    DriveMode.ASSISTED: "the operator drives, with the planner's help",
    DriveMode.MANUAL: "the operator drives",
}
MIN_HORIZON_S, MAX_HORIZON_S = 0.1, 0.5
"""A command holds until the next frame; the last interval tells how long that is, within these."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionConfig:
    """Everything that decides how a search goes."""

    map: MapConfig = field(default_factory=MapConfig)
    levels: LevelProbabilities = field(default_factory=LevelProbabilities)
    rooms: RoomConfig = field(default_factory=RoomConfig)
    planner: PlannerConfig = field(default_factory=PlannerConfig)
    follower: FollowerConfig = field(default_factory=FollowerConfig)
    look_around: LookAroundConfig = field(default_factory=LookAroundConfig)
    travel_pitch: TravelPitchConfig = field(default_factory=TravelPitchConfig)
    recovery: RecoveryConfig = field(default_factory=RecoveryConfig)
    confirm_steps: int = 3
    """Frames that must agree in front of the object before it counts as found; more frames stop
    fewer searches at the wrong thing and take longer."""
    exhausted_steps: int = 15
    """Frames in a row without anything left to see before the search ends as exhausted."""


@dataclass(slots=True, kw_only=True)
class _Search:
    """One goal and how far it is."""

    goal: Goal
    guidance: Guidance
    started_ns: int | None = None
    path_length_m: float = 0.0
    arrived_steps: int = 0
    empty_steps: int = 0
    find: Find | None = None

    def elapsed_s(self, stamp_ns: int) -> float:
        return 0.0 if self.started_ns is None else (stamp_ns - self.started_ns) / NANOSECONDS


class Mission:
    """Owns the map, the planner and the goal; takes frames one by one.

    Another `planner` may take the place of the paper's, for comparison with other methods.
    """

    def __init__(
        self,
        config: MissionConfig,
        robot: RobotProfile,
        labels: Sequence[str],
        seed: int,
        planner: Planner | None = None,
    ) -> None:
        self.config = config
        self.robot = robot
        self.voxel_map = VoxelMap(config.map, labels)
        self._rooms = RoomLevels(config.rooms) if config.rooms.enabled else None
        self._planner: Planner = planner or ViewpointPlanner(config.planner, robot, seed)
        self._follower = PathFollower(config.follower, robot)
        self._look_around = LookAround(config.look_around, robot)
        self._travel_pitch = TravelPitch(config.travel_pitch, robot)
        self._recovery = Recovery(config.recovery, robot)
        self._ooi_voxels = OoiVoxels(config.planner.ooi_threshold)
        self._search: _Search | None = None
        self._state = MissionState.STARTING
        self._held: MissionState | None = None
        self._drive = DriveMode.AUTO
        self._waypoint: Waypoint | None = None
        self._events: list[MissionEvent] = []
        self._candidates: tuple[Find, ...] = ()
        self._plan: Plan | None = None
        self._last: Frame | None = None
        self._why = WAITING

    # -- what the operator may do between two steps ------------------------------------------

    @property
    def goal(self) -> Goal | None:
        """What is searched for, or was found last."""
        return self._search.goal if self._search else None

    @property
    def state(self) -> MissionState:
        """What the robot is doing."""
        by_hand = self._waypoint is not None or self._drive is DriveMode.MANUAL
        return self._held or (MissionState.MANUAL if by_hand else self._state)

    @property
    def waypoint(self) -> Waypoint | None:
        """Where the operator sends the robot, until it is there."""
        return self._waypoint

    def set_goal(self, goal: Goal, guidance: Guidance) -> None:
        """Search for another object; map and tree stay.

        Raises:
            ValueError: The guidance does not speak of this map's labels, in their order.
        """
        self._check_guidance(guidance)
        self._search = _Search(goal=goal, guidance=guidance)
        self.voxel_map.set_ooi(goal.object)
        self._ooi_voxels.forget()
        self._state = MissionState.SEARCHING if self._look_around.done else MissionState.STARTING
        self._why = f"starting the search for {goal.display}"
        self.set_guidance(guidance)
        self._note("goal_set", f"searching for {goal.display}")

    def set_guidance(self, guidance: Guidance) -> None:
        """Take other levels for the present goal: an answer came, or the operator changed one.

        Raises:
            ValueError: There is no goal, or the guidance does not speak of this map's labels, in
                their order.
        """
        self._check_guidance(guidance)
        if self._search is None:
            raise ValueError("levels belong to a goal, and there is none; set a goal first")
        self._search.guidance = guidance
        goal = self._search.goal
        probabilities = self.config.levels.as_array()
        self.voxel_map.set_levels(guidance.levels(), probabilities)
        if self._rooms is not None:
            self._rooms.set_guidance(guidance)
        self._planner.set_goal(
            probabilities=probabilities,
            termination_min=termination_voxels(
                goal.object, goal.category, self.config.map.voxel_size_m
            ),
        )

    def cancel_goal(self) -> None:
        """Search for nothing; the robot stays where it is."""
        over = self._state in (MissionState.FOUND, MissionState.EXHAUSTED)
        if self._search is not None and not over:
            self._note("cancelled", f"the search for {self._search.goal.display} was cancelled")
        self._search = None
        self._plan = None
        self._state = MissionState.STARTING
        self._why = WAITING

    def reject_find(self) -> bool:
        """Take the operator's word that the find is something else, and search on.

        Returns:
            Whether there was a find to reject.
        """
        if self._search is None or self._state is not MissionState.FOUND:
            return False
        find, self._search.find = self._search.find, None
        if find is not None:
            radius = 0.5 * math.hypot(*find.size_m) + 0.2
            self.voxel_map.suppress_ooi(np.array(find.position_world), radius)
        elif self._last is not None:
            # No voxels are left to point at: what the robot looks at is what it took for it.
            self.voxel_map.suppress_ooi(looked_at(self._last), LOOKED_AT_RADIUS_M)
        display = self._search.goal.display
        self._note("rejected", f"not the {display}: searching on")
        self._search.arrived_steps = self._search.empty_steps = 0
        self._state = MissionState.SEARCHING
        self._why = f"searching on for {display}"
        return True

    def confirm_find(self) -> bool:
        """Take the operator's word that the find is the object.

        Returns:
            Whether there was a find to confirm.
        """
        if self._search is None or self._state is not MissionState.FOUND:
            return False
        self._note("confirmed", f"{self._search.goal.display}: confirmed by the operator")
        return True

    def stop(self) -> None:
        """Hold still until `resume`, whatever happens."""
        if self._held is not MissionState.STOPPED:
            self._note("stopped", "stopped by the operator")
        self._held = MissionState.STOPPED

    def pause(self) -> None:
        """Hold still until `resume`; a stop is more and stays."""
        self._held = self._held or MissionState.PAUSED

    def resume(self) -> None:
        """Go on after `stop` or `pause`."""
        if self._held is not None:
            self._note("resumed", "the search goes on")
        self._held = None

    def drive(self, mode: DriveMode) -> None:
        """Say who drives; map and tree go on growing, and Auto goes on from wherever it is."""
        if mode is not self._drive:
            self._note("drive", DRIVE_TEXT[mode])
        self._drive = mode
        self._waypoint = None

    def go_to(self, xy: tuple[float, float]) -> float | None:
        """Go to a point on the floor first, then on with what the mode says.

        Args:
            xy: World x and y, metres.

        Returns:
            Length of the way in metres; None, and nothing changes, when there is no way.
        """
        frame = self._last
        if frame is None:
            return None
        # The floor as of this frame: without a goal the planner has not looked at it yet.
        self._planner.step(self.voxel_map.arrays(), frame.T_world_base, frame.tilt_rad)
        way = self._way_to(xy, frame)
        if way is None:
            return None
        self._waypoint = Waypoint(xy=xy)
        self._note("drive", f"going to a point {way_length(way):.1f} m away")
        return way_length(way)

    def set_regions(self, regions: RegionWeights | None) -> bool:
        """Weigh parts of the floor as the operator painted them, for every goal until changed.

        Returns:
            Whether the planner takes such wishes.
        """
        if not isinstance(self._planner, Steerable):
            return False
        self._planner.set_regions(regions)
        return True

    def preview(self, guidance: Guidance) -> Preview | None:
        """Tell what would be chosen next with other levels; nothing changes by it.

        Returns:
            Both choices in words; None when there is no plan, or the planner cannot tell.

        Raises:
            ValueError: The guidance does not speak of this map's labels, in their order.
        """
        self._check_guidance(guidance)
        search, plan = self._search, self._plan
        if search is None or plan is None or not isinstance(self._planner, Steerable):
            return None
        target = self._planner.preview(with_levels(self.voxel_map, guidance.levels()))
        then = dataclasses.replace(plan, target=target)
        return Preview(
            now=explain(plan, self.voxel_map, search.goal, search.guidance),
            then=explain(then, self.voxel_map, search.goal, guidance),
            before=plan.target,
            after=target,
        )

    def cancel_go_to(self) -> None:
        """Go to no point any more."""
        self._waypoint = None

    # -- one step ----------------------------------------------------------------------------

    def step(self, frame: Frame) -> StepResult:
        """Fuse a frame and decide what to do next.

        Raises:
            FrameRejectedError: The frame contradicts itself or the map; nothing has changed.
        """
        self.observe(frame)
        return self.decide(frame)

    def observe(self, frame: Frame) -> None:
        """Fuse a frame: the first half of `step`.

        Raises:
            FrameRejectedError: The frame contradicts itself or the map; nothing has changed.
        """
        self.voxel_map.integrate(frame)

    def decide(self, frame: Frame) -> StepResult:
        """Decide what to do next, after `observe` of the same frame: the second half of `step`."""
        dt_s = self._travelled(frame)
        self._update_candidates(frame)
        wanted = self._act(frame, dt_s)
        # The command before the filter: a robot that is kept from driving is stuck, too.
        own = self._drive is DriveMode.AUTO or self._waypoint is not None
        self._recovery.watch(
            frame.stamp_ns, frame.T_world_base, wanted if own else Command(tilt_rad=frame.tilt_rad)
        )
        command, reason = self._without_collision(wanted, frame, dt_s)
        snapshot = self._snapshot(frame, reason)
        self._events = []
        return StepResult(command=command, snapshot=snapshot)

    def _without_collision(
        self, command: Command, frame: Frame, dt_s: float
    ) -> tuple[Command, str | None]:
        """Keep a command from driving the body into what the map knows."""
        if command.linear_m_s == command.yaw_rate_rad_s == 0.0:
            return command, None
        horizon_s = min(max(dt_s, MIN_HORIZON_S), MAX_HORIZON_S)
        arrays = self.voxel_map.arrays()
        safe, reason = filter_command(command, frame.T_world_base, self.robot, arrays, horizon_s)
        stands = safe.linear_m_s == safe.yaw_rate_rad_s == 0.0
        if stands and self._state is MissionState.LOOKING_AROUND:
            # There is no room to turn: to wait for it would take for ever.
            self._look_around.skip()
        return safe, reason

    def _act(self, frame: Frame, dt_s: float) -> Command:
        search = self._search
        over = self._state in (MissionState.FOUND, MissionState.EXHAUSTED)
        idle = (search is None or over) and self._waypoint is None
        if self._held is not None or idle:
            return Command(tilt_rad=frame.tilt_rad)
        if self._recovery.blocked(frame.stamp_ns, frame.T_world_base, frame.contact):
            self._note("contact", "blocked: marking what is ahead and backing off")
            self._planner.mark_contact(frame.T_world_base)
        plan = self._plan = self._planner.step(
            self._guided(frame), frame.T_world_base, frame.tilt_rad
        )
        if self._drive is DriveMode.MANUAL and self._waypoint is None:
            self._why = "you drive; the map goes on growing"
            return Command(tilt_rad=frame.tilt_rad)
        freeing = self._recovery.command(frame.stamp_ns, frame.tilt_rad)
        if freeing is not None:
            return freeing
        if self._waypoint is not None or search is None:
            return self._go_on(frame, plan, dt_s)
        if _ends_the_search(plan):
            self._look_around.skip()
        if not self._look_around.done:
            self._state = MissionState.LOOKING_AROUND
            self._why = f"looking around ({self._look_around.progress:.0%})"
            return self._look_around.step(yaw_of(frame.T_world_base), frame.tilt_rad)
        return self._pursue(search, frame, plan, dt_s)

    def _pursue(self, search: _Search, frame: Frame, plan: Plan, dt_s: float) -> Command:
        """Follow the plan, and end the search where it says so."""
        search.empty_steps = search.empty_steps + 1 if plan.exhausted else 0
        if search.empty_steps >= self.config.exhausted_steps:
            self._conclude(
                MissionState.EXHAUSTED,
                f"{search.goal.display} not found: everything reachable was seen",
            )
            return Command(tilt_rad=frame.tilt_rad)
        approaching = _ends_the_search(plan)
        self._state = MissionState.APPROACHING if approaching else MissionState.SEARCHING
        self._why = explain(plan, self.voxel_map, search.goal, search.guidance)
        command = self._follower.step(
            plan, frame.T_world_base, frame.tilt_rad, self.voxel_map.arrays(), dt_s
        )
        arrived = approaching and self._follower.reached
        search.arrived_steps = search.arrived_steps + 1 if arrived else 0
        if search.arrived_steps >= self.config.confirm_steps:
            search.find = nearest_find(self._candidates, frame.T_world_base)
            self._conclude(MissionState.FOUND, _found_text(search, frame.T_world_base))
            return Command(tilt_rad=command.tilt_rad)
        if command.linear_m_s > 0.05 and not approaching:
            sweep = self._travel_pitch.tilt(search.elapsed_s(frame.stamp_ns))
            return dataclasses.replace(command, tilt_rad=sweep)
        return command

    def _guided(self, frame: Frame) -> MapArrays:
        """Return the map as it guides the planner: by the type of room, where that is asked for."""
        if self._rooms is None:
            return self.voxel_map.arrays()
        floor_z_m = float(frame.T_world_base[2, 3])
        return self._rooms.follow(self.voxel_map, frame.stamp_ns, floor_z_m)

    def _go_on(self, frame: Frame, plan: Plan, dt_s: float) -> Command:
        """Drive on to the operator's point; there, or without a way, it is done with."""
        waypoint, way = self._waypoint, None
        if waypoint is not None:
            way = self._way_to(waypoint.xy, frame)
        if waypoint is None or way is None:
            self._end_waypoint("there is no way to the point any more")
            return Command(tilt_rad=frame.tilt_rad)
        self._plan = waypoint.plan(plan, frame.T_world_base, way)
        self._why = f"going to your point, {way_length(way):.1f} m"
        command = self._follower.step(
            self._plan, frame.T_world_base, frame.tilt_rad, self.voxel_map.arrays(), dt_s
        )
        if self._follower.reached:
            self._end_waypoint("at the point that you chose")
        return command

    def _end_waypoint(self, text: str) -> None:
        self._waypoint = None
        self._why = text
        self._note("drive", text)

    def _way_to(self, xy: tuple[float, float], frame: Frame) -> Float64Array | None:
        if not isinstance(self._planner, Steerable):
            return None
        return self._planner.way_to(frame.T_world_base, np.array(xy))

    def _conclude(self, state: MissionState, why: str) -> None:
        self._state = state
        self._why = why
        self._note(state.value, why)

    # -- book-keeping ------------------------------------------------------------------------

    def _check_guidance(self, guidance: Guidance) -> None:
        labels = tuple(row.label for row in guidance.rows)
        if labels != self.voxel_map.labels:
            raise ValueError(
                f"guidance speaks of {len(labels)} labels, the map of "
                f"{len(self.voxel_map.labels)}, or in another order"
            )

    def _travelled(self, frame: Frame) -> float:
        """Take note of the robot's way; returns the seconds since the frame before."""
        last, self._last = self._last, frame
        search = self._search
        if search is not None:
            if search.started_ns is None:
                search.started_ns = frame.stamp_ns
            elif last is not None and frame.stamp_ns < last.stamp_ns:
                # The robot's clock started anew: the search keeps the age that it had.
                search.started_ns += frame.stamp_ns - last.stamp_ns
        if last is None:
            return 1e-3
        if search is not None and self._state is not MissionState.FOUND:
            moved = frame.T_world_base[:3, 3] - last.T_world_base[:3, 3]
            search.path_length_m += float(np.linalg.norm(moved))
        return max(1e-3, (frame.stamp_ns - last.stamp_ns) / NANOSECONDS)

    def _update_candidates(self, frame: Frame) -> None:
        if self._search is None:
            self._candidates = ()
            return
        arrays = self.voxel_map.arrays()
        centres, probabilities = self._ooi_voxels.update(arrays)
        self._candidates = cluster_finds(
            centres,
            probabilities,
            arrays.voxel_size,
            camera=frame.camera,
            T_world_camera=frame.T_world_camera,
        )

    def _note(self, kind: str, text: str) -> None:
        self._events.append(MissionEvent(kind=kind, text=text))

    def _snapshot(self, frame: Frame, reason: str | None) -> Snapshot:
        search = self._search
        why = HELD_TEXT[self._held] if self._held else self._why
        return Snapshot(
            stamp_ns=frame.stamp_ns,
            state=self.state,
            why=f"{why}; {reason}" if reason else why,
            goal=self.goal,
            plan=self._plan,
            find=search.find if search else None,
            candidates=self._candidates,
            T_world_base=frame.T_world_base,
            path_length_m=search.path_length_m if search else 0.0,
            elapsed_s=search.elapsed_s(frame.stamp_ns) if search else 0.0,
            best_ooi=self.voxel_map.best_ooi() if search else 0.0,
            explored_m2=self.voxel_map.explored_m2(),
            events=tuple(self._events),
        )


def _ends_the_search(plan: Plan) -> bool:
    return plan.target is not None and plan.target.kind is NodeKind.TERMINATING


def _found_text(search: _Search, T_world_base: Float64Array) -> str:
    text = f"found {search.goal.display}"
    if search.find is None:
        return text
    return (
        f"{text}: {search.find.voxels} voxels at p = {search.find.probability:.2f}, "
        f"{distance_m(T_world_base, search.find):.1f} m away"
    )

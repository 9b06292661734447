"""One search after another on one map: the loop of the paper.

A frame goes in, a command comes out. The map fuses the frame (Sec. Object Probability Mapping), the
levels of the goal colour it (Sec. Semantic Guidance), the planner weighs gain against travel time
(Sec. Informative Path Planning), and the search ends in front of the object.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ippon.command import Command
from ippon.control.follower import FollowerConfig, PathFollower
from ippon.frame import Frame
from ippon.geometry import Float64Array, yaw_of
from ippon.guidance.levels import Guidance, LevelProbabilities
from ippon.mapping.voxel_map import MapConfig, VoxelMap
from ippon.mission.clusters import OoiVoxels, cluster_finds
from ippon.mission.explanation import explain
from ippon.mission.goal import Goal
from ippon.mission.look_around import LookAround, LookAroundConfig
from ippon.mission.recovery import NANOSECONDS, Recovery, RecoveryConfig
from ippon.mission.snapshot import Find, MissionEvent, MissionState, Snapshot, StepResult
from ippon.mission.termination import termination_voxels
from ippon.mission.travel_pitch import TravelPitch, TravelPitchConfig
from ippon.planning.plan import NodeKind, Plan
from ippon.planning.planner import PlannerConfig, ViewpointPlanner
from ippon.robot import RobotProfile


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionConfig:
    """Everything that decides how a search goes."""

    map: MapConfig = field(default_factory=MapConfig)
    levels: LevelProbabilities = field(default_factory=LevelProbabilities)
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


class Mission:
    """Owns the map, the planner and the goal; takes frames one by one."""

    def __init__(
        self, config: MissionConfig, robot: RobotProfile, labels: Sequence[str], seed: int
    ) -> None:
        self.config = config
        self.robot = robot
        self.voxel_map = VoxelMap(config.map, labels)
        self._planner = ViewpointPlanner(config.planner, robot, seed)
        self._follower = PathFollower(config.follower, robot)
        self._look_around = LookAround(config.look_around, robot)
        self._travel_pitch = TravelPitch(config.travel_pitch, robot)
        self._recovery = Recovery(config.recovery, robot)
        self._ooi_voxels = OoiVoxels(config.planner.ooi_threshold)
        self._goal: Goal | None = None
        self._guidance: Guidance | None = None
        self._state = MissionState.STARTING
        self._held: MissionState | None = None
        self._events: list[MissionEvent] = []
        self._candidates: tuple[Find, ...] = ()
        self._find: Find | None = None
        self._plan: Plan | None = None
        self._last: Frame | None = None
        self._started_ns: int | None = None
        self._path_length_m = 0.0
        self._arrived_steps = 0
        self._empty_steps = 0
        self._why = "waiting for a goal"

    # -- what the operator may do between two steps ------------------------------------------

    @property
    def goal(self) -> Goal | None:
        """What is searched for, or was found last."""
        return self._goal

    @property
    def state(self) -> MissionState:
        """What the robot is doing."""
        return self._held or self._state

    def set_goal(self, goal: Goal, guidance: Guidance) -> None:
        """Search for another object; map and tree stay.

        Raises:
            ValueError: The guidance does not speak of this map's labels, in their order.
        """
        self._check_guidance(guidance)
        self._goal = goal
        self._find = None
        self._started_ns = None
        self._path_length_m = 0.0
        self._arrived_steps = self._empty_steps = 0
        self.voxel_map.set_ooi(goal.object)
        self._ooi_voxels.forget()
        self._state = MissionState.SEARCHING if self._look_around.done else MissionState.STARTING
        self._why = f"starting the search for {goal.display}"
        self.set_guidance(guidance)
        self._note("goal_set", f"searching for {goal.display}")

    def set_guidance(self, guidance: Guidance) -> None:
        """Take other levels for the present goal: an answer came, or the operator changed one.

        Raises:
            ValueError: The guidance does not speak of this map's labels, in their order.
        """
        self._check_guidance(guidance)
        self._guidance = guidance
        probabilities = self.config.levels.as_array()
        self.voxel_map.set_levels(guidance.levels(), probabilities)
        if self._goal is not None:
            self._planner.set_goal(
                probabilities=probabilities,
                termination_min=termination_voxels(
                    self._goal.object, self._goal.category, self.config.map.voxel_size_m
                ),
            )

    def cancel_goal(self) -> None:
        """Search for nothing; the robot stays where it is."""
        if self._goal is not None:
            self._note("cancelled", f"the search for {self._goal.display} was cancelled")
        self._goal = None
        self._find = None
        self._plan = None
        self._state = MissionState.STARTING
        self._why = "waiting for a goal"

    def reject_find(self) -> bool:
        """Take the operator's word that the find is something else, and search on.

        Returns:
            Whether there was a find to reject.
        """
        if self._find is None or self._goal is None:
            return False
        radius = 0.5 * math.hypot(*self._find.size_m) + 0.2
        self.voxel_map.suppress_ooi(np.array(self._find.position_world), radius)
        self._note("rejected", f"not the {self._goal.display}: searching on")
        self._find = None
        self._arrived_steps = self._empty_steps = 0
        self._state = MissionState.SEARCHING
        self._why = f"searching on for {self._goal.display}"
        return True

    def stop(self) -> None:
        """Hold still until `resume`, whatever happens."""
        if self._held is not MissionState.STOPPED:
            self._note("stopped", "stopped by the operator")
        self._held = MissionState.STOPPED

    def pause(self) -> None:
        """Hold still until `resume`."""
        if self._held is None:
            self._held = MissionState.PAUSED

    def resume(self) -> None:
        """Go on after `stop` or `pause`."""
        if self._held is not None:
            self._note("resumed", "the search goes on")
        self._held = None

    # -- one step ----------------------------------------------------------------------------

    def step(self, frame: Frame) -> StepResult:
        """Fuse a frame and decide what to do next.

        Raises:
            FrameRejectedError: The frame contradicts itself or the map; nothing has changed.
        """
        self.voxel_map.integrate(frame)
        self._travelled(frame)
        self._update_candidates(frame)
        command = self._act(frame)
        self._recovery.watch(frame.stamp_ns, frame.T_world_base, command)
        snapshot = self._snapshot(frame)
        self._events = []
        return StepResult(command=command, snapshot=snapshot)

    def _act(self, frame: Frame) -> Command:
        hold = Command(tilt_rad=frame.tilt_rad)
        searching = self._state not in (MissionState.FOUND, MissionState.EXHAUSTED)
        if self._held is not None or self._goal is None or not searching:
            return hold
        if self._recovery.blocked(frame.stamp_ns, frame.T_world_base, frame.contact):
            self._note("contact", "touched something: marking it and backing off")
            self._planner.mark_contact(frame.T_world_base)
        self._plan = self._planner.step(self.voxel_map.arrays(), frame.T_world_base, frame.tilt_rad)
        freeing = self._recovery.command(frame.stamp_ns, frame.tilt_rad)
        if freeing is not None:
            return freeing
        if not self._look_around.done and not self._sees_the_object(self._plan):
            self._state = MissionState.LOOKING_AROUND
            self._why = f"looking around ({self._look_around.progress:.0%})"
            return self._look_around.step(yaw_of(frame.T_world_base), frame.tilt_rad)
        return self._pursue(frame, self._plan)

    def _sees_the_object(self, plan: Plan) -> bool:
        """A place to end the search at is known already: turning on would be a waste of time."""
        if plan.target is not None and plan.target.kind is NodeKind.TERMINATING:
            self._look_around.skip()
            return True
        return False

    def _pursue(self, frame: Frame, plan: Plan) -> Command:
        self._count_empty(plan)
        if self._state is MissionState.EXHAUSTED:
            return Command(tilt_rad=frame.tilt_rad)
        terminating = plan.target is not None and plan.target.kind is NodeKind.TERMINATING
        self._state = MissionState.APPROACHING if terminating else MissionState.SEARCHING
        self._why = explain(plan, self.voxel_map, self._goal, self._guidance)
        command = self._follower.step(
            plan,
            frame.T_world_base,
            frame.tilt_rad,
            self.voxel_map.arrays(),
            dt_s=self._dt_s(frame),
        )
        if self._arrived(plan):
            self._conclude(frame)
            return Command(tilt_rad=command.tilt_rad)
        if command.linear_m_s > 0.05 and not terminating:
            return Command(
                linear_m_s=command.linear_m_s,
                yaw_rate_rad_s=command.yaw_rate_rad_s,
                tilt_rad=self._travel_pitch.tilt(self._elapsed_s(frame)),
            )
        return command

    def _arrived(self, plan: Plan) -> bool:
        """The robot stands at a terminating viewpoint, and enough frames in a row agreed."""
        target = plan.target
        there = (
            target is not None and target.kind is NodeKind.TERMINATING and self._follower.reached
        )
        self._arrived_steps = self._arrived_steps + 1 if there else 0
        return self._arrived_steps >= self.config.confirm_steps

    def _conclude(self, frame: Frame) -> None:
        assert self._goal is not None
        self._find = self._nearest_candidate(frame.T_world_base)
        self._state = MissionState.FOUND
        self._why = f"found {self._goal.display}"
        if self._find is not None:
            self._why += (
                f": {self._find.voxels} voxels at p = {self._find.probability:.2f}, "
                f"{self._distance_m(frame.T_world_base, self._find):.1f} m away"
            )
        self._note("found", self._why)

    def _count_empty(self, plan: Plan) -> None:
        self._empty_steps = self._empty_steps + 1 if plan.exhausted else 0
        if self._empty_steps >= self.config.exhausted_steps:
            assert self._goal is not None
            self._state = MissionState.EXHAUSTED
            self._why = f"{self._goal.display} not found: everything reachable was seen"
            self._note("exhausted", self._why)

    # -- book-keeping ------------------------------------------------------------------------

    def _check_guidance(self, guidance: Guidance) -> None:
        labels = tuple(row.label for row in guidance.rows)
        if labels != self.voxel_map.labels:
            raise ValueError(
                f"guidance speaks of {len(labels)} labels, the map of "
                f"{len(self.voxel_map.labels)}, or in another order"
            )

    def _travelled(self, frame: Frame) -> None:
        if self._goal is not None and self._started_ns is None:
            self._started_ns = frame.stamp_ns
        if self._last is not None and self._state is not MissionState.FOUND:
            moved = frame.T_world_base[:3, 3] - self._last.T_world_base[:3, 3]
            self._path_length_m += float(np.linalg.norm(moved))
        self._previous_stamp_ns = self._last.stamp_ns if self._last else frame.stamp_ns
        self._last = frame

    def _dt_s(self, frame: Frame) -> float:
        return max(1e-3, (frame.stamp_ns - self._previous_stamp_ns) / NANOSECONDS)

    def _elapsed_s(self, frame: Frame) -> float:
        if self._started_ns is None:
            return 0.0
        return (frame.stamp_ns - self._started_ns) / NANOSECONDS

    def _update_candidates(self, frame: Frame) -> None:
        if self._goal is None:
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

    def _nearest_candidate(self, T_world_base: Float64Array) -> Find | None:
        near = [f for f in self._candidates if self._distance_m(T_world_base, f) < 2.0]
        in_view = [f for f in near if f.box_px is not None] or near
        return max(in_view, key=lambda f: f.voxels, default=None)

    @staticmethod
    def _distance_m(T_world_base: Float64Array, find: Find) -> float:
        x, y, _ = find.position_world
        return math.hypot(x - T_world_base[0, 3], y - T_world_base[1, 3])

    def _note(self, kind: str, text: str) -> None:
        self._events.append(MissionEvent(kind=kind, text=text))

    def _snapshot(self, frame: Frame) -> Snapshot:
        why = {
            MissionState.STOPPED: "stopped: press Resume to go on",
            MissionState.PAUSED: "paused",
        }.get(self.state, self._why)
        return Snapshot(
            stamp_ns=frame.stamp_ns,
            state=self.state,
            why=why,
            goal=self._goal,
            plan=self._plan,
            find=self._find,
            candidates=self._candidates,
            T_world_base=frame.T_world_base,
            path_length_m=self._path_length_m,
            elapsed_s=self._elapsed_s(frame),
            best_ooi=self.voxel_map.best_ooi(),
            explored_m2=self.voxel_map.explored_m2(),
            events=tuple(self._events),
        )

"""One search after another on one map: the loop of the paper.

A frame passes each stage once: the map fuses it (Sec. Object Probability Mapping), its voxels give
the candidates for the object, the planner weighs gain against travel time under the levels of the
goal (Sec. Semantic Guidance, Sec. Informative Path Planning), the first behavior that has something
to do commands, and limits and the collision filter make the command safe.
"""

from collections.abc import Sequence
from typing import Final

import numpy as np

from ippon.command import Command
from ippon.control.path_follower import PathFollower
from ippon.control.walking_guide import WalkingDirections, WalkingGuide
from ippon.frame import NANOSECONDS, Frame
from ippon.guidance.levels import Guidance
from ippon.mapping.voxel_map import VoxelMap
from ippon.mission.behaviors.behavior import Follower, StepContext
from ippon.mission.behaviors.priority import Behaviors
from ippon.mission.behaviors.self_navigation import SelfNavigation, planner_config
from ippon.mission.config import MissionConfig
from ippon.mission.finds.second_opinion import SecondOpinions
from ippon.mission.goal import Goal
from ippon.mission.goal_control import GoalControl
from ippon.mission.inspection import Preview, preview
from ippon.mission.journal import Journal
from ippon.mission.operator_control import OperatorControl
from ippon.mission.places.room_regions import RoomRegions
from ippon.mission.safe_motion import SafeMotion, moves_base
from ippon.mission.search import Search
from ippon.mission.snapshot import MissionState, StepResult
from ippon.mission.snapshot_builder import snapshot_of
from ippon.planning.deadline import Clock
from ippon.planning.interface import Planner
from ippon.planning.plan import Plan
from ippon.planning.planner import ViewpointPlanner
from ippon.robot import RobotProfile

_STEP_NS: Final = NANOSECONDS // 5


class Mission:
    """Owns the map, the planner and the goal; turns each frame into a command.

    Args:
        config: All tunable parameters of a search.
        robot: Body, limits and camera mount.
        labels: The common objects that the map distinguishes.
        seed: Seed of the planner's samples.
        planner: Replaces the paper's planner, to compare methods.
        voxel_map: Replaces an empty map; it must have these labels.
        clock: Measures `PlannerConfig.step_budget_s`; ValueError where that is set without a clock.
    """

    def __init__(
        self,
        config: MissionConfig,
        robot: RobotProfile,
        labels: Sequence[str],
        seed: int,
        planner: Planner | None = None,
        voxel_map: VoxelMap | None = None,
        clock: Clock | None = None,
    ) -> None:
        self.config, self.robot = config, robot
        self.voxel_map = voxel_map or VoxelMap(config.map, labels)
        planning = planner_config(config) if robot.follows_goals else config.planner
        self._planner: Planner = planner or ViewpointPlanner(planning, robot, seed, clock)
        self._journal = Journal()
        self.motion = SafeMotion(robot, self.voxel_map)
        self.operator = OperatorControl(self._planner, self.voxel_map, self._journal)
        self.opinions = SecondOpinions(config.second_opinion)
        self.rooms = RoomRegions(config.said_rooms, self.voxel_map, self.operator, self._journal)
        self._behaviors = Behaviors(
            config, robot, self.voxel_map, self._planner, self.operator, self._journal,
            self.opinions, self.rooms,
        )  # fmt: skip
        self.goals = GoalControl(
            config, self.voxel_map, self._planner, self._behaviors.look_around, self._journal
        )
        self.navigation: SelfNavigation | None = None
        self._follower: Follower = PathFollower(config.follower, robot)
        if robot.follows_goals:
            self.navigation = SelfNavigation(
                config, robot, self._planner, self.operator, self._behaviors.look_around,
                self._journal,
            )  # fmt: skip
            self._follower = self.navigation.follower
        self._guide = WalkingGuide(config.follower.angle_tolerance_rad)
        self._plan: Plan | None = None
        self._last: Frame | None = None
        self._due_ns = 0
        """When the next step counts."""

    @property
    def search(self) -> Search | None:
        """The present search or the last one; None without a goal."""
        return self.goals.search

    @property
    def goal(self) -> Goal | None:
        """The object that is searched for, or was found last."""
        return self.search.goal if self.search else None

    @property
    def state(self) -> MissionState:
        """What the robot is doing."""
        if self.operator.held is not None:
            return self.operator.held
        if self.operator.drives:
            return MissionState.MANUAL
        return self.search.state if self.search else MissionState.STARTING

    @property
    def floor_z_m(self) -> float:
        """Height of the floor under the robot, world frame, metres; 0 before the first frame."""
        return 0.0 if self._last is None else float(self._last.T_world_base[2, 3])

    @property
    def planned_floor_z_m(self) -> float | None:
        """Height at which the planner has read the floor, metres; None without a plan."""
        return None if self._plan is None else self._plan.floor_z_m

    def preview(self, guidance: Guidance) -> Preview | None:
        """Return what would be chosen next with other levels; the mission does not change.

        Returns:
            Both choices in words; None without a plan, in a tour of several goals, or with a
            planner that has no preview.

        Raises:
            ValueError: The guidance is not for the labels of this map, in their order.
        """
        self.goals.check_guidance(guidance)
        if self.search is None or self._plan is None or self.goals.tour is not None:
            return None
        return preview(self._planner, self._plan, self.voxel_map, self.search, guidance)

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
        report = self.voxel_map.integrate(frame)
        self._planner.note_height(float(frame.T_world_base[2, 3]))
        self.goals.observe(frame)
        self._journal.report_dropped(report.blocks_dropped, self.config.map.memory_limit_mb)

    def learn(self, frame: Frame) -> None:
        """Fuse the heatmap that arrived late for a frame which was observed without it.

        Raises:
            ValueError: The frame has no heatmap.
        """
        self.voxel_map.integrate_heatmap(frame)
        self.goals.observe(frame)

    def decide(self, frame: Frame, age_s: float = 0.0) -> StepResult:
        """Decide what to do next, after `observe` of the same frame: the second half of `step`.

        Args:
            frame: The frame.
            age_s: Seconds since it was taken, during which the robot has driven on.
        """
        frame = self.motion.with_known_tilt(frame)
        dt_s = self._advance(frame)
        self.goals.update_candidates(frame)
        self.rooms.step(self.goals.running, frame.stamp_ns, self.floor_z_m)
        self._follower.resume_from(self.motion.last)
        action = self._act(frame, dt_s)
        stops = self.operator.held is not None or self._behaviors.recovery.active
        wanted = self.motion.accelerate(action, dt_s, brakes_at_once=stops)
        followed = wanted if self.operator.follows_mission else None
        self._behaviors.recovery.watch(frame, followed, self.operator.speed_limit)
        command, reason = self.motion.avoid_collision(
            wanted, frame, dt_s, age_s, self.planned_floor_z_m
        )
        if moves_base(wanted) and not moves_base(command):
            # No space to turn: the look around cannot be completed here.
            self._behaviors.look_around.abandon(self.search)
        snapshot = snapshot_of(
            frame,
            self.voxel_map,
            self.search,
            self._plan,
            state=self.state,
            why="; ".join(filter(None, (self.operator.held_text or self._journal.why, reason))),
            events=self._journal.take(),
            far_evidence_cell_m=self.config.far_evidence.cell_m,
            tour=self.goals.tour,
            walk=self._walk(command, frame),
        )
        return StepResult(command=command, snapshot=snapshot)

    def _act(self, frame: Frame, dt_s: float) -> Command:
        """Plan, and return the command of the first behavior that has something to do."""
        search = None if self.search is None or self.search.over else self.search
        counts = self._counts(frame)
        self._planner.set_searching(search is not None, counts=counts)
        if self.operator.held or (search is None and self.operator.waypoint is None):
            self._plan = self._plan if self.search is not None else None
            return Command(tilt_rad=frame.tilt_rad)
        if self.navigation is not None:
            self.navigation.react(search)
        elif self._behaviors.recovery.is_blocked(frame, self.motion.last):
            by_hand = self.operator.drives and self.operator.waypoint is None
            self._journal.note(
                "contact", f"blocked: marking what is ahead{'' if by_hand else ' and backing off'}"
            )
            self._planner.mark_contact(frame.T_world_base, self.motion.last)
            if not self.robot.is_round:
                self._behaviors.look_around.abandon(search)
        plan = self._planner.step(self.voxel_map.arrays(), frame.T_world_base, frame.tilt_rad)
        search, others = self.goals.focus(plan) if search is not None else (None, ())
        action = self._behaviors.act(
            StepContext(frame, dt_s, plan, search, self._follower, self.voxel_map, others, counts)
        )
        if self.navigation is not None:
            action = self.navigation.command_of(action, frame, dt_s)
        self._plan = action.plan or plan
        self._journal.why = action.why or self._journal.why
        if search is not None and action.state is not None:
            self.goals.settle(search, action.state)
        return action.command

    def _counts(self, frame: Frame) -> bool:
        """Return whether a step counts where patience is given in steps, five a second.

        None does while the operator drives: the robot does not follow the plan.
        """
        now_ns = frame.stamp_ns
        if self._due_ns > now_ns + _STEP_NS:
            # The robot's clock was reset.
            self._due_ns = now_ns
        if now_ns < self._due_ns:
            return False
        self._due_ns = max(self._due_ns + _STEP_NS, now_ns)
        return not self.operator.drives

    def _walk(self, command: Command, frame: Frame) -> WalkingDirections | None:
        """Return the directions for the person who carries the camera; None for a robot."""
        if not self.robot.is_carried:
            return None
        path_world = np.zeros((0, 3)) if self._plan is None else self._plan.path_world
        return self._guide.step(command, path_world, frame.T_world_base, frame.tilt_rad)

    def _advance(self, frame: Frame) -> float:
        """Add time and path of this frame to the search; returns seconds since the last frame."""
        last, self._last = self._last, frame
        self.operator.frame = self.goals.frame = frame
        self.goals.advance(last, frame)
        return 1e-3 if last is None else max(1e-3, (frame.stamp_ns - last.stamp_ns) / NANOSECONDS)

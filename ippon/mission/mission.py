"""One search after another on one map: the loop of the paper.

A frame goes in, a command comes out. The map fuses the frame (Sec. Object Probability Mapping), the
levels of the goal colour it (Sec. Semantic Guidance), the planner weighs gain against travel time
(Sec. Informative Path Planning), and the search ends in front of the object.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ippon.command import Command
from ippon.control.drive import DriveMode
from ippon.control.easing import within_acceleration
from ippon.control.follower import PathFollower
from ippon.frame import NANOSECONDS, Frame
from ippon.geometry import Float64Array, yaw_of
from ippon.guidance.knowledge import load_knowledge
from ippon.guidance.levels import Guidance, Level
from ippon.guidance.room_levels import RoomLevels
from ippon.mapping.arrays import MapArrays
from ippon.mapping.voxel_map import VoxelMap
from ippon.mission.behaviors.look_around import STILL_THERE_M, LookAround
from ippon.mission.behaviors.operator_hold import Steering
from ippon.mission.behaviors.pursuit import Pursuit, ends_search
from ippon.mission.behaviors.recovery import Recovery
from ippon.mission.behaviors.waypoint import Waypoint
from ippon.mission.collision_filter import moves_base, without_collision
from ippon.mission.config import MissionConfig
from ippon.mission.finds.rejection import (
    doubt,
    look_for_candidates,
    reconsider,
    reject_last_find,
)
from ippon.mission.finds.termination import lowest_m
from ippon.mission.goal import Goal
from ippon.mission.inspection import Preview, preview
from ippon.mission.journal import WAITING, Journal
from ippon.mission.search import Search
from ippon.mission.snapshot import OVER, MissionState, Snapshot, StepResult
from ippon.mission.snapshot_builder import snapshot_of
from ippon.planning.deadline import Clock
from ippon.planning.interface import Planner
from ippon.planning.plan import Plan
from ippon.planning.planner import ViewpointPlanner
from ippon.planning.visibility.region_weights import RegionWeights
from ippon.robot import RobotProfile


class Mission:
    """Owns the map, the planner and the goal; takes frames one by one.

    Another `planner` may take the place of the paper's, for comparison with other methods; a
    `voxel_map` with these labels that of an empty one. The `clock` is what a planner step's budget
    in seconds is kept by; ValueError where there is one and no clock.
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
        self.rooms = RoomLevels(config.rooms)
        self._planner: Planner = planner or ViewpointPlanner(config.planner, robot, seed, clock)
        self._journal = Journal()
        self._follower = PathFollower(config.follower, robot)
        self._steering = Steering(self._planner, self._follower, self.voxel_map, self._journal)
        self._pursuit = Pursuit(config, robot, self._follower, self.voxel_map, self.rooms)
        self._look_around = LookAround(config.look_around, robot)
        self._looked_for: tuple[str, Float64Array] | None = None
        """Object that the robot looked around for last, and where it stood."""
        self._recovery = Recovery(config.recovery, robot)
        self._search: Search | None = None
        self._state = MissionState.STARTING
        self._plan: Plan | None = None
        self._last: Frame | None = None
        self._commanded = Command()
        self._by_hand = False

    # -- what the operator may do between two steps ------------------------------------------

    @property
    def goal(self) -> Goal | None:
        """What is searched for, or was found last."""
        return self._search.goal if self._search else None

    @property
    def state(self) -> MissionState:
        """What the robot is doing."""
        unheld = MissionState.MANUAL if self._steering.by_hand else self._state
        return self._steering.held or unheld

    @property
    def waypoint(self) -> Waypoint | None:
        """Where the operator sends the robot, until it is there."""
        return self._steering.waypoint

    def set_goal(self, goal: Goal, guidance: Guidance) -> None:
        """Search for another object; map and tree stay.

        The robot looks around anew, unless the map has the object already: what is near and was
        never in view costs a turn and no way.

        Raises:
            ValueError: The guidance does not speak of this map's labels, in their order.
        """
        self._check_guidance(guidance)
        if not self._looked_around_for(goal):
            self._look_around = LookAround(self.config.look_around, self.robot)
        self._search = Search(goal, guidance, self.config)
        self._planner.set_far_evidence(self._search.far_evidence)
        self.voxel_map.set_ooi(
            goal.object,
            load_knowledge().highest_m(goal.category or goal.object),
            lowest_m=lowest_m(goal.object, goal.category),
        )
        self._state = MissionState.SEARCHING if self._look_around.done else MissionState.STARTING
        self._journal.why = f"starting the search for {goal.display}"
        self.set_guidance(guidance)
        self._journal.note("goal_set", f"searching for {goal.display}")

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
        self._search.far_evidence.set_cues(guidance.labels_of(Level.CERTAIN))
        probabilities = self.config.levels.as_array()
        self.voxel_map.set_levels(guidance.levels(), probabilities)
        self.rooms.set_guidance(guidance)
        self._planner.set_goal(
            probabilities=probabilities, termination_min=self._search.termination_min
        )

    def cancel_goal(self) -> None:
        """Search for nothing; the robot stays where it is."""
        if self._search is not None and self._state not in OVER:
            self._journal.note(
                "cancelled", f"the search for {self._search.goal.display} was cancelled"
            )
        self._search = None
        self._planner.set_far_evidence(None)
        self._plan = None
        self._state = MissionState.STARTING
        self._journal.why = WAITING

    def reject_find(self) -> bool:
        """Take the operator's word that the find is something else, and search on.

        Returns:
            Whether there was a find to reject.
        """
        if self._search is None or self._state is not MissionState.FOUND:
            return False
        reject_last_find(self._search, self.voxel_map, self._last)
        self._planner.set_termination_min(self._search.termination_min)
        display = self._search.goal.display
        self._journal.note("rejected", f"not the {display}: searching on")
        self._state = MissionState.SEARCHING
        self._journal.why = f"searching on for {display}"
        return True

    def confirm_find(self) -> bool:
        """Take the operator's word that the find is the object.

        Returns:
            Whether there was a find to confirm.
        """
        if self._search is None or self._state is not MissionState.FOUND:
            return False
        self._journal.note("confirmed", f"{self._search.goal.display}: confirmed by the operator")
        return True

    def stop(self) -> None:
        """Hold still until `resume`, whatever happens."""
        self._steering.stop()

    def pause(self) -> None:
        """Hold still until `resume`; a stop is more and stays."""
        self._steering.pause()

    def resume(self) -> None:
        """Go on after `stop` or `pause`."""
        self._steering.resume()

    def drive(self, mode: DriveMode) -> None:
        """Say who drives; map and tree go on growing, and Auto goes on from wherever it is."""
        self._steering.drive(mode)

    def go_to(self, xy: tuple[float, float]) -> float | None:
        """Go to a point on the floor first, then on with what the mode says.

        Args:
            xy: World x and y, metres.

        Returns:
            Length of the way in metres; None, and nothing changes, when there is no way.
        """
        return None if self._last is None else self._steering.go_to(xy, self._last)

    def cancel_go_to(self) -> None:
        """Go to no point any more."""
        self._steering.cancel_go_to()

    def set_regions(self, regions: RegionWeights | None) -> bool:
        """Weigh parts of the floor as the operator painted them, for every goal until changed.

        Returns:
            Whether the planner takes such wishes.
        """
        return self._steering.set_regions(regions)

    def preview(self, guidance: Guidance) -> Preview | None:
        """Tell what would be chosen next with other levels; nothing changes by it.

        Returns:
            Both choices in words; None when there is no plan, or the planner cannot tell.

        Raises:
            ValueError: The guidance does not speak of this map's labels, in their order.
        """
        self._check_guidance(guidance)
        search = self._search
        if search is None or self._plan is None:
            return None
        now = search.guidance
        return preview(
            self._planner, self._plan, self.voxel_map, search.goal, now, guidance, self.rooms
        )

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
        report = self.voxel_map.integrate(frame)
        if self._search is not None:
            self._search.ask_image(frame)
        self._journal.map_dropped(report.blocks_dropped, self.config.map.memory_limit_mb)

    def learn(self, frame: Frame) -> None:
        """Take the heatmap that came late for a frame which was observed without it.

        Raises:
            ValueError: The frame has no heatmap.
        """
        self.voxel_map.learn(frame)
        if self._search is not None:
            self._search.ask_image(frame)

    def decide(self, frame: Frame) -> StepResult:
        """Decide what to do next, after `observe` of the same frame: the second half of `step`."""
        if not self.robot.can_tilt:
            # Nobody waits for a fixed camera to take a tilt that its mounting is a little off.
            frame = replace(frame, tilt_rad=self.robot.min_tilt_rad)
        dt_s = self._travelled(frame)
        if self._search is not None:
            look_for_candidates(self._search, self.voxel_map, frame)
        self._follower.go_on_from(self._commanded)
        wanted = within_acceleration(
            self._act(frame, dt_s),
            self._commanded,
            self.robot,
            dt_s,
            brakes_at_once=self._steering.held is not None or self._recovery.frees or self._by_hand,
        )
        self._by_hand = False
        # The command before the filter: a robot that is kept from driving is stuck, too.
        own = wanted if self._steering.commands_followed else Command(tilt_rad=frame.tilt_rad)
        self._recovery.watch(frame.stamp_ns, frame.T_world_base, own)
        command, reason = without_collision(wanted, frame, self.robot, self.voxel_map, dt_s)
        kept = moves_base(wanted) and not moves_base(command)
        if kept and self._state is MissionState.LOOKING_AROUND:
            # There is no room to turn: to wait for it would take for ever.
            self._look_around.skip()
        self._commanded = command
        return StepResult(command=command, snapshot=self._snapshot(frame, reason))

    def not_followed(self) -> None:
        """Take note that the robot was kept from driving as commanded: it starts from rest."""
        self._commanded = Command()

    def go_on_from(self, command: Command) -> None:
        """Take note of what the operator's hand commanded until the next `decide`.

        The robot speeds up from there; what the mission does not want of it, it stops at once.
        """
        self._commanded, self._by_hand = command, True

    def _act(self, frame: Frame, dt_s: float) -> Command:
        """Plan, and choose who commands: recovery, the operator, the look around or the pursuit."""
        search, steering = self._search, self._steering
        idle = (search is None or self._state in OVER) and steering.waypoint is None
        if steering.held is not None or idle:
            return Command(tilt_rad=frame.tilt_rad)
        if self._recovery.blocked(frame.stamp_ns, frame.T_world_base, frame.contact):
            self._journal.note("contact", "blocked: marking what is ahead and backing off")
            self._planner.mark_contact(frame.T_world_base, self._commanded)
            if self._state is MissionState.LOOKING_AROUND and not self.robot.is_round:
                # There is no room to turn a long body here.
                self._look_around.skip()
        plan = self._plan = self._planner.step(
            self._guided(frame), frame.T_world_base, frame.tilt_rad
        )
        if steering.by_hand and steering.waypoint is None:
            self._journal.why = "you drive; the map goes on growing"
            return Command(tilt_rad=frame.tilt_rad)
        freeing = self._recovery.command(frame.stamp_ns, frame.tilt_rad)
        if freeing is not None:
            return freeing
        if steering.waypoint is not None or search is None:
            command, self._plan = steering.go_on(frame, plan, dt_s)
            return command
        if ends_search(plan):
            self._look_around.interrupt(search.path_length_m)
        elif not self._look_around.done:
            if self._look_around.waits():
                return Command(tilt_rad=frame.tilt_rad)
            self._state = MissionState.LOOKING_AROUND
            self._looked_for = (search.goal.object, frame.T_world_base)
            self._journal.why = f"looking around ({self._look_around.progress:.0%})"
            return self._look_around.step(yaw_of(frame.T_world_base), frame.tilt_rad)
        return self._pursue(search, frame, plan, dt_s)

    def _pursue(self, search: Search, frame: Frame, plan: Plan, dt_s: float) -> Command:
        if not (search.speck_will_do or ends_search(plan) or plan.closer_look):
            # The closer look is over, or there is no place for one.
            search.speck_will_do = search.shows_speck(frame.T_world_base)
            if search.speck_will_do:
                self._planner.set_termination_min(search.termination_min)
        pursued = self._pursuit.step(search, frame, plan, dt_s)
        idle = search.idle_steps >= self.config.second_look.idle_steps
        over = idle or pursued.state is MissionState.EXHAUSTED
        if over and reconsider(search, self.voxel_map):
            self._state = MissionState.SEARCHING
            self._journal.why = f"going back to what may be {search.goal.display} after all"
            self._journal.note("reconsidered", f"nothing better is left: {self._journal.why}")
            return pursued.command
        if pursued.doubted is not None:
            doubt(search, self.voxel_map, pursued.doubted)
            self._journal.note("doubted", pursued.why)
        if pursued.state in OVER:
            self._conclude(pursued.state, pursued.why)
        else:
            self._state, self._journal.why = pursued.state, pursued.why
        return pursued.command

    def _guided(self, frame: Frame) -> MapArrays:
        """Return the map as it guides the planner: by the type of room, where that is asked for."""
        floor_z_m = float(frame.T_world_base[2, 3])
        return self.rooms.follow(self.voxel_map, frame.stamp_ns, floor_z_m)

    def _conclude(self, state: MissionState, why: str) -> None:
        self._state = state
        self._journal.why = why
        self._journal.note(state.value, why)

    # -- book-keeping ------------------------------------------------------------------------

    def _looked_around_for(self, goal: Goal) -> bool:
        """Tell whether the robot stands where it looked around for a goal's object last.

        What is no common object starts anew in the map with each goal, and must be seen again.
        """
        if self._looked_for is None or self._last is None:
            return False
        ooi, T_world_base = self._looked_for
        if goal.object != ooi or ooi not in self.voxel_map.labels:
            return False
        gone = self._last.T_world_base[:3, 3] - T_world_base[:3, 3]
        return float(np.linalg.norm(gone)) <= STILL_THERE_M

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
        if self._search is not None:
            self._search.keep_time(last, frame)
            if self._state is not MissionState.FOUND:
                self._search.add_way(last, frame)
        return 1e-3 if last is None else max(1e-3, (frame.stamp_ns - last.stamp_ns) / NANOSECONDS)

    def _snapshot(self, frame: Frame, reason: str | None) -> Snapshot:
        why = self._steering.held_text or self._journal.why
        return snapshot_of(
            frame,
            self.voxel_map,
            self._search,
            self._plan,
            state=self.state,
            why=f"{why}; {reason}" if reason else why,
            events=self._journal.take(),
            far_evidence_cell_m=self.config.far_evidence.cell_m,
        )

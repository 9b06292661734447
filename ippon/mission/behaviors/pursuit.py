"""From plan to command: follow the planner's choice, and notice where a search ends."""

import dataclasses
import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from ippon.command import Command
from ippon.control.path_follower import PathFollower
from ippon.frame import Frame
from ippon.geometry import wrap_angle, yaw_of
from ippon.mapping.voxel_map import VoxelMap
from ippon.mission.behaviors.floor_check import Glance
from ippon.mission.behaviors.travel_pitch import TravelPitch
from ippon.mission.config import MissionConfig
from ippon.mission.explanation import explain
from ippon.mission.finds.context_check import is_elsewhere
from ippon.mission.finds.find_geometry import exhausted_text, find_from, nearest_find, reached_find
from ippon.mission.search import Search
from ippon.mission.snapshot import Find, MissionState
from ippon.planning.plan import NodeKind, Plan
from ippon.planning.selection.look_target import towards
from ippon.robot import RobotProfile

_ARRIVING_M: Final = 0.4
"""This near to the target the camera turns to what the viewpoint wants to see."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Pursued:
    """What a step of the pursuit came to."""

    command: Command
    state: MissionState
    """`FOUND` and `EXHAUSTED` end the search."""
    why: str
    doubted: Find | None = None
    """What the map takes for the object and the images do not."""


class Pursuit:
    """Goes where the plan says until the object is in front of the robot, or nothing is left."""

    def __init__(
        self,
        config: MissionConfig,
        robot: RobotProfile,
        follower: PathFollower,
        voxel_map: VoxelMap,
    ) -> None:
        self._config = config
        self._robot = robot
        self._follower = follower
        self._voxel_map = voxel_map
        self._travel_pitch = TravelPitch(config.travel_pitch, robot)
        self._glance = Glance(config.glance, robot)

    def step(self, search: Search, frame: Frame, plan: Plan, dt_s: float) -> Pursued:
        """Follow the plan, and end the search where it says so.

        Args:
            search: Takes note of how often in a row the plan led nowhere, or to the object.
            frame: Where the robot stands.
            plan: What the planner chose on this frame.
            dt_s: Seconds since the frame before.
        """
        self._count(search, plan)
        if search.empty_steps >= self._config.exhausted_steps:
            return Pursued(
                command=Command(tilt_rad=frame.tilt_rad),
                state=MissionState.EXHAUSTED,
                why=exhausted_text(search.goal.display, search.candidates, full=plan.full),
            )
        approaching = ends_search(plan)
        glance = self._glance.step(plan, frame.T_world_base, frame.tilt_rad, dt_s)
        if glance is not None:
            return Pursued(
                command=glance,
                state=MissionState.APPROACHING if approaching else MissionState.SEARCHING,
                why=self._glance.why,
            )
        command = self._follower.step(
            plan, frame.T_world_base, frame.tilt_rad, self._voxel_map.arrays(), dt_s
        )
        arrived = approaching and self._follower.reached
        # One frame in between that sees it worse does not count for more than one that sees it.
        search.arrived_steps = max(0, search.arrived_steps + (1 if arrived else -1))
        # Where the plan leads to another place by now, that is gone to first.
        stands_there = arrived or not approaching
        if stands_there and search.arrived_steps >= self._config.confirm_steps:
            end = self._end(search, frame, plan, Command(tilt_rad=command.tilt_rad))
            if end is not None:
                return end
            # It was a voxel that came and went.
            search.arrived_steps = 0
        watched = self._tilt_to_object(search, frame, plan)
        if watched is not None:
            command = dataclasses.replace(command, tilt_rad=watched)
        elif command.linear_m_s > 0.05 and not approaching:
            sweep = self._travel_pitch.tilt(search.elapsed_s(frame.stamp_ns))
            command = dataclasses.replace(command, tilt_rad=sweep)
        return Pursued(
            command=command,
            state=MissionState.APPROACHING if approaching else MissionState.SEARCHING,
            why=explain(plan, self._voxel_map, search.goal, search.guidance),
        )

    def _count(self, search: Search, plan: Plan) -> None:
        """Count steps in a row that promise nothing; what one had no time for it leaves open."""
        if plan.exhausted:
            search.empty_steps += 1
        elif plan.target is not None or not plan.cut_short:
            search.empty_steps = 0
        if not self._is_idle(plan):
            search.idle_steps = 0
        elif not plan.cut_short:
            search.idle_steps += 1

    def _is_idle(self, plan: Plan) -> bool:
        """Tell whether next to nothing is to be expected of any way to explore."""
        if ends_search(plan) or plan.closer_look:
            return False
        return plan.promised_per_s < self._config.second_look.idle_gain

    def _end(self, search: Search, frame: Frame, plan: Plan, still: Command) -> Pursued | None:
        """Say what the robot makes of what it has come to; None where nothing is there any more.

        Args:
            search: Takes note of the find.
            frame: Where the robot stands.
            plan: What led there.
            still: The command that keeps it there.
        """
        find = self._come_to(search, frame, plan)
        if find is None:
            return None
        doubt = self._doubt(search, find)
        waited = search.arrived_steps - self._config.confirm_steps
        unsure = doubt is not None or search.second_look.share(find) is None
        if unsure and waited < self._config.second_look.enough_images:
            why = f"looking whether that is {search.goal.display}"
            return Pursued(command=still, state=MissionState.APPROACHING, why=why)
        if doubt is not None:
            why = f"what seemed to be {search.goal.display} {doubt}: going on"
            return Pursued(command=still, state=MissionState.SEARCHING, why=why, doubted=find)
        search.find = find
        why = search.found_text(frame.T_world_base)
        return Pursued(command=still, state=MissionState.FOUND, why=why)

    def _come_to(self, search: Search, frame: Frame, plan: Plan) -> Find | None:
        """Return what the robot stands before; None where nothing is there any more."""
        candidates, here = search.candidates, frame.T_world_base
        if plan.out_of_reach_m is not None:
            return find_from(candidates, here, plan.out_of_reach_m)
        find = reached_find(candidates, here)
        if find is None and ends_search(plan):
            return nearest_find(candidates, here)
        return find

    def _doubt(self, search: Search, find: Find) -> str | None:
        """Say what speaks against a find; None where nothing does."""
        doubt = search.doubt(find, elsewhere=False)
        context = search.guidance.context
        if doubt is None and is_elsewhere(find, search.goal, context, self._voxel_map):
            return search.doubt(find, elsewhere=True)
        return doubt

    def _tilt_to_object(self, search: Search, frame: Frame, plan: Plan) -> float | None:
        """Return the tilt that keeps in sight what the robot is on its way to.

        None where that is nothing in particular, or out of sight anyway, and at the end of the way,
        where the viewpoint says how to look.
        """
        target, robot = plan.target, self._robot
        if target is None or not search.candidates or not (ends_search(plan) or plan.closer_look):
            return None
        here, end = frame.T_world_base[:3, 3], target.position_world
        if math.dist(here[:2], end[:2]) <= _ARRIVING_M:
            return None
        thing = min(search.candidates, key=lambda c: math.dist(c.position_world[:2], end[:2]))
        eye_z_m = float(here[2]) + robot.camera_height_m
        yaw, tilt = towards(here[:2], np.array(thing.position_world), eye_z_m)
        off = wrap_angle(yaw - yaw_of(frame.T_world_base))
        return None if abs(off) > 0.5 * robot.horizontal_fov_rad else robot.within_tilt(tilt)


def ends_search(plan: Plan) -> bool:
    """Tell whether the plan leads to where the object can be seen from as close as a way leads."""
    if plan.target is None:
        return False
    return plan.target.kind is NodeKind.TERMINATING or plan.out_of_reach_m is not None

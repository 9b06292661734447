"""Follows the planner's path: the lowest of the behaviors, and the one of most of a search."""

import dataclasses
import math
from typing import Final

import numpy as np

from ippon.frame import Frame
from ippon.geometry import wrap_angle, yaw_of
from ippon.mapping.voxel_map import VoxelMap
from ippon.mission.behaviors.behavior import Action, Situation
from ippon.mission.behaviors.config import TravelPitchConfig
from ippon.mission.behaviors.travel_pitch import TravelPitch
from ippon.mission.explanation import explain
from ippon.mission.search import Search
from ippon.mission.snapshot import MissionState
from ippon.planning.plan import Plan
from ippon.planning.selection.look_target import yaw_tilt_to
from ippon.robot import RobotProfile

_ARRIVING_M: Final = 0.4
"""This near to the viewpoint the camera takes the viewpoint's orientation."""
_DRIVING_M_S: Final = 0.05


class Pursuit:
    """Drives along the plan's path, with the camera on the candidate or sweeping."""

    def __init__(self, config: TravelPitchConfig, robot: RobotProfile, voxel_map: VoxelMap) -> None:
        self._robot = robot
        self._voxel_map = voxel_map
        self._travel_pitch = TravelPitch(config, robot)

    def act(self, situation: Situation) -> Action | None:
        """See `Behavior.act`."""
        search, frame, plan = situation.search, situation.frame, situation.plan
        if search is None:
            return None
        command = situation.follow_plan()
        tilt_rad = self._tilt_to_candidate(search, frame, plan)
        if tilt_rad is not None:
            command = dataclasses.replace(command, tilt_rad=tilt_rad)
        elif command.linear_m_s > _DRIVING_M_S and not plan.ends_search:
            sweep = self._travel_pitch.tilt(search.elapsed_s(frame.stamp_ns))
            command = dataclasses.replace(command, tilt_rad=sweep)
        state = MissionState.APPROACHING if plan.ends_search else MissionState.SEARCHING
        why = explain(plan, self._voxel_map, search.goal, search.guidance)
        return Action(command, state, why)

    def _tilt_to_candidate(self, search: Search, frame: Frame, plan: Plan) -> float | None:
        """Return the tilt that keeps the candidate at the end of the path in the image.

        None where the path leads to no candidate, the candidate is outside the horizontal field of
        view, or the robot is about to arrive: then the viewpoint gives the orientation.
        """
        target, robot = plan.target, self._robot
        if target is None or not search.candidates or not (plan.ends_search or plan.closer_look):
            return None
        here, end = frame.T_world_base[:3, 3], target.position_world
        if math.dist(here[:2], end[:2]) <= _ARRIVING_M:
            return None
        nearest = min(search.candidates, key=lambda c: math.dist(c.position_world[:2], end[:2]))
        camera_z_m = float(here[2]) + robot.camera_height_m
        yaw, tilt = yaw_tilt_to(here[:2], np.array(nearest.position_world), camera_z_m)
        off = wrap_angle(yaw - yaw_of(frame.T_world_base))
        return None if abs(off) > 0.5 * robot.horizontal_fov_rad else robot.within_tilt(tilt)

"""Follows the planner's path; the behavior of lowest priority, active during most of a search."""

import dataclasses
import math

import numpy as np

from ippon.command import Command
from ippon.frame import Frame
from ippon.geometry import wrap_angle, yaw_of
from ippon.mapping.voxel_map import VoxelMap
from ippon.mission.behaviors.behavior import Action, StepContext
from ippon.mission.behaviors.config import TravelPitchConfig
from ippon.mission.behaviors.travel_pitch import TravelPitch
from ippon.mission.explanation import explain
from ippon.mission.search import Search
from ippon.mission.snapshot import MissionState
from ippon.planning.plan import Plan
from ippon.planning.selection.look_target import yaw_tilt_to
from ippon.robot import RobotProfile


class Pursuit:
    """Drives along the plan's path, with the camera on the candidate or sweeping."""

    def __init__(self, config: TravelPitchConfig, robot: RobotProfile, voxel_map: VoxelMap) -> None:
        self._config = config
        self._robot = robot
        self._voxel_map = voxel_map
        self._travel_pitch = TravelPitch(config, robot)

    def act(self, step: StepContext) -> Action | None:
        """See `Behavior.act`."""
        search, frame, plan = step.search, step.frame, step.plan
        if search is None:
            return None
        command = step.follow_plan()
        tilt_rad = self._tilt_to_candidate(search, frame, plan)
        if tilt_rad is not None:
            command = dataclasses.replace(command, tilt_rad=tilt_rad)
        elif self._drives(command) and not plan.ends_search:
            sweep = self._travel_pitch.tilt(search.elapsed_s(frame.stamp_ns))
            command = dataclasses.replace(command, tilt_rad=sweep)
        state = MissionState.APPROACHING if plan.ends_search else MissionState.SEARCHING
        why = explain(plan, self._voxel_map, search.goal, search.guidance)
        return Action(command, state, why)

    def _drives(self, command: Command) -> bool:
        return command.goal is not None or command.linear_m_s > self._config.driving_m_s

    def _tilt_to_candidate(self, search: Search, frame: Frame, plan: Plan) -> float | None:
        """Return the tilt that keeps the candidate at the end of the path in the image.

        Returns:
            Radians; None if the path leads to no candidate, if the candidate is outside the
            horizontal field of view, or near the viewpoint, which then gives the orientation.
        """
        target, robot = plan.target, self._robot
        if target is None or not search.candidates or not (plan.ends_search or plan.closer_look):
            return None
        here, end = frame.T_world_base[:3, 3], target.position_world
        if math.dist(here[:2], end[:2]) <= self._config.arriving_m:
            return None
        nearest = min(search.candidates, key=lambda c: math.dist(c.position_world[:2], end[:2]))
        camera_z_m = float(here[2]) + robot.camera_height_m
        yaw, tilt = yaw_tilt_to(here[:2], np.array(nearest.position_world), camera_z_m)
        off = wrap_angle(yaw - yaw_of(frame.T_world_base))
        return None if abs(off) > 0.5 * robot.horizontal_fov_rad else robot.within_tilt(tilt)

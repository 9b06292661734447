"""The last step towards a find whose voxels begin nearer than the object does.

A detector's box covers some of what stands beside the object, and the search ends before the
nearest voxels of a find. The last images tell better where the object is: a quarter of what they
recognise has to lie within the metre of the task. Otherwise the robot goes a little closer before
it says that it has found the object.
"""

import dataclasses
import math
from collections.abc import Sequence

import numpy as np

from ippon.frame import NANOSECONDS
from ippon.geometry import Float64Array
from ippon.mission.behaviors.behavior import Action, StepContext
from ippon.mission.behaviors.config import StepCloserConfig
from ippon.mission.behaviors.operator_drive import plan_along
from ippon.mission.finds.find_geometry import SUCCESS_M
from ippon.mission.operator_control import path_length, path_to
from ippon.mission.search import Search
from ippon.mission.snapshot import Find, MissionState
from ippon.planning.interface import Planner
from ippon.planning.selection.look_target import yaw_tilt_to
from ippon.robot import RobotProfile


class StepCloser:
    """Drives from where a find was verified to where enough of it is within reach."""

    def __init__(self, config: StepCloserConfig, planner: Planner, robot: RobotProfile) -> None:
        self._config = config
        self._planner = planner
        self._robot = robot
        self._path: Float64Array | None = None
        self._until_ns = 0

    def begin(self, step: StepContext, search: Search, find: Find) -> bool:
        """Return whether the robot has to go closer to a find, and can.

        Args:
            step: The present step.
            search: The search that is about to end.
            find: What it would end with.
        """
        self._path = None
        images = search.image_check.recognised_at(find)
        if not images or find.out_of_reach_m is not None:
            return False
        config, here = self._config, step.frame.T_world_base[:2, 3]
        away_m = _distance_m(images, here, config.share)
        if away_m <= SUCCESS_M:
            return False
        middle = np.median([np.median(points, axis=0) for points in images], axis=0)
        left_m, middle_m = away_m - config.near_m, math.dist(middle, here)
        if middle_m == 0.0:
            # What is all around the robot is in no direction.
            return False
        x, y = here + (middle - here) * (left_m / middle_m)
        path = path_to(self._planner, (float(x), float(y)), step.frame.T_world_base)
        if path is None or len(path) == 0 or path_length(path) > left_m + config.detour_m:
            return False
        if away_m - _distance_m(images, path[-1], config.share) < config.least_gain_m:
            return False
        self._path = path
        self._until_ns = step.frame.stamp_ns + round(config.most_s * NANOSECONDS)
        return True

    def act(self, step: StepContext, search: Search, find: Find) -> Action | None:
        """Return the action of the way that `begin` found; None at its end or once time is up."""
        if self._path is None or step.frame.stamp_ns > self._until_ns:
            return None
        frame = step.frame
        plan = plan_along(self._path, step.plan, frame.T_world_base)
        assert plan.target is not None
        end = self._path[-1]
        camera_z_m = float(frame.T_world_base[2, 3]) + self._robot.camera_height_m
        yaw_rad, tilt_rad = yaw_tilt_to(end, np.array(find.position_world), camera_z_m)
        target = dataclasses.replace(
            plan.target, yaw_rad=yaw_rad, tilt_rad=self._robot.within_tilt(tilt_rad)
        )
        plan = dataclasses.replace(plan, target=target)
        command = step.follow(plan)
        if step.follower.reached:
            return None
        command = dataclasses.replace(command, tilt_rad=target.tilt_rad)
        why = f"going a little closer to {search.goal.display}"
        return Action(command, MissionState.APPROACHING, why, plan)


def _distance_m(images: Sequence[Float64Array], xy: Float64Array, share: float) -> float:
    """Return the distance from (2,) within which a share of the recognised points lies.

    The median over images, each with its (M, 2) points, metres.
    """
    return float(np.median([np.quantile(np.hypot(*(p - xy).T), share) for p in images]))

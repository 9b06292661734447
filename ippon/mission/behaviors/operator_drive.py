"""Behaviors of a robot that the operator drives, by hand or to a point on the floor."""

import dataclasses
import math

import numpy as np

from ippon.geometry import Float64Array, yaw_of
from ippon.guidance.levels import Level
from ippon.mission.behaviors.behavior import Action, StepContext
from ippon.mission.journal import Journal
from ippon.mission.operator_control import OperatorControl, path_length, path_to
from ippon.planning.interface import Planner
from ippon.planning.plan import NodeKind, Plan, Viewpoint


class ManualDrive:
    """Leaves driving to the operator; mapping and planning continue."""

    def __init__(self, operator: OperatorControl) -> None:
        self._operator = operator

    def act(self, step: StepContext) -> Action | None:
        """See `Behavior.act`."""
        if not self._operator.drives or self._operator.waypoint is not None:
            return None
        return Action(step.hold, why="driven by hand; the map goes on growing")


class GoToPoint:
    """Drives to the operator's point; ends there, or once no path leads to it."""

    def __init__(self, operator: OperatorControl, planner: Planner, journal: Journal) -> None:
        self._operator = operator
        self._planner = planner
        self._journal = journal

    def act(self, step: StepContext) -> Action | None:
        """See `Behavior.act`."""
        waypoint = self._operator.waypoint
        if waypoint is None:
            return None
        T_world_base = step.frame.T_world_base
        path = path_to(self._planner, waypoint, T_world_base)
        if path is None:
            return Action(step.hold, why=self._end("there is no path to the point any more"))
        plan = plan_along(path, step.plan, T_world_base)
        command = step.follow(plan)
        why = f"going to your point, {path_length(path):.1f} m"
        if step.follower.reached:
            why = self._end("at the point that you chose")
        return Action(command, why=why, plan=plan)

    def _end(self, text: str) -> str:
        self._operator.cancel_go_to()
        self._journal.note("drive", text)
        return text


def plan_along(path: Float64Array, base: Plan, T_world_base: Float64Array) -> Plan:
    """Return a plan with the path to the operator's point instead of the planner's target.

    Args:
        path: (K, 2) points from the robot to the end, metres.
        base: The planner's plan of this step.
        T_world_base: Pose of the robot.
    """
    z = float(T_world_base[2, 3])
    target = Viewpoint(
        position_world=(float(path[-1, 0]), float(path[-1, 1]), z),
        yaw_rad=_arrival_heading(path, T_world_base),
        tilt_rad=0.0,
        gain=0.0,
        termination=0.0,
        level=Level.AVERAGE,
        kind=NodeKind.MINIMAL,
        path_gain=0.0,
        path_cost_s=path_length(path),
    )
    path_world = np.column_stack([path, np.full(len(path), z)])
    return dataclasses.replace(base, target=target, path_world=path_world, exhausted=False)


def _arrival_heading(path: Float64Array, T_world_base: Float64Array) -> float:
    """Return the direction of the last segment that is longer than 0.1 m, else the robot's yaw."""
    for a, b in zip(path[-2::-1], path[:0:-1], strict=True):
        if np.linalg.norm(b - a) > 0.1:
            return math.atan2(b[1] - a[1], b[0] - a[0])
    return yaw_of(T_world_base)

"""The upper bound: a robot that drives to the object on the shortest path."""

import math

import numpy as np
from numpy.typing import NDArray

from ippon.command import Command
from ippon.evaluation.metrics import Judge
from ippon.geometry import Float64Array
from ippon.guidance.levels import Level
from ippon.mapping.arrays import MapArrays
from ippon.mapping.far_evidence.joint_evidence import EvidenceAhead
from ippon.planning.plan import NodeKind, Plan, TreeView, Viewpoint
from ippon.simulation.scene import Scene


class OraclePlanner:
    """Follows the shortest path to the nearest viewpoint of the goal, from ground truth.

    It neither maps nor explores; its SPL is below 1 only because of body, controller and the
    distance needed to stop.
    """

    def __init__(self, scene: Scene, judge: Judge, wide: Judge) -> None:
        """Store the ground truth.

        Args:
            scene: The home.
            judge: Viewpoints and paths of this robot.
            wide: The same for a slightly wider body, whose paths leave room to drive; used where it
                has a path.
        """
        self._scene = scene
        self._judges = (wide, judge)

    def set_goal(self, *, probabilities: NDArray[np.float32], termination_min: float) -> None:
        """Do nothing: the goal is the judge's."""

    def set_levels(self, *, probabilities: NDArray[np.float32], termination_min: float) -> None:
        """Do nothing: the goal is the judge's."""

    def set_termination_min(self, termination_min: float) -> None:
        """Do nothing: the goal is the judge's."""

    def set_searching(self, searching: bool, *, counts: bool = True) -> None:
        """Do nothing: the path is the same."""

    def set_far_evidence(self, far_evidence: EvidenceAhead | None) -> None:
        """Do nothing."""

    def note_height(self, z_m: float) -> None:
        """Do nothing: the path is known to be free."""

    def mark_contact(self, T_world_base: Float64Array, motion: Command | None = None) -> None:
        """Do nothing: the path is known to be free."""

    def mark_unreachable(self, xy: tuple[float, float]) -> None:
        """Do nothing: the path is known to be free."""

    def step(self, map_arrays: MapArrays, T_world_base: Float64Array, tilt_rad: float) -> Plan:
        """See `Planner.step`."""
        del map_arrays
        x, y, z = (float(c) for c in T_world_base[:3, 3])
        path = next((p for j in self._judges if len(p := j.path_from((x, y)))), np.empty((0, 2)))
        if len(path) == 0:
            return Plan(
                target=None,
                path_world=np.zeros((0, 3)),
                tree=_lone_root(x, y, z, tilt_rad),
                exhausted=True,
                evaluated=0,
            )
        end = path[-1]
        nearest = self._object_near(end)
        target = Viewpoint(
            position_world=(float(end[0]), float(end[1]), z),
            yaw_rad=math.atan2(nearest[1] - end[1], nearest[0] - end[0]),
            tilt_rad=tilt_rad,
            gain=0.0,
            termination=1.0,
            level=Level.CERTAIN,
            kind=NodeKind.TERMINATING,
            path_gain=0.0,
            path_cost_s=0.0,
        )
        return Plan(
            target=target,
            path_world=np.column_stack([path, np.full(len(path), z)]),
            tree=_lone_root(x, y, z, tilt_rad),
            exhausted=False,
            evaluated=0,
        )

    def _object_near(self, point: Float64Array) -> tuple[float, float]:
        """Return the centre of the goal's instance nearest to a point."""
        instances = [self._scene.instances[k] for k in self._judges[1].instances]
        middles = [
            (
                0.5 * (i.aabb_min[0] + i.aabb_max[0]),
                0.5 * (i.aabb_min[1] + i.aabb_max[1]),
            )
            for i in instances
        ]
        return min(middles, key=lambda m: math.dist(m, (float(point[0]), float(point[1]))))


def _lone_root(x: float, y: float, z: float, tilt_rad: float) -> TreeView:
    zero, none = np.zeros(1, np.float32), np.zeros(1, np.uint8)
    return TreeView(
        positions_world=np.array([[x, y, z]], np.float32),
        parents=np.array([-1], np.int32),
        yaws_rad=zero,
        tilts_rad=np.array([tilt_rad], np.float32),
        gains=zero,
        terminations=zero,
        path_costs_s=zero,
        levels=none,
        kinds=none,
    )

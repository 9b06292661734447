"""Success and efficiency of one search, as habitat-lab defines them."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ippon.evaluation.geodesic import GeodesicField
from ippon.evaluation.goal_objects import matching_instances, viewpoints
from ippon.robot import RobotProfile
from ippon.simulation.camera.line_of_sight import LineOfSight
from ippon.simulation.robot.navigation_grid import NavigationGrid, robot_grid
from ippon.simulation.scene import Scene, StartPose

SUCCESS_DISTANCE_M = 0.1
"""A search succeeds when it stops nearer than this, over the floor, to a viewpoint."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Metrics:
    """How one search went."""

    success: bool
    """Stop was called within `SUCCESS_DISTANCE_M` of a viewpoint of the object."""
    spl: float
    """Success weighted by path length: S d0 / max(d0, L)."""
    soft_spl: float
    """Progress weighted by path length: max(0, 1 - dT / d0) d0 / max(d0, L); needs no stop."""
    path_length_m: float
    """L: sum of the base's straight displacements from sample to sample."""
    shortest_path_m: float
    """d0: from the start to the nearest viewpoint, infinite where there is no way."""
    distance_to_goal_m: float
    """dT: from the end to the nearest viewpoint, infinite where there is no way."""


def search_metrics(
    *,
    shortest_path_m: float,
    distance_to_goal_m: float,
    path_length_m: float,
    stopped: bool,
) -> Metrics:
    """Compute the metrics of habitat-lab (`tasks/nav/nav.py`) without its undefined cases.

    A start that is itself a viewpoint (d0 = 0) counts as all progress made while the end is one
    too; a start without a way to the goal scores 0 instead of NaN.
    """
    d0, dT, length = shortest_path_m, distance_to_goal_m, path_length_m
    success = stopped and dT < SUCCESS_DISTANCE_M
    if not math.isfinite(d0):
        efficiency, progress = 0.0, 0.0
    elif d0 == 0.0:
        efficiency = 1.0 if length == 0.0 else 0.0
        progress = 1.0 if dT == 0.0 else 0.0
    else:
        efficiency = d0 / max(d0, length)
        progress = max(0.0, 1.0 - dT / d0)
    return Metrics(
        success=success,
        spl=efficiency if success else 0.0,
        soft_spl=progress * efficiency,
        path_length_m=length,
        shortest_path_m=d0,
        distance_to_goal_m=dT,
    )


class Judge:
    """Scores searches for one goal in one home by one robot, from the home's ground truth."""

    def __init__(
        self, scene: Scene, robot: RobotProfile, goal: str, *, grid: NavigationGrid | None = None
    ) -> None:
        """Find the goal's objects, their viewpoints, and the ways to them.

        Args:
            scene: The home.
            robot: Body and camera.
            goal: Label or category; see `matching_instances`.
            grid: Floor grid of this home and robot, when it is at hand.
        """
        grid = robot_grid(scene, robot) if grid is None else grid
        sight = LineOfSight(scene)
        self.instances = matching_instances(scene, goal)
        """Rows of `scene.instances` that the goal means; empty when the home has none."""
        found = [viewpoints(scene, grid, robot, k, sight) for k in self.instances]
        self.viewpoints: NDArray[np.float64] = np.concatenate(found) if found else np.empty((0, 2))
        """(N, 2) positions in metres from which one of them is seen."""
        self._seen_from = np.repeat(np.array(self.instances, np.int64), [len(f) for f in found])
        self._field = GeodesicField(grid, self.viewpoints)

    def distance_m(self, position: ArrayLike) -> float:
        """Return the metres over the floor from (x, y, ...) to the nearest viewpoint.

        Raises:
            ValueError: The position is not finite.
        """
        x, y = (float(v) for v in np.asarray(position, np.float64)[:2])
        if not (math.isfinite(x) and math.isfinite(y)):
            raise ValueError(f"a position needs finite x and y; got {x}, {y}")
        return self._field.distance_from(x, y)

    def shortest_path_m(self, start: StartPose) -> float:
        """Return the length of the shortest way to success, infinite where there is none."""
        return self.distance_m((start.x, start.y))

    def path_from(self, position: ArrayLike) -> NDArray[np.float64]:
        """Return the (K, 2) corners of the shortest way to a viewpoint; see `GeodesicField`."""
        x, y = (float(v) for v in np.asarray(position, np.float64)[:2])
        return self._field.path_from(x, y)

    def nearest_instance(self, position: ArrayLike) -> int | None:
        """Return the row of the object that the shortest way from (x, y, ...) leads to, or None."""
        way = self.path_from(position)
        if not len(way):
            return None
        apart = np.hypot(*(self.viewpoints - way[-1]).T)
        return int(self._seen_from[np.argmin(apart)])

    def is_success(self, position: ArrayLike) -> bool:
        """Tell whether stopping at (x, y, ...) counts as having found the object."""
        return self.distance_m(position) < SUCCESS_DISTANCE_M

    def metrics(self, trajectory: NDArray[np.float64], *, stopped: bool) -> Metrics:
        """Score a search.

        Args:
            trajectory: (N, 2+) true positions of the base in metres, one a time step, from start
                to end.
            stopped: Whether the robot ended the search itself.

        Raises:
            ValueError: The trajectory is empty or not finite.
        """
        path = np.asarray(trajectory, np.float64)
        if path.ndim != 2 or path.shape[0] < 1 or path.shape[1] < 2:
            raise ValueError(
                f"a trajectory is (N, 2 or more) with N of at least 1; got {path.shape}"
            )
        if not np.isfinite(path[:, :2]).all():
            raise ValueError("a trajectory needs finite positions")
        steps = np.diff(path[:, :2], axis=0)
        return search_metrics(
            shortest_path_m=self.distance_m(path[0]),
            distance_to_goal_m=self.distance_m(path[-1]),
            path_length_m=float(np.hypot(steps[:, 0], steps[:, 1]).sum()),
            stopped=stopped,
        )

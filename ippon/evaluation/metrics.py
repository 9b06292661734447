"""Success and path efficiency of one search, as defined by habitat-lab."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ippon.evaluation.geodesic import GeodesicField
from ippon.evaluation.goal_colours import has_colour
from ippon.evaluation.goal_objects import goal_viewpoints, matching_instances
from ippon.robot import RobotProfile
from ippon.simulation.camera.line_of_sight import LineOfSight
from ippon.simulation.robot.navigation_grid import NavigationGrid, robot_grid
from ippon.simulation.scene import Scene, StartPose

SUCCESS_DISTANCE_M = 0.1
"""Distance over the floor to a viewpoint within which a stop is a success."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Metrics:
    """Metrics of one search."""

    success: bool
    """Whether the search stopped within `SUCCESS_DISTANCE_M` of a viewpoint of the object."""
    spl: float
    """Success weighted by path length: S d0 / max(d0, L)."""
    soft_spl: float
    """Progress weighted by path length: max(0, 1 - dT / d0) d0 / max(d0, L); needs no stop."""
    path_length_m: float
    """L: sum of the base's straight displacements between samples."""
    shortest_path_m: float
    """d0: from the start to the nearest viewpoint, infinite without a path."""
    distance_to_goal_m: float
    """dT: from the end to the nearest viewpoint, infinite without a path."""


def search_metrics(
    *,
    shortest_path_m: float,
    distance_to_goal_m: float,
    path_length_m: float,
    stopped: bool,
) -> Metrics:
    """Return the metrics of habitat-lab (`tasks/nav/nav.py`), defined in all cases.

    If the start is itself a viewpoint (d0 = 0), all progress counts as made while the end is one
    too. A start without a path to the goal scores 0 instead of NaN.
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
    """Scores searches for one goal in one home by one robot, from ground truth."""

    def __init__(
        self,
        scene: Scene,
        robot: RobotProfile,
        goal: str,
        *,
        colour: str = "",
        grid: NavigationGrid | None = None,
        sight: LineOfSight | None = None,
    ) -> None:
        """Find the goal's instances, their viewpoints, and the paths to them.

        Args:
            scene: The home.
            robot: Body and camera.
            goal: Label or category; see `matching_instances`.
            colour: Colour of the instances that count; empty for all.
            grid: Navigation grid of this home and robot, if already computed.
            sight: Line-of-sight tests in this home, if already prepared.
        """
        grid = robot_grid(scene, robot) if grid is None else grid
        sight = LineOfSight(scene) if sight is None else sight
        alike = matching_instances(scene, goal)
        self.colour = colour
        self.instances = tuple(k for k in alike if not colour or has_colour(scene, k, colour))
        """Rows of `scene.instances` that match the goal."""
        self.wrong_instances = tuple(k for k in alike if k not in self.instances)
        """Rows of its kind in another colour."""
        found = [goal_viewpoints(scene, grid, robot, k, sight) for k in self.instances]
        self.viewpoints: NDArray[np.float64] = np.concatenate(found) if found else np.empty((0, 2))
        """(N, 2) positions in metres from which one of them is visible."""
        self._seen_from = np.repeat(np.array(self.instances, np.int64), [len(f) for f in found])
        self._field = GeodesicField(grid, self.viewpoints)

    def distance_m(self, position: ArrayLike) -> float:
        """Return the distance over the floor from (x, y, ...) to the nearest viewpoint, metres.

        Raises:
            ValueError: The position is not finite.
        """
        x, y = (float(v) for v in np.asarray(position, np.float64)[:2])
        if not (math.isfinite(x) and math.isfinite(y)):
            raise ValueError(f"a position needs finite x and y; got {x}, {y}")
        return self._field.distance_from(x, y)

    def shortest_path_m(self, start: StartPose) -> float:
        """Return the length of the shortest path to a viewpoint, infinite without a path."""
        return self.distance_m((start.x, start.y))

    def path_from(self, position: ArrayLike) -> NDArray[np.float64]:
        """Return the (K, 2) corners of the shortest path to a viewpoint; see `GeodesicField`."""
        x, y = (float(v) for v in np.asarray(position, np.float64)[:2])
        return self._field.path_from(x, y)

    def nearest_instance(self, position: ArrayLike) -> int | None:
        """Return the instance at the end of the shortest path from (x, y, ...), or None."""
        path = self.path_from(position)
        if not len(path):
            return None
        apart = np.hypot(*(self.viewpoints - path[-1]).T)
        return int(self._seen_from[np.argmin(apart)])

    def is_success(self, position: ArrayLike) -> bool:
        """Tell whether stopping at (x, y, ...) counts as a success."""
        return self.distance_m(position) < SUCCESS_DISTANCE_M

    def first_success(self, trajectory: NDArray[np.float64], since: int) -> int:
        """Return the first point of a trajectory, from one on, where a stop counts; -1 for none."""
        points = range(since, len(trajectory))
        return next((k for k in points if self.is_success(trajectory[k])), -1)

    def attainable_spl(self, trajectory: NDArray[np.float64], point: int) -> float:
        """Return the SPL of a search that goes straight to the object from a point of its way.

        Args:
            trajectory: (N, 2+) true positions of the base in metres, one per time step.
            point: Row of the trajectory from which the way is the shortest one to a place where a
                stop counts.
        """
        left_m = self.distance_m(trajectory[point])
        return search_metrics(
            shortest_path_m=self.distance_m(trajectory[0]),
            distance_to_goal_m=0.0,
            path_length_m=_length_m(trajectory[: point + 1])
            + max(0.0, left_m - SUCCESS_DISTANCE_M),
            stopped=math.isfinite(left_m),
        ).spl

    def metrics(self, trajectory: NDArray[np.float64], *, stopped: bool) -> Metrics:
        """Score a search.

        Args:
            trajectory: (N, 2+) true positions of the base in metres, one per time step.
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
        return search_metrics(
            shortest_path_m=self.distance_m(path[0]),
            distance_to_goal_m=self.distance_m(path[-1]),
            path_length_m=_length_m(path),
            stopped=stopped,
        )


def _length_m(path: NDArray[np.float64]) -> float:
    steps = np.diff(path[:, :2], axis=0)
    return float(np.hypot(steps[:, 0], steps[:, 1]).sum())

"""The navigation of a simulated robot that takes goals: shortest path over the true floor."""

import math
from typing import Any, Final

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from ippon.command import Command, GoalOutcome, NavigationGoal
from ippon.geometry import Float64Array, wrap_angle
from ippon.robot import RobotProfile
from ippon.simulation.robot.navigation_grid import NavigationGrid, navigation_grid
from ippon.simulation.scene import Scene, StartPose

_csgraph: Any = csgraph
_sparse: Any = sparse
"""Untyped, because scipy has no types."""
ARRIVED_M: Final = 0.1
ARRIVED_RAD: Final = 0.1
TURNS_RAD: Final = 0.4
"""Heading error above which the robot turns on the spot."""
AHEAD_CELLS: Final = 6
CELL_M: Final = 0.05


class GoalNavigation:
    """Drives a round robot to one goal at a time and reports what became of it."""

    def __init__(self, scene: Scene, robot: RobotProfile, start: StartPose) -> None:
        self._robot = robot
        self._scene = scene
        self._z = start.z
        self._grid: NavigationGrid | None = None
        self._goal: NavigationGoal | None = None
        self._path: Float64Array = np.zeros((0, 2))
        self._reports: list[tuple[int, GoalOutcome]] = []

    def take_reports(self) -> list[tuple[int, GoalOutcome]]:
        """Return number and outcome of goals since the last call."""
        reports, self._reports = self._reports, []
        return reports

    def velocities(
        self, goal: NavigationGoal | None, pose: tuple[float, float, float], tilt_rad: float
    ) -> Command:
        """Return the velocities towards a goal.

        Args:
            goal: None ends the present one.
            pose: World x, y and yaw of the robot.
            tilt_rad: Passed on.
        """
        if goal is None or self._goal is None or goal.number != self._goal.number:
            self._accept(goal, pose)
        if self._goal is None or len(self._path) == 0:
            return Command(tilt_rad=tilt_rad)
        linear, turn = self._drive(self._goal, pose)
        return Command(linear_m_s=linear, yaw_rate_rad_s=turn, tilt_rad=tilt_rad)

    def _accept(self, goal: NavigationGoal | None, pose: tuple[float, float, float]) -> None:
        if self._goal is not None and len(self._path):
            self._reports.append((self._goal.number, GoalOutcome.CANCELLED))
        self._goal, self._path = goal, np.zeros((0, 2))
        if goal is None:
            return
        self._path = self._plan(goal, pose)
        outcome = GoalOutcome.ACCEPTED if len(self._path) else GoalOutcome.FAILED
        self._reports.append((goal.number, outcome))

    def _drive(self, goal: NavigationGoal, pose: tuple[float, float, float]) -> tuple[float, float]:
        x, y, yaw = pose
        robot = self._robot
        self._path = self._path[int(np.argmin(np.hypot(*(self._path - (x, y)).T))) :]
        left = math.hypot(goal.x_m - x, goal.y_m - y)
        if left <= ARRIVED_M:
            error = wrap_angle(goal.yaw_rad - yaw)
            if abs(error) <= ARRIVED_RAD:
                self._reports.append((goal.number, GoalOutcome.REACHED))
                self._path = np.zeros((0, 2))
                return 0.0, 0.0
            return 0.0, _clip(1.5 * error, robot.max_yaw_rate_rad_s)
        aim = self._path[min(AHEAD_CELLS, len(self._path) - 1)]
        error = wrap_angle(math.atan2(aim[1] - y, aim[0] - x) - yaw)
        turn = _clip(1.5 * error, robot.max_yaw_rate_rad_s)
        if abs(error) > TURNS_RAD:
            return 0.0, turn
        return min(robot.max_linear_m_s, 0.8 * left), turn

    def _plan(self, goal: NavigationGoal, pose: tuple[float, float, float]) -> Float64Array:
        """Return (K, 2) points to the goal that prefer free space; K = 0 where there is none."""
        grid = self._floor()
        start = grid.nearest_free(pose[0], pose[1], 0.5)
        end = grid.nearest_free(goal.x_m, goal.y_m, 0.1)
        if start is None or end is None or grid.region[start] != grid.region[end]:
            return np.zeros((0, 2))
        ny = grid.free.shape[1]
        cells = _shortest(grid, start[0] * ny + start[1], end[0] * ny + end[1])
        points = grid.points_of(np.column_stack(np.divmod(cells, ny)))
        return np.vstack([points, [goal.x_m, goal.y_m]])

    def _floor(self) -> NavigationGrid:
        if self._grid is None:
            robot = self._robot
            self._grid = navigation_grid(
                self._scene, radius_m=robot.radius_m, height_m=robot.height_m,
                max_step_m=robot.max_step_m, floor_z_m=self._z, cell_m=CELL_M,
            )  # fmt: skip
        return self._grid


def _shortest(grid: NavigationGrid, start: int, end: int) -> np.ndarray[Any, np.dtype[np.int64]]:
    """Return the flat cells of the cheapest path over neighbouring free cells."""
    nx, ny = grid.free.shape
    index = np.arange(nx * ny).reshape(nx, ny)
    cost = 1.0 + 0.1 / np.maximum(grid.clearance_m, 0.05)
    rows: list[Any] = []
    columns: list[Any] = []
    weights: list[Any] = []
    for dx, dy in ((1, 0), (0, 1), (1, 1), (1, -1)):
        here = (slice(0, nx - dx), slice(max(0, -dy), ny - max(0, dy)))
        there = (slice(dx, nx), slice(max(0, dy), ny + min(0, dy)))
        both = grid.free[here] & grid.free[there]
        rows.append(index[here][both])
        columns.append(index[there][both])
        weights.append(math.hypot(dx, dy) * 0.5 * (cost[here] + cost[there])[both])
    shape = (nx * ny, nx * ny)
    parts = (np.concatenate(weights), (np.concatenate(rows), np.concatenate(columns)))
    graph = _sparse.csr_matrix(parts, shape=shape)
    _, before = _csgraph.dijkstra(graph, directed=False, indices=start, return_predecessors=True)
    cells = [end]
    while cells[-1] != start:
        cells.append(int(before[cells[-1]]))
    return np.array(cells[::-1], np.int64)


def _clip(value: float, limit: float) -> float:
    return max(-limit, min(limit, value))

"""Connecting the robot, the root of the tree, to the roadmap, and points that are no nodes."""

import math
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ippon.geometry import Float64Array, yaw_of
from ippon.planning.deadline import UNLIMITED, Deadline
from ippon.planning.roadmap.connection import ConnectionConfig
from ippon.planning.roadmap.local_planner import SAME_PLACE_M, LocalPlanner
from ippon.planning.roadmap.roadmap import Roadmap
from ippon.planning.roadmap.robot_path import AT_NODE_M, drive_time, shorten_path
from ippon.planning.roadmap.shortest_tree import RootEdges, ShortestTree
from ippon.planning.terrain.motion_check import move_between
from ippon.planning.terrain.path_geometry import rejoined_path, remaining_path
from ippon.planning.terrain.traversability import Traversability
from ippon.robot import RobotProfile


class RootConnector:
    """Finds the edges from the robot to nodes near it."""

    def __init__(
        self,
        config: ConnectionConfig,
        roadmap: Roadmap,
        floor: Traversability,
        local_planner: LocalPlanner,
        robot: RobotProfile,
    ) -> None:
        self._config = config
        self._roadmap = roadmap
        self._floor = floor
        self._local_planner = local_planner
        self._robot = robot
        self._shut_in: tuple[int, float, tuple[float, float], tuple[int, ...], int] | None = None
        """The last place without a path into the roadmap: count of floor changes at that time,
        margin, the place, the nodes near it, and how many of them the local planner has tried."""

    def edges(
        self,
        x: float,
        y: float,
        yaw: float,
        target: int | None,
        path: Float64Array | None,
        deadline: Deadline = UNLIMITED,
    ) -> RootEdges:
        """Find the edges from the robot into the roadmap.

        Args:
            x: Robot, metres.
            y: Robot, metres.
            yaw: Its heading, radians.
            target: Node that the robot drives to, None for none.
            path: (K, 2) path to it, None for none.
            deadline: Ends the local planner's queries, which run if no straight move is free.
        """
        found: list[tuple[int, float, Float64Array]] = []
        if target is not None and path is not None:
            rest = remaining_path(path, x, y)
            time = self._drive_time(rest, self._floor.margin_m, yaw)
            if time is None:
                # Path tracking is inexact; the margin of the path allows for that.
                rest = rejoined_path(path, x, y, self._config.rejoin_m)
                time = self._drive_time(rest, min(self._floor.margin_m, 0.0), yaw)
            if time is not None:
                found.append((target, time, rest))
        nodes = self._roadmap.near(x, y, self._config.radius_m, 2 * self._config.neighbours)
        for node in nodes:
            move = self._straight(x, y, yaw, int(node))
            if move is not None:
                found.append(move)
        if not found:
            found = self._detours(x, y, yaw, nodes[: self._config.local_planner_nodes], deadline)
        return RootEdges(
            node=np.array([f[0] for f in found], dtype=np.int64),
            time=np.array([f[1] for f in found], dtype=np.float64),
            depart=np.array([_direction(f[2], 0, yaw) for f in found], dtype=np.float64),
            arrive=np.array([_direction(f[2], -2, yaw) for f in found], dtype=np.float64),
            paths=tuple(f[2] for f in found),
        )

    def path_to_point(
        self,
        goal: Float64Array,
        T_world_base: Float64Array,
        root_edges: RootEdges,
        tree: ShortestTree,
    ) -> Float64Array | None:
        """Find a path from the robot to a point that is no node, by straight moves at its end.

        Args:
            goal: (2,) where the robot can stand, metres.
            T_world_base: Pose of the robot.
            root_edges: Edges from the robot into the roadmap.
            tree: Best paths to the nodes.

        Returns:
            (K, 2) points from the robot to the goal, metres; None if no path was found.
        """
        floor, roadmap = self._floor, self._roadmap
        straight, yaw = np.stack([T_world_base[:2, 3], goal]), yaw_of(T_world_base)
        if self._drive_time(straight, floor.margin_m, yaw) is not None:
            return straight
        best, path = math.inf, None
        for node in self._nodes_near(goal, tree):
            free, time, _ = move_between(
                floor.grid, floor.limits, roadmap.xy[node], goal, floor.margin_m
            )
            if free and tree.cost[node] + time < best:
                best, path = tree.cost[node] + time, roadmap.path_to(node, tree, root_edges)
        return None if path is None else shorten_path(np.vstack([path, goal]), floor, yaw)

    def detour_to_point(
        self,
        goal: Float64Array,
        T_world_base: Float64Array,
        root_edges: RootEdges,
        tree: ShortestTree,
    ) -> Float64Array | None:
        """Find a path whose end is the local planner's; see `path_to_point`."""
        for node in self._nodes_near(goal, tree)[: self._config.local_planner_nodes]:
            detour = self._local_planner.solve(self._roadmap.xy[node], goal)
            if detour is not None:
                path = np.vstack([self._roadmap.path_to(node, tree, root_edges), detour[1:]])
                return shorten_path(path, self._floor, yaw_of(T_world_base))
        return None

    def _nodes_near(self, goal: Float64Array, tree: ShortestTree) -> list[int]:
        """Return the nodes near a point (2,) that the robot can reach, nearest first."""
        nodes = self._roadmap.near(
            float(goal[0]), float(goal[1]), self._config.radius_m, 2 * self._config.neighbours
        )
        return [int(n) for n in nodes if np.isfinite(tree.cost[n])]

    def _straight(
        self, x: float, y: float, yaw: float, node: int
    ) -> tuple[int, float, Float64Array] | None:
        """Return node, seconds and (2, 2) path of a straight move; None if it is blocked."""
        path = np.array([(x, y), self._roadmap.xy[node]])
        for margin in (self._floor.margin_m + self._floor.config.comfort_m, self._floor.margin_m):
            time = self._drive_time(path, margin, yaw)
            if time is not None:
                return node, time, path
        return None

    def _detours(
        self, x: float, y: float, yaw: float, nodes: NDArray[np.int64], deadline: Deadline
    ) -> list[tuple[int, float, Float64Array]]:
        """Return the first detour to any of some nodes, as `_straight` does; empty for none."""
        near = tuple(nodes.tolist())
        tried = self._tried_here(x, y, near)
        if 0 < tried == len(near):
            return []
        for node in near[tried:]:
            path = self._local_planner.solve(np.array([x, y]), self._roadmap.xy[node], deadline)
            time = None if path is None else self._drive_time(path, self._floor.margin_m, yaw)
            if path is not None and time is not None:
                return [(node, time, path)]
            if self._local_planner.unfinished:
                break
            tried += 1
        margin_m, floor_changes = self._floor.margin_m, self._local_planner.floor_changes
        self._shut_in = floor_changes, margin_m, (x, y), near, tried
        return []

    def _tried_here(self, x: float, y: float, nodes: tuple[int, ...]) -> int:
        """Return how many of the nodes the local planner has tried from here without success."""
        if self._shut_in is None:
            return 0
        floor_changes, margin_m, place, near, tried = self._shut_in
        same = near == nodes and math.dist(place, (x, y)) <= SAME_PLACE_M
        same = same and self._floor.margin_m >= margin_m
        return tried if same and not self._local_planner.may_retry(floor_changes) else 0

    def _drive_time(self, path: Float64Array, margin: float, yaw: float) -> float | None:
        return drive_time(path, self._floor, self._robot, margin, yaw)


def _direction(path: Float64Array, at: int, yaw: float) -> float:
    """Return the heading at the start (0) or end (-2) of a path; `yaw` if the path is a point."""
    if sum(math.dist(a, b) for a, b in pairwise(path.tolist())) < AT_NODE_M:
        return yaw
    step = path[at + 1] - path[at] if at >= 0 else path[-1] - path[-2]
    return math.atan2(step[1], step[0])

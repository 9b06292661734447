"""Connecting viewpoints: by straight moves where they are free, else by the local planner."""

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ippon.geometry import Float64Array
from ippon.planning.deadline import UNLIMITED, Deadline
from ippon.planning.roadmap.local_planner import LocalPlanner
from ippon.planning.roadmap.roadmap import Roadmap, path_time, turning_time
from ippon.planning.roadmap.shortest_tree import ShortestTree
from ippon.planning.terrain.motion_check import move_between
from ippon.planning.terrain.traversability import Traversability
from ippon.robot import RobotProfile


@dataclass(frozen=True, slots=True, kw_only=True)
class ConnectionConfig:
    """Which nodes are connected, and how the robot joins the roadmap."""

    radius_m: float = 2.5
    """Longest straight edge; more gives straighter paths and checks more moves."""
    neighbours: int = 10
    """Nearest nodes that a node is connected to at most; more gives shorter paths and checks more
    moves."""
    rejoin_m: float = 0.15
    """A robot beside its path that cannot cut across rejoins it this far ahead; more returns at a
    flatter angle."""
    local_planner_nodes: int = 3
    """Nodes that the local planner tries to connect the robot to, nearest first, if no straight
    move is free; more takes longer where the robot is shut in."""
    reconnected_nodes: int = 6
    """Nodes connected again after a change of the floor at most; more finds opened passages
    sooner."""
    waypoint_reach_m: float = 0.75
    """How far a point that the operator chose may be from where the robot can stand, for example on
    a table; more accepts more points and stops farther from them."""

    def __post_init__(self) -> None:
        """Reject values that connect nothing."""
        if self.radius_m <= 0.0 or self.neighbours < 1:
            raise ValueError(
                "radius_m must be above 0 and neighbours at least 1; got "
                f"{self.radius_m} and {self.neighbours}"
            )
        if self.rejoin_m < 0.0 or self.waypoint_reach_m < 0.0:
            raise ValueError("rejoin_m and waypoint_reach_m must not be negative")


class Connector:
    """Adds edges to the roadmap and keeps them consistent with the floor."""

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
        self._turn_rate = robot.max_yaw_rate_rad_s
        self._next = 0
        self._failed: dict[tuple[int, int], int] = {}
        """Pairs of nodes without a path between them; count of floor changes at that time."""
        self._failed_margin_m = floor.margin_m
        """Margin with which they failed; a smaller one may join them."""

    @property
    def _margin(self) -> float:
        return self._floor.margin_m

    def update_floor(self, box: tuple[int, int, int, int]) -> list[int]:
        """Recheck nodes and edges where the floor changed.

        Args:
            box: Cells (i0, i1, j0, j1) that changed.

        Returns:
            Nodes that were removed.
        """
        self._local_planner.note_floor_change()
        grid = self._floor.grid
        gone, _ = self._roadmap.recheck(grid, self._floor.limits, box, self._margin)
        self._failed = {
            pair: floor_changes
            for pair, floor_changes in self._failed.items()
            if not (
                self._local_planner.may_retry(floor_changes)
                and self._in_box(self._middle(pair)[None], box)[0]
            )
        }
        self._forget(gone)
        self._reconnect(box)
        return gone

    def thin_out(self, crowded: Collection[int]) -> None:
        """Remove nodes, and reconnect their neighbours.

        Args:
            crowded: Nodes that other nodes can stand in for.
        """
        orphans = self._roadmap.neighbours(crowded)
        for node in crowded:
            self._roadmap.remove_node(node)
        self._forget(crowded)
        for node in sorted(orphans):
            self.connect(node)

    def connect(self, node: int) -> None:
        """Add the free straight edges of a node."""
        self._roadmap.connect(
            node,
            self._floor.grid,
            self._floor.limits,
            radius=self._config.radius_m,
            most=self._config.neighbours,
            margin=self._margin + self._floor.config.comfort_m,
        )

    def connect_pair(self, a: int, b: int) -> bool:
        """Add the straight edge between two nodes, however tight; return whether it is free."""
        xy, margin = self._roadmap.xy, self._margin
        free, time, _ = move_between(self._floor.grid, self._floor.limits, xy[a], xy[b], margin)
        if free:
            self._roadmap.add_edge(a, b, time)
        return free

    def bridge(
        self,
        tree: ShortestTree,
        reachable: NDArray[np.uint8],
        deadline: Deadline = UNLIMITED,
    ) -> bool:
        """Connect a node to the tree that the floor reaches but no straight edge does.

        The nearest pair that has not failed yet is tried.

        Args:
            tree: Best paths to the nodes.
            reachable: (X, Y) from `reachable_cells`.
            deadline: Ends the query, which continues in the next call.

        Returns:
            Whether an edge was added.
        """
        grid, nodes = self._floor.grid, self._roadmap.nodes
        reached = nodes[np.isfinite(tree.cost[nodes])]
        lost = nodes[~np.isfinite(tree.cost[nodes])]
        if not len(reached) or not len(lost):
            return False
        if self._margin < self._failed_margin_m:
            self._failed.clear()
        self._failed_margin_m = self._margin
        cells = np.floor(self._roadmap.xy[lost] / grid.voxel_size).astype(np.int64) - grid.origin
        lost = lost[reachable[cells[:, 0], cells[:, 1]] > 0]
        apart = np.linalg.norm(
            self._roadmap.xy[lost, None] - self._roadmap.xy[None, reached], axis=2
        )
        near = np.argwhere(apart <= 2.0 * self._config.radius_m)
        order = np.argsort(apart[near[:, 0], near[:, 1]], kind="stable")
        for row, column in near[order].tolist():
            a, b = int(lost[row]), int(reached[column])
            if (a, b) in self._failed or self._roadmap.has_edge(a, b):
                continue
            added = self._join(a, b, deadline)
            if not added and not self._local_planner.unfinished:
                self._failed[a, b] = self._local_planner.floor_changes
            return added
        return False

    def _join(self, a: int, b: int, deadline: Deadline) -> bool:
        """Connect two nodes by the local planner, or else by a tight straight edge."""
        grid, limits, xy = self._floor.grid, self._floor.limits, self._roadmap.xy
        path = self._local_planner.solve(xy[a], xy[b], deadline)
        if path is not None:
            time = path_time(grid, limits, path, self._margin)
            if time is not None:
                self._roadmap.add_edge(a, b, time, path, turning_time(path, self._turn_rate))
                return True
        return not self._local_planner.unfinished and self.connect_pair(a, b)

    def _reconnect(self, box: tuple[int, int, int, int]) -> None:
        """Connect a few nodes in the box again: the change may have freed straight edges."""
        nodes = self._roadmap.nodes
        nodes = nodes[self._in_box(self._roadmap.xy[nodes], box)]
        for _ in range(min(self._config.reconnected_nodes, len(nodes))):
            self._next += 1
            self.connect(int(nodes[self._next % len(nodes)]))

    def _forget(self, gone: Collection[int]) -> None:
        """Forget failed pairs with removed nodes: new nodes may take their numbers."""
        if gone:
            numbers = set(gone)
            self._failed = {
                pair: floor_changes
                for pair, floor_changes in self._failed.items()
                if numbers.isdisjoint(pair)
            }

    def _middle(self, pair: tuple[int, int]) -> Float64Array:
        return self._roadmap.xy[list(pair)].mean(axis=0)

    def _in_box(self, points: Float64Array, box: tuple[int, int, int, int]) -> NDArray[np.bool_]:
        """Return (N,) whether (N, 2) points lie in a box of cells."""
        grid = self._floor.grid
        cells = points / grid.voxel_size - grid.origin
        i, j = cells.T
        return (box[0] <= i) & (i <= box[1]) & (box[2] <= j) & (j <= box[3])

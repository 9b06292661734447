"""Connecting viewpoints: straight where that is free, by OMPL where it is not."""

from collections.abc import Collection
from typing import Final

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

RADIUS_M: Final = 2.5
"""Neighbours farther away than this are not connected directly."""
NEIGHBOURS: Final = 10
COMFORT_M: Final = 0.05
"""Room beside the body, above the margin, that viewpoints and straight edges leave: a voxel is up
to half its edge off the surface. Tighter places are for OMPL, which keeps to their middle."""


class Connector:
    """Adds edges to the roadmap, and follows the floor with those that there are."""

    def __init__(
        self, road: Roadmap, floor: Traversability, queries: LocalPlanner, robot: RobotProfile
    ) -> None:
        self._road = road
        self._floor = floor
        self._queries = queries
        self._turn_rate = robot.max_yaw_rate_rad_s
        self._next = 0
        self._failed: dict[tuple[int, int], int] = {}
        """Pairs of nodes that no way was found between; changes of the floor by then."""

    @property
    def _margin(self) -> float:
        return self._floor.margin_m

    def follow(self, box: tuple[int, int, int, int]) -> list[int]:
        """Recheck the roadmap where the floor changed.

        Args:
            box: Cells (i0, i1, j0, j1) that changed.

        Returns:
            Nodes that were dropped.
        """
        self._queries.note_floor_change()
        grid = self._floor.grid
        gone, _ = self._road.recheck(grid, self._floor.limits, box, self._margin)
        self._failed = {
            pair: floor_changes
            for pair, floor_changes in self._failed.items()
            if not (
                self._queries.may_retry(floor_changes) and self._in_box(self._middle(pair), box)
            )
        }
        self._forget(gone)
        self._rejoin(box)
        return gone

    def thin_out(self, crowded: Collection[int]) -> None:
        """Remove nodes, and join what they joined.

        Args:
            crowded: Nodes that have others nearby.
        """
        orphans = self._road.neighbours(crowded)
        for node in crowded:
            self._road.remove_node(node)
        self._forget(crowded)
        for node in sorted(orphans):
            self.connect(node)

    def connect(self, node: int) -> int:
        """Add the straight edges of a new node; returns their number."""
        return self._road.connect(
            node,
            self._floor.grid,
            self._floor.limits,
            radius=RADIUS_M,
            most=NEIGHBOURS,
            margin=self._margin + COMFORT_M,
        )

    def connect_pair(self, a: int, b: int) -> bool:
        """Add the straight edge of two nodes, tight as it may be; tell whether it is free."""
        xy, margin = self._road.xy, self._margin
        free, time, _ = move_between(self._floor.grid, self._floor.limits, xy[a], xy[b], margin)
        if free:
            self._road.add_edge(a, b, time)
        return free

    def bridge(
        self,
        tree: ShortestTree,
        reachable: NDArray[np.uint8],
        solves: int = 1,
        deadline: Deadline = UNLIMITED,
    ) -> bool:
        """Join nodes to the tree that the floor reaches but no straight edge does.

        Args:
            tree: Cheapest ways to the nodes.
            reachable: (X, Y) from `reachable_cells`.
            solves: Pairs that are tried at most, the nearest ones first.
            deadline: What it ends goes on with the next call.

        Returns:
            Whether an edge was added.
        """
        grid, added = self._floor.grid, False
        nodes = self._road.nodes
        reached = nodes[np.isfinite(tree.cost[nodes])]
        lost = nodes[~np.isfinite(tree.cost[nodes])]
        if not len(reached) or not len(lost):
            return False
        cells = np.floor(self._road.xy[lost] / grid.voxel_size).astype(np.int64) - grid.origin
        lost = lost[reachable[cells[:, 0], cells[:, 1]] > 0]
        apart = np.linalg.norm(self._road.xy[lost, None] - self._road.xy[None, reached], axis=2)
        for flat in np.argsort(apart, axis=None, kind="stable"):
            if solves == 0:
                break
            row, column = np.unravel_index(int(flat), apart.shape)
            if apart[row, column] > 2.0 * RADIUS_M:
                break
            a, b = int(lost[row]), int(reached[column])
            if (a, b) in self._failed or self._road.has_edge(a, b):
                continue
            if self._join(a, b, deadline):
                added = True
            elif not self._queries.unfinished:
                self._failed[a, b] = self._queries.floor_changes
            solves -= 1
        return added

    def _join(self, a: int, b: int, deadline: Deadline) -> bool:
        """Join two nodes by OMPL, or straight through a tight place; tell whether it worked."""
        grid, limits, xy = self._floor.grid, self._floor.limits, self._road.xy
        path = self._queries.solve(xy[a], xy[b], deadline)
        if path is not None:
            time = path_time(grid, limits, path, self._margin)
            if time is not None:
                self._road.add_edge(a, b, time, path, turning_time(path, self._turn_rate))
                return True
        return not self._queries.unfinished and self.connect_pair(a, b)

    def _rejoin(self, box: tuple[int, int, int, int], count: int = 6) -> None:
        """Try a few nodes again for straight edges that the change may have opened."""
        nodes = [int(n) for n in self._road.nodes if self._in_box(self._road.xy[n], box)]
        if not nodes:
            return
        for _ in range(min(count, len(nodes))):
            self._next += 1
            self.connect(nodes[self._next % len(nodes)])

    def _forget(self, gone: Collection[int]) -> None:
        """Drop what is known of removed nodes: others will have their numbers."""
        if gone:
            numbers = set(gone)
            self._failed = {
                pair: floor_changes
                for pair, floor_changes in self._failed.items()
                if numbers.isdisjoint(pair)
            }

    def _middle(self, pair: tuple[int, int]) -> Float64Array:
        return self._road.xy[list(pair)].mean(axis=0)

    def _in_box(self, point: Float64Array, box: tuple[int, int, int, int]) -> bool:
        grid = self._floor.grid
        i, j = point / grid.voxel_size - grid.origin
        return box[0] <= i <= box[1] and box[2] <= j <= box[3]

"""Connecting viewpoints: straight where that is free, by OMPL where it is not."""

import math
from collections.abc import Collection
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ippon.geometry import Float64Array, yaw_of
from ippon.planning.along_path import rejoined_path, remaining_path
from ippon.planning.clearance import move_between
from ippon.planning.deadline import UNLIMITED, Deadline
from ippon.planning.local_planner import SAME_PLACE_M, LocalPlannerConfig, LocalQuery
from ippon.planning.roadmap import Roadmap, path_time, turning_time
from ippon.planning.shortest_tree import Seeds, ShortestTree
from ippon.planning.traversability import Traversability
from ippon.robot import RobotProfile

RADIUS_M = 2.5
"""Neighbours farther away than this are not connected directly."""
NEIGHBOURS = 10
COMFORT_M = 0.05
"""Room beside the body, above the margin, that viewpoints and straight edges leave: a voxel is up
to half its edge off the surface. Tighter places are for OMPL, which keeps to their middle."""
HERE_M = 0.15
"""A node this close is where the robot stands: no turning to get there, `PathFollower` neither."""
REJOIN_M = 0.15
"""A robot that is beside its path and cannot cut across comes back to it so far ahead."""
SHORTCUT_M = 10.0
"""Corners are cut over at most this length of a path: across a hospital's floor the work would grow
with its square."""
RETRY_STEPS = 10
"""Changes of the floor after which what could not be joined may be tried again."""


class Connector:
    """Adds edges to the roadmap and finds the ways from the robot into it."""

    def __init__(
        self,
        config: LocalPlannerConfig,
        road: Roadmap,
        floor: Traversability,
        robot: RobotProfile,
        seed: int,
    ) -> None:
        self._config = config
        self._road = road
        self._floor = floor
        self._turn_rate = robot.max_yaw_rate_rad_s
        self._can_back = robot.can_reverse and len(floor.limits.discs) > 0
        self._seed = seed
        self._queries = 0
        self._step = 0
        self._next = 0
        self._failed: dict[tuple[int, int], int] = {}
        self._shut_in: tuple[int, tuple[float, float], tuple[int, ...], int] | None = None
        """Step, place and nodes at which no way led from the robot into the roadmap; to how many of
        those nodes one was looked for."""
        self._unfinished: LocalQuery | None = None
        """What no time was left for: it goes on with the next step."""

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
        self._step += 1
        grid = self._floor.grid
        gone, _ = self._road.recheck(grid, self._floor.limits, box, self._margin)
        self._failed = {
            pair: step
            for pair, step in self._failed.items()
            if self._step - step < RETRY_STEPS or not self._in_box(self._middle(pair), box)
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

    def seeds(
        self,
        x: float,
        y: float,
        yaw: float,
        target: int | None,
        path: Float64Array | None,
        deadline: Deadline = UNLIMITED,
    ) -> Seeds:
        """Find the moves from the robot into the roadmap.

        Args:
            x: Robot, metres.
            y: Robot, metres.
            yaw: Its heading, radians.
            target: Node that the robot is on its way to, None for none.
            path: (K, 2) points of that way.
            deadline: Ends the looking for ways where no straight move is free.
        """
        found: list[tuple[int, float, Float64Array]] = []
        if target is not None and path is not None:
            rest = remaining_path(path, x, y)
            time = self._drive_time(rest, self._margin, yaw)
            if time is None:
                # Driving is not exact: of the room that the way was planned with, some is for that.
                rest = rejoined_path(path, x, y, REJOIN_M)
                time = self._drive_time(rest, min(self._margin, 0.0), yaw)
            if time is not None:
                found.append((target, time, rest))
        nodes = self._road.near(x, y, RADIUS_M, 2 * NEIGHBOURS)
        for node in nodes:
            move = self._straight_from_robot(x, y, yaw, int(node))
            if move is not None:
                found.append(move)
        if not found:
            found = self._plan_from_robot(x, y, yaw, nodes[:3], deadline)
        return Seeds(
            node=np.array([f[0] for f in found], dtype=np.int64),
            time=np.array([f[1] for f in found], dtype=np.float64),
            depart=np.array([_direction(f[2], 0, yaw) for f in found], dtype=np.float64),
            arrive=np.array([_direction(f[2], -2, yaw) for f in found], dtype=np.float64),
            paths=tuple(f[2] for f in found),
        )

    def bridge(
        self,
        tree: ShortestTree,
        reachable: NDArray[np.uint8],
        solves: int = 1,
        deadline: Deadline = UNLIMITED,
    ) -> bool:
        """Join nodes to the tree that the floor reaches but no straight edge does.

        What the deadline ends goes on with the next call.

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
            elif self._unfinished is None:
                self._failed[a, b] = self._step
            solves -= 1
        return added

    def way_to(
        self, goal: Float64Array, T_world_base: Float64Array, seeds: Seeds, tree: ShortestTree
    ) -> Float64Array | None:
        """Find the way from the robot to a point that is no node.

        Args:
            goal: (2,) where the robot can stand, metres.
            T_world_base: Where it stands.
            seeds: Moves from the robot into the roadmap.
            tree: Cheapest ways to the nodes.

        Returns:
            (K, 2) points from the robot to the goal, None when no way was found.
        """
        grid, limits, start = self._floor.grid, self._floor.limits, T_world_base[:2, 3]
        straight = np.stack([start, goal])
        if self._drive_time(straight, self._margin, yaw_of(T_world_base)) is not None:
            return straight
        nodes = self._road.near(float(goal[0]), float(goal[1]), RADIUS_M, 2 * NEIGHBOURS)
        nodes = [int(n) for n in nodes if np.isfinite(tree.cost[n])]
        best, path = math.inf, None
        for node in nodes:
            free, time, _ = move_between(grid, limits, self._road.xy[node], goal, self._margin)
            if free and tree.cost[node] + time < best:
                best, path = tree.cost[node] + time, self._road.path_to(node, tree, seeds)
        if path is not None:
            return self.shorten(np.vstack([path, goal]), yaw_of(T_world_base))
        for node in nodes[:3] if self._config.enabled else ():
            way = self._solve(self._road.xy[node], goal)
            if way is not None:
                path = np.vstack([self._road.path_to(node, tree, seeds), way[1:]])
                return self.shorten(path, yaw_of(T_world_base))
        return None

    def shorten(
        self, path: Float64Array, yaw: float, deadline: Deadline = UNLIMITED
    ) -> Float64Array:
        """Cut corners of a (K, 2) path wherever that takes less time, from its beginning on.

        Args:
            path: From the robot on, metres.
            yaw: The robot's heading, radians.
            deadline: When it passes, the rest stays as it is.
        """
        grid, limits = self._floor.grid, self._floor.limits
        out, at = [path[0]], 0
        while at < len(path) - 1:
            if 0 < at < len(path) - 2 and deadline.passed():
                return np.vstack([*out, path[at + 1 :]])
            best = at + 1
            spent = length = 0.0
            leave = self._floor.room_facing(path[0, 0], path[0, 1], yaw) if at == 0 else math.inf
            for to in range(at + 1, len(path)):
                free, time, _ = move_between(
                    grid, limits, path[to - 1], path[to], self._margin, leave
                )
                spent += time if free else math.inf
                length += math.dist(path[to - 1], path[to])
                if to == at + 1:
                    continue
                if length > SHORTCUT_M:
                    break
                free, time, _ = move_between(
                    grid, limits, path[at], path[to], self._margin + COMFORT_M, leave
                )
                if free and time <= spent and self._can_face(path[at], yaw, path[to], leave):
                    best = to
            out.append(path[best])
            yaw = math.atan2(path[best][1] - path[at][1], path[best][0] - path[at][0])
            at = best
        return np.array(out)

    def _join(self, a: int, b: int, deadline: Deadline) -> bool:
        """Join two nodes by OMPL, or straight through a tight place; tell whether it worked."""
        grid, limits, xy = self._floor.grid, self._floor.limits, self._road.xy
        path = self._solve(xy[a], xy[b], deadline) if self._config.enabled else None
        if path is not None:
            time = path_time(grid, limits, path, self._margin)
            if time is not None:
                self._road.add_edge(a, b, time, path, turning_time(path, self._turn_rate))
                return True
        return self._unfinished is None and self.connect_pair(a, b)

    def _solve(
        self, start: Float64Array, goal: Float64Array, deadline: Deadline = UNLIMITED
    ) -> Float64Array | None:
        """Find a way; None where there is none, or where finding it has to go on: `_unfinished`."""
        grid, query = self._floor.grid, self._unfinished
        if query is None or not query.joins(start, goal):
            self._queries += 1
            seed = 1 + (self._seed * 7919 + self._queries) % 2_000_000_000
            query = LocalQuery(
                self._config, grid, self._floor.limits, start, goal, margin=self._margin, seed=seed
            )
        self._unfinished = None if query.solve(grid, deadline) else query
        path = query.path()
        if path is not None:
            path[0] = start
        return path

    def _straight_from_robot(
        self, x: float, y: float, yaw: float, node: int
    ) -> tuple[int, float, Float64Array] | None:
        path = np.array([(x, y), self._road.xy[node]])
        for margin in (self._margin + COMFORT_M, self._margin):
            time = self._drive_time(path, margin, yaw)
            if time is not None:
                return node, time, path
        return None

    def _plan_from_robot(
        self, x: float, y: float, yaw: float, nodes: NDArray[np.int64], deadline: Deadline
    ) -> list[tuple[int, float, Float64Array]]:
        near = tuple(nodes.tolist())
        tried = self._tried_here(x, y, near)
        if not self._config.enabled or 0 < tried == len(near):
            return []
        for node in near[tried:]:
            path = self._solve(np.array([x, y]), self._road.xy[node], deadline)
            time = None if path is None else self._drive_time(path, self._margin, yaw)
            if path is not None and time is not None:
                return [(node, time, path)]
            if self._unfinished is not None:
                break
            tried += 1
        self._shut_in = self._step, (x, y), near, tried
        return []

    def _tried_here(self, x: float, y: float, nodes: tuple[int, ...]) -> int:
        """Return to how many of the nodes no way was found from here a moment ago."""
        if self._shut_in is None:
            return 0
        step, place, near, tried = self._shut_in
        same = near == nodes and math.dist(place, (x, y)) <= SAME_PLACE_M
        return tried if same and self._step - step < RETRY_STEPS else 0

    def _drive_time(self, path: Float64Array, margin: float, yaw: float) -> float | None:
        """Time along a path that begins at the robot, turns at its inner points included.

        None where the body cannot drive it, or not turn from a heading to the next. A long body
        that has no room to turn where it stands may drive its first piece backwards.
        """
        floor, total = self._floor, 0.0
        leave = floor.room_facing(path[0, 0], path[0, 1], yaw)
        for n, (a, b) in enumerate(pairwise(path)):
            free, time, _ = move_between(floor.grid, floor.limits, a, b, margin, leave)
            backs = n == 0 and self._can_back
            if not free or not (
                self._can_face(a, yaw, b, leave, margin)
                or (backs and self._can_face(a, yaw + math.pi, b, leave, margin))
            ):
                return None
            total += time
            leave, yaw = math.inf, math.atan2(b[1] - a[1], b[0] - a[0])
        return total + turning_time(path, self._turn_rate)

    def _can_face(
        self,
        here: Float64Array,
        yaw: float,
        there: Float64Array,
        leave: float,
        margin: float | None = None,
    ) -> bool:
        """Tell whether the body can turn towards a point; what is a hand's breadth away needs none.

        Args:
            here: (2,) where it stands, metres.
            yaw: Its heading.
            there: (2,) metres.
            leave: See `straight_move`.
            margin: Room to leave beside the body; as much as every move leaves, if not given.
        """
        step = there - here
        if not len(self._floor.limits.discs) or math.hypot(step[0], step[1]) <= HERE_M:
            return True
        margin = self._margin if margin is None else margin
        return self._floor.can_turn(here, yaw, math.atan2(step[1], step[0]), margin, leave)

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
                pair: step for pair, step in self._failed.items() if numbers.isdisjoint(pair)
            }

    def _middle(self, pair: tuple[int, int]) -> Float64Array:
        return self._road.xy[list(pair)].mean(axis=0)

    def _in_box(self, point: Float64Array, box: tuple[int, int, int, int]) -> bool:
        grid = self._floor.grid
        i, j = point / grid.voxel_size - grid.origin
        return box[0] <= i <= box[1] and box[2] <= j <= box[3]


def _direction(path: Float64Array, at: int, yaw: float) -> float:
    """Heading at the beginning (0) or end (-2) of a path; `yaw` for a robot that is there."""
    if np.linalg.norm(np.diff(path, axis=0), axis=1).sum() < HERE_M:
        return yaw
    step = path[at + 1] - path[at] if at >= 0 else path[-1] - path[-2]
    return math.atan2(step[1], step[0])

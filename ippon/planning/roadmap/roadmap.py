"""The roadmap: a graph of verified moves between viewpoints.

RRT* keeps one parent per node and rewires where a new node shortens a path. Here every verified
edge is kept (the rapidly exploring random graph of Karaman and Frazzoli), and the tree is the
shortest-path tree over the graph from the robot. That equals complete rewiring after each motion of
the root and each change of the map, and no edge is lost when the root moves.
"""

import math
from collections.abc import Collection
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ippon.compiling import njit
from ippon.geometry import Float64Array
from ippon.planning.roadmap.shortest_tree import RootEdges, ShortestTree, solve_tree
from ippon.planning.terrain.body_limits import BodyLimits
from ippon.planning.terrain.floor_grid import FloorGrid
from ippon.planning.terrain.motion_check import can_stand, move_between, straight_move


class Roadmap:
    """Nodes at cell centres and undirected edges with travel times.

    Args:
        capacity: Number of nodes at most.
        reserve: Nodes kept free for viewpoints near an object and at the robot, at most an eighth
            of all.
    """

    def __init__(self, capacity: int, reserve: int = 0) -> None:
        self.capacity = capacity
        self._reserve = min(reserve, capacity // 8)
        self.count = 0
        self.xy = np.zeros((capacity, 2), dtype=np.float64)
        self.alive = np.zeros(capacity, dtype=np.bool_)
        self._free: list[int] = []
        size = 16 * capacity
        self._ends = np.zeros((size, 2), dtype=np.int64)
        self._time = np.zeros(size, dtype=np.float64)
        self._turning = np.zeros(size, dtype=np.float64)
        self._headings = np.zeros((size, 2), dtype=np.float64)
        self._curves: dict[int, Float64Array] = {}
        self._edges = 0
        self._index: dict[tuple[int, int], int] = {}

    @property
    def nodes(self) -> NDArray[np.int64]:
        """Indices of the existing nodes."""
        return np.flatnonzero(self.alive[: self.count])

    def add_node(self, x: float, y: float) -> int | None:
        """Add a node and return it; None if the roadmap is full."""
        if self._free:
            node = self._free.pop()
        elif self.count < self.capacity:
            node = self.count
            self.count += 1
        else:
            return None
        self.xy[node] = x, y
        self.alive[node] = True
        return node

    def remove_node(self, node: int) -> None:
        """Remove a node and its edges; a new node may take its number."""
        ends = self._ends[: self._edges]
        for edge in np.flatnonzero((ends == node).any(axis=1))[::-1]:
            self._remove_edge(int(edge))
        self.alive[node] = False
        self._free.append(node)

    @property
    def room(self) -> int:
        """Nodes that can still be added to cover the floor, without the reserve for objects."""
        left = len(self._free) + self.capacity - self.count
        return max(0, left - self._reserve)

    def neighbours(self, nodes: Collection[int]) -> set[int]:
        """Return the nodes that share an edge with any of `nodes`, without `nodes` themselves."""
        ends = self._ends[: self._edges]
        touching = np.isin(ends, list(nodes)).any(axis=1)
        return set(ends[touching].ravel().tolist()).difference(nodes)

    def has_edge(self, a: int, b: int) -> bool:
        """Return whether an edge joins two nodes."""
        return (min(a, b), max(a, b)) in self._index

    def add_edge(
        self,
        a: int,
        b: int,
        time: float,
        curve: Float64Array | None = None,
        turning: float = 0.0,
    ) -> None:
        """Add a verified move.

        Args:
            a: Node.
            b: Other node.
            time: Seconds to drive it.
            curve: (K, 2) points from a to b; None if it is straight.
            turning: Seconds to turn at the curve's inner points.
        """
        key = (min(a, b), max(a, b))
        if key in self._index or self._edges == len(self._time):
            return
        edge = self._edges
        self._edges += 1
        points = np.stack([self.xy[a], self.xy[b]]) if curve is None else curve
        if curve is not None:
            self._curves[edge] = curve
        self._ends[edge] = a, b
        self._time[edge] = time + turning
        self._turning[edge] = turning
        self._headings[edge] = _heading(points[0], points[1]), _heading(points[-2], points[-1])
        self._index[key] = edge

    def edge_path(self, edge: int, start: int) -> Float64Array:
        """Return the (K, 2) points of an edge, beginning at node `start`."""
        a, b = self._ends[edge]
        points = self._curves.get(edge)
        if points is None:
            points = np.stack([self.xy[a], self.xy[b]])
        return points if start == a else points[::-1]

    def near(self, x: float, y: float, radius: float, most: int) -> NDArray[np.int64]:
        """List up to `most` nodes within `radius` metres, nearest first."""
        nodes = self.nodes
        distance = np.hypot(self.xy[nodes, 0] - x, self.xy[nodes, 1] - y)
        order = np.argsort(distance, kind="stable")[:most]
        return nodes[order[distance[order] <= radius]]

    def connect(
        self,
        node: int,
        grid: FloorGrid,
        limits: BodyLimits,
        *,
        radius: float,
        most: int,
        margin: float,
    ) -> None:
        """Add every free straight edge from a node to its neighbours."""
        x, y = self.xy[node]
        for other in self.near(x, y, radius, most + 1):
            if other == node or self.has_edge(node, int(other)):
                continue
            free, time, _ = move_between(grid, limits, self.xy[node], self.xy[other], margin)
            if free:
                self.add_edge(node, int(other), time)

    def recheck(
        self, grid: FloorGrid, limits: BodyLimits, box: tuple[int, int, int, int], margin: float
    ) -> tuple[list[int], int]:
        """Remove nodes and edges that a change of the floor has blocked.

        Args:
            grid: The floor.
            limits: The body.
            box: Cells (i0, i1, j0, j1) that changed.
            margin: Free space to leave beside the body, metres.

        Returns:
            The removed nodes, and the number of removed edges.
        """
        v = grid.voxel_size
        low: Float64Array = (np.array([box[0], box[2]], dtype=np.float64) + grid.origin) * v
        high: Float64Array = (np.array([box[1], box[3]], dtype=np.float64) + grid.origin) * v
        nodes = self.nodes
        inside = ((self.xy[nodes] >= low) & (self.xy[nodes] <= high)).all(axis=1)
        gone = [int(n) for n in nodes[inside] if not can_stand(grid, limits, self.xy[n], margin)]
        for node in gone:
            self.remove_node(node)
        dropped = self._recheck_edges(grid, limits, low, high, margin)
        return gone, dropped

    def _recheck_edges(
        self,
        grid: FloorGrid,
        limits: BodyLimits,
        low: Float64Array,
        high: Float64Array,
        margin: float,
    ) -> int:
        n = self._edges
        straight = np.ones(n, dtype=np.bool_)
        curved = list(self._curves)
        straight[curved] = False
        free = np.ones(n, dtype=np.bool_)
        _recheck_kernel(
            grid, limits, self.xy, self._ends[:n], straight, low, high, margin, self._time, free
        )
        for edge in curved:
            points = self._curves[edge]
            if (points.min(axis=0) > high).any() or (points.max(axis=0) < low).any():
                continue
            time = path_time(grid, limits, points, margin)
            free[edge] = time is not None
            if time is not None:
                self._time[edge] = time + self._turning[edge]
        dropped = np.flatnonzero(~free)[::-1]
        for edge in dropped:
            self._remove_edge(int(edge))
        return len(dropped)

    def shortest_tree(self, root_edges: RootEdges, yaw: float, turn_rate: float) -> ShortestTree:
        """Find the best path to every node, turning included; see `solve_tree`.

        Args:
            root_edges: Edges from the robot.
            yaw: The robot's heading, radians.
            turn_rate: How fast it turns, radians per second.
        """
        m = self._edges
        return solve_tree(
            self.count,
            self._ends[:m],
            self._time[:m],
            self._headings[:m],
            root_edges,
            yaw,
            turn_rate,
        )

    def path_to(self, node: int, tree: ShortestTree, root_edges: RootEdges) -> Float64Array:
        """Return the (K, 2) points from the robot to a node that the tree reaches."""
        pieces: list[Float64Array] = []
        while True:
            via = int(tree.via[node])
            if via < 0:
                pieces.append(root_edges.paths[-1 - via])
                break
            parent = int(tree.parent[node])
            pieces.append(self.edge_path(via, parent)[1:])
            node = parent
        return np.concatenate(pieces[::-1])

    def _remove_edge(self, edge: int) -> None:
        """Remove an edge; the last edge takes its number."""
        a, b = self._ends[edge]
        del self._index[(min(int(a), int(b)), max(int(a), int(b)))]
        self._curves.pop(edge, None)
        last = self._edges - 1
        if edge != last:
            a, b = self._ends[last]
            self._ends[edge] = a, b
            self._time[edge] = self._time[last]
            self._turning[edge] = self._turning[last]
            self._headings[edge] = self._headings[last]
            self._index[(min(int(a), int(b)), max(int(a), int(b)))] = edge
            if last in self._curves:
                self._curves[edge] = self._curves.pop(last)
        self._edges = last


def _heading(a: Float64Array, b: Float64Array) -> float:
    return math.atan2(b[1] - a[1], b[0] - a[0])


def path_time(
    grid: FloorGrid, limits: BodyLimits, points: Float64Array, margin: float
) -> float | None:
    """Return the driving time of a (K, 2) polyline without turns; None if it is blocked."""
    total = 0.0
    for a, b in pairwise(points):
        free, time, _ = move_between(grid, limits, a, b, margin)
        if not free:
            return None
        total += time
    return total


def turning_time(points: Float64Array, turn_rate: float) -> float:
    """Return the seconds that the turns at the inner points of a (K, 2) polyline take."""
    if len(points) < 3:
        return 0.0
    step = np.diff(points, axis=0)
    heading = np.arctan2(step[:, 1], step[:, 0])
    turn = np.abs((np.diff(heading) + math.pi) % (2.0 * math.pi) - math.pi)
    return float(turn.sum()) / turn_rate


@njit(cache=True, nogil=True)
def _recheck_kernel(grid, limits, xy, ends, straight, low, high, margin, time, free):
    for e in range(ends.shape[0]):
        if not straight[e]:
            continue
        ax, ay = xy[ends[e, 0], 0], xy[ends[e, 0], 1]
        bx, by = xy[ends[e, 1], 0], xy[ends[e, 1], 1]
        if max(ax, bx) < low[0] or min(ax, bx) > high[0]:
            continue
        if max(ay, by) < low[1] or min(ay, by) > high[1]:
            continue
        ok, seconds, _ = straight_move(grid, limits, ax, ay, bx, by, margin, math.inf)
        free[e] = ok
        if ok:
            time[e] = seconds

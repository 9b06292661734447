"""The shortest-path tree from the robot over a roadmap, turning included."""

import heapq
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ippon.compiling import njit
from ippon.geometry import Float64Array


class RootEdges(NamedTuple):
    """Edges from the robot, the root of the tree, to nodes near it."""

    node: NDArray[np.int64]
    time: NDArray[np.float64]
    """Seconds to drive them."""
    depart: NDArray[np.float64]
    """Heading at the start of each, radians."""
    arrive: NDArray[np.float64]
    """Heading at the end of each, radians."""
    paths: tuple[Float64Array, ...]
    """(K, 2) points of each, the robot first, the node last, metres."""


class ShortestTree(NamedTuple):
    """The best path from the robot to every node."""

    cost: NDArray[np.float64]
    """(N,) seconds, infinite where no path is known."""
    parent: NDArray[np.int64]
    """(N,) previous node; -1 if the robot reaches the node directly or not at all."""
    via: NDArray[np.int64]
    """(N,) edge that leads here, or `-1 - s` for root edge s."""
    heading: NDArray[np.float64]
    """(N,) heading on arrival, radians."""
    order: NDArray[np.int64]
    """Reached nodes, cheapest first."""


def solve_tree(
    nodes: int,
    ends: NDArray[np.int64],
    times: Float64Array,
    headings: Float64Array,
    root_edges: RootEdges,
    yaw: float,
    turn_rate: float,
) -> ShortestTree:
    """Find the shortest-path tree over undirected edges by Dijkstra's algorithm.

    A node keeps the heading of its cheapest arrival: a slower arrival that would save a later turn
    is not considered. RRT*, with one parent per node, makes the same approximation.

    Args:
        nodes: Number of nodes.
        ends: (M, 2) nodes of each edge.
        times: (M,) seconds to drive it.
        headings: (M, 2) heading on departure from the first node, and on arrival at the second.
        root_edges: Edges from the robot.
        yaw: The robot's heading, radians.
        turn_rate: How fast it turns, radians per second.
    """
    m = len(ends)
    # Both directions of each edge; the reverse direction has both headings turned by pi.
    source = np.concatenate([ends[:, 0], ends[:, 1]])
    target = np.concatenate([ends[:, 1], ends[:, 0]])
    depart = np.concatenate([headings[:, 0], headings[:, 1] + math.pi])
    arrive = np.concatenate([headings[:, 1], headings[:, 0] + math.pi])
    order = np.argsort(source, kind="stable")
    first = np.zeros(nodes + 1, dtype=np.int64)
    first[1:] = np.cumsum(np.bincount(source, minlength=nodes)[:nodes])
    tree = ShortestTree(
        cost=np.full(nodes, np.inf),
        parent=np.full(nodes, -1, dtype=np.int64),
        via=np.full(nodes, -1, dtype=np.int64),
        heading=np.zeros(nodes),
        order=np.empty(nodes, dtype=np.int64),
    )
    reached = _dijkstra_kernel(
        first,
        target[order],
        np.concatenate([times, times])[order],
        depart[order],
        arrive[order],
        order % m if m else order,
        root_edges.node,
        root_edges.time,
        root_edges.depart,
        root_edges.arrive,
        yaw,
        turn_rate,
        tree,
    )
    return tree._replace(order=tree.order[:reached])


@njit(cache=True, nogil=True)
def _turn(a, b, rate):
    return abs((b - a + math.pi) % (2.0 * math.pi) - math.pi) / rate


@njit(allocates=True, cache=True, nogil=True)
def _dijkstra_kernel(
    first, target, time, depart, arrive, edge, s_node, s_time, s_depart, s_arrive, yaw, rate, tree
):
    done = np.zeros(tree.cost.shape[0], dtype=np.bool_)
    queue = [(0.0, -1)]
    queue.pop()
    for s in range(s_node.shape[0]):
        node = s_node[s]
        cost = s_time[s] + _turn(yaw, s_depart[s], rate)
        if cost < tree.cost[node]:
            tree.cost[node] = cost
            tree.parent[node] = -1
            tree.via[node] = -1 - s
            tree.heading[node] = s_arrive[s]
            heapq.heappush(queue, (cost, node))
    reached = 0
    while len(queue) > 0:
        cost, node = heapq.heappop(queue)
        if done[node]:
            continue
        done[node] = True
        tree.order[reached] = node
        reached += 1
        for n in range(first[node], first[node + 1]):
            other = target[n]
            if done[other]:
                continue
            through = cost + time[n] + _turn(tree.heading[node], depart[n], rate)
            if through < tree.cost[other]:
                tree.cost[other] = through
                tree.parent[other] = node
                tree.via[other] = edge[n]
                tree.heading[other] = arrive[n]
                heapq.heappush(queue, (through, other))
    return reached

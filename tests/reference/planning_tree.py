"""Cheapest ways over a roadmap by relaxing every edge until nothing changes."""

import math


def turn(a: float, b: float, rate: float) -> float:
    return abs(math.remainder(b - a, 2.0 * math.pi)) / rate


def cheapest(
    count: int,
    edges: list[tuple[int, int, float, float, float]],
    root_edges: list[tuple[int, float, float, float]],
    yaw: float,
    rate: float,
) -> list[float]:
    """Cost of each node where turning costs nothing on the way (rate infinite) or is constant.

    Args:
        count: Number of nodes.
        edges: (a, b, time, heading at a, heading at b) of undirected straight moves.
        root_edges: (node, time, departing heading, arriving heading) from the robot.
        yaw: The robot's heading.
        rate: Turn rate.
    """
    cost = [math.inf] * count
    heading = [0.0] * count
    for node, time, depart, arrive in root_edges:
        through = time + turn(yaw, depart, rate)
        if through < cost[node]:
            cost[node], heading[node] = through, arrive
    for _ in range(count):
        for a, b, time, at_a, at_b in edges:
            back_out, back_in = at_b + math.pi, at_a + math.pi
            for start, end, depart, arrive in ((a, b, at_a, at_b), (b, a, back_out, back_in)):
                through = cost[start] + time + turn(heading[start], depart, rate)
                if through < cost[end] - 1e-12:
                    cost[end], heading[end] = through, arrive
    return cost

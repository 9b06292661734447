"""Edges, rechecks and the cheapest tree over the roadmap."""

import math

import numpy as np
import pytest

from ippon.planning.roadmap.roadmap import Roadmap, path_time, turning_time
from ippon.planning.roadmap.shortest_tree import RootEdges
from ippon.planning.terrain.floor_grid import OBSTACLE, OPEN
from tests.ippon.planning.terrain.test_clearance import LIMITS, make_grid, random_kind
from tests.reference import planning_tree as reference


def seeds_from(x: float, y: float, roadmap: Roadmap, nodes: list[int]) -> RootEdges:
    paths = [np.array([[x, y], roadmap.xy[n]]) for n in nodes]
    headings = [math.atan2(*(p[1] - p[0])[::-1]) for p in paths]
    return RootEdges(
        node=np.array(nodes, dtype=np.int64),
        time=np.array([np.linalg.norm(p[1] - p[0]) / LIMITS.speed for p in paths]),
        depart=np.array(headings),
        arrive=np.array(headings),
        paths=tuple(paths),
    )


def grown(grid, seed: int, count: int = 40) -> Roadmap:
    roadmap = Roadmap(count + 5)
    rng = np.random.default_rng(seed)
    for x, y in 0.4 + rng.random((count, 2)) * (np.array(grid.kind.shape) * 0.1 - 0.8):
        node = roadmap.add_node(x, y)
        roadmap.connect(node, grid, LIMITS, radius=1.2, most=8, margin=0.0)
    return roadmap


@pytest.mark.parametrize("seed", range(4))
def test_the_tree_is_the_cheapest(seed):
    grid = make_grid(random_kind(seed, (60, 50), 0.004))
    roadmap = grown(grid, seed)
    start = roadmap.near(2.0, 2.0, 3.0, 3).tolist()
    root_edges = seeds_from(2.0, 2.0, roadmap, start)
    # Without turning the order of relaxing cannot matter: both ways must agree exactly.
    tree = roadmap.shortest_tree(root_edges, 0.3, math.inf)
    edges = []
    for a, b in sorted(roadmap._index):
        edge = roadmap._index[a, b]
        path = roadmap.edge_path(edge, a)
        heading = math.atan2(*(path[1] - path[0])[::-1])
        edges.append((a, b, roadmap._time[edge], heading, heading))
    given = list(zip(start, root_edges.time, root_edges.depart, root_edges.arrive, strict=True))
    expected = reference.cheapest(roadmap.count, edges, given, 0.3, math.inf)
    np.testing.assert_allclose(tree.cost, expected)
    assert np.isfinite(tree.cost).sum() > 20
    # With turning the tree is a tree, and every cost is its parent's plus the edge's.
    tree = roadmap.shortest_tree(root_edges, 0.3, 1.2)
    for node in tree.order[len(start) :]:
        parent, via = int(tree.parent[node]), int(tree.via[node])
        if parent < 0:
            continue
        path = roadmap.edge_path(via, parent)
        heading = math.atan2(*(path[1] - path[0])[::-1])
        turn = reference.turn(tree.heading[parent], heading, 1.2)
        assert tree.cost[node] == pytest.approx(tree.cost[parent] + roadmap._time[via] + turn)
    assert (np.diff(tree.cost[tree.order]) >= -1e-12).all()


def test_turning_counts(dense_map):
    roadmap = Roadmap(4)
    ahead = roadmap.add_node(2.0, 1.0)
    behind = roadmap.add_node(0.0, 1.0)
    root_edges = seeds_from(1.0, 1.0, roadmap, [ahead, behind])
    tree = roadmap.shortest_tree(root_edges, 0.0, 1.2)
    assert tree.cost[ahead] == pytest.approx(1.0 / 0.8)
    assert tree.cost[behind] == pytest.approx(1.0 / 0.8 + math.pi / 1.2)


def test_a_path_leads_from_the_robot_to_the_node():
    grid = make_grid(np.full((60, 50), OPEN))
    roadmap = grown(grid, 1)
    root_edges = seeds_from(2.0, 2.0, roadmap, roadmap.near(2.0, 2.0, 1.5, 2).tolist())
    tree = roadmap.shortest_tree(root_edges, 0.0, 1.2)
    node = int(tree.order[-1])
    path = roadmap.path_to(node, tree, root_edges)
    np.testing.assert_allclose(path[0], [2.0, 2.0])
    np.testing.assert_allclose(path[-1], roadmap.xy[node])
    assert (np.linalg.norm(np.diff(path, axis=0), axis=1) > 0.0).all()


def test_a_change_of_the_floor_drops_what_it_blocks_and_nothing_else():
    grid = make_grid(np.full((60, 50), OPEN))
    roadmap = grown(grid, 2)
    edges = set(roadmap._index)
    grid.kind[30, :] = OBSTACLE
    grid = make_grid(grid.kind)
    gone, dropped = roadmap.recheck(grid, LIMITS, (15, 46, 0, 50), 0.0)
    wall = 3.05
    for node in gone:
        assert abs(roadmap.xy[node, 0] - wall) < LIMITS.radius
    assert dropped > 0
    for a, b in edges:
        crosses = (roadmap.xy[a, 0] - wall) * (roadmap.xy[b, 0] - wall) < 0.0
        near = min(abs(roadmap.xy[a, 0] - wall), abs(roadmap.xy[b, 0] - wall)) < LIMITS.radius
        assert roadmap.has_edge(a, b) == (not crosses and not near)


def test_curved_edges_are_followed_and_checked_along_their_curve():
    grid = make_grid(np.full((60, 50), OPEN))
    roadmap = Roadmap(4)
    a, b = roadmap.add_node(1.0, 1.0), roadmap.add_node(3.0, 1.0)
    curve = np.array([[1.0, 1.0], [2.0, 2.0], [3.0, 1.0]])
    turning = turning_time(curve, 1.2)
    assert turning == pytest.approx(math.pi / 2 / 1.2)
    roadmap.add_edge(a, b, path_time(grid, LIMITS, curve, 0.0), curve, turning)
    assert roadmap.has_edge(b, a)
    np.testing.assert_allclose(roadmap.edge_path(0, b), curve[::-1])
    tree = roadmap.shortest_tree(seeds_from(1.0, 0.5, roadmap, [a]), math.pi / 2, 1.2)
    assert tree.heading[b] == pytest.approx(-math.pi / 4)
    grid.kind[20, 20] = OBSTACLE
    _, dropped = roadmap.recheck(make_grid(grid.kind), LIMITS, (5, 36, 5, 36), 0.0)
    assert dropped == 1


def test_removed_nodes_make_room_for_new_ones():
    roadmap = Roadmap(3)
    nodes = [roadmap.add_node(float(n), 0.0) for n in range(3)]
    assert roadmap.add_node(9.0, 0.0) is None
    roadmap.add_edge(nodes[0], nodes[1], 1.0)
    roadmap.add_edge(nodes[1], nodes[2], 1.0)
    roadmap.remove_node(nodes[1])
    assert not roadmap.has_edge(nodes[0], nodes[1])
    assert not roadmap.neighbours([nodes[2]])
    assert roadmap.nodes.tolist() == [0, 2]
    assert roadmap.add_node(5.0, 0.0) == 1
    assert roadmap.near(5.0, 0.0, 0.5, 9).tolist() == [1]

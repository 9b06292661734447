"""Joining viewpoints and finding the way into the roadmap."""

import math

import numpy as np
import pytest

from ippon.geometry import base_pose
from ippon.mapping.arrays import FREE, OCCUPIED
from ippon.planning import connection as connection_module
from ippon.planning.along_path import rejoined_path, remaining_path
from ippon.planning.connection import SHORTCUT_M, Connector
from ippon.planning.deadline import Deadline
from ippon.planning.local_planner import LocalPlannerConfig, LocalQuery
from ippon.planning.roadmap import Roadmap
from ippon.planning.sampling import reachable_cells
from ippon.planning.traversability import Traversability, TraversabilityConfig
from ippon.robot import ZED
from tests.planning.test_deadline import Clock


def late() -> Deadline:
    """A deadline that has passed."""
    return Deadline(1.0, Clock(jump_s=10.0))


class Joined:
    """Floor, roadmap and connector over one map."""

    def __init__(self, volume, pose=None, **local):
        self.volume = volume
        self.pose = base_pose(1.3, 1.3, 0.0, 0.0) if pose is None else pose
        self.floor = Traversability(TraversabilityConfig(), ZED)
        self.floor.update(volume.arrays(), self.pose)
        self.road = Roadmap(30)
        config = LocalPlannerConfig(**local)
        self.connector = Connector(config, self.road, self.floor, ZED, 5)

    def add(self, x, y):
        node = self.road.add_node(x, y)
        self.connector.connect(node)
        return node

    def tree(self, yaw=0.0, target=None, path=None):
        x, y = self.pose[0, 3], self.pose[1, 3]
        seeds = self.connector.seeds(x, y, yaw, target, path)
        return seeds, self.road.shortest_tree(seeds, yaw, ZED.max_yaw_rate_rad_s)


@pytest.fixture
def corner(dense_map):
    """An L of corridors 1 m wide whose legs are 3.6 m long."""
    volume = dense_map((6.4, 6.4, 2.4))
    volume.fill((0.7, 0.7, -0.1), (5.3, 1.9, 2.0), OCCUPIED)
    volume.fill((4.1, 0.7, -0.1), (5.3, 5.3, 2.0), OCCUPIED)
    volume.fill((0.8, 0.8, 0.0), (5.2, 1.8, 2.0), FREE)
    return volume.fill((4.2, 0.8, 0.0), (5.2, 5.2, 2.0), FREE)


def bridged(joined, tries=5):
    seeds, tree = joined.tree()
    cells = reachable_cells(joined.floor.grid, joined.floor.limits, 1.3, 1.3, 0.02, 0.05)
    for _ in range(tries):
        if joined.connector.bridge(tree, cells):
            seeds, tree = joined.tree()
    return seeds, tree


def test_the_local_planner_joins_what_no_straight_line_does(corner):
    joined = Joined(corner)
    near, far = joined.add(3.45, 1.35), joined.add(4.75, 3.35)
    assert joined.road.edge_count == 0
    seeds, tree = bridged(joined)
    assert math.isfinite(tree.cost[far])
    path = joined.road.path_to(far, tree, seeds)
    np.testing.assert_allclose(path[0], [1.3, 1.3])
    np.testing.assert_allclose(path[-1], joined.road.xy[far])
    length = np.linalg.norm(np.diff(path, axis=0), axis=1).sum()
    assert tree.cost[far] > length / ZED.max_linear_m_s
    assert joined.road.has_edge(near, far)


def test_joining_that_ran_out_of_time_goes_on_and_is_no_failure(corner):
    joined = Joined(corner)
    joined.add(3.45, 1.35)
    far = joined.add(4.75, 3.35)
    cells = reachable_cells(joined.floor.grid, joined.floor.limits, 1.3, 1.3, 0.02, 0.05)
    _, tree = joined.tree()
    deadline = late()
    assert not joined.connector.bridge(tree, cells, deadline=deadline)
    assert deadline.cut_short
    assert not joined.connector._failed
    calls = 1
    while not joined.connector.bridge(tree, cells, deadline=late()):
        assert not joined.connector._failed
        calls += 1
        assert calls < 20
    assert joined.connector._queries == 1, "one query, looked at in pieces"
    assert math.isfinite(joined.tree()[1].cost[far])


def test_a_pair_that_no_way_joins_is_given_up_in_pieces_too(two_rooms):
    joined = Joined(two_rooms(0.0), base_pose(2.0, 2.85, 0.0, 0.0))
    joined.add(3.3, 2.85)
    joined.add(4.5, 2.85)
    cells = np.full(joined.floor.grid.kind.shape, 2, dtype=np.uint8)
    _, tree = joined.tree()
    for _ in range(20):
        assert not joined.connector.bridge(tree, cells, deadline=late())
    assert len(joined.connector._failed) == 1
    deadline = late()
    assert not joined.connector.bridge(tree, cells, deadline=deadline)
    assert not deadline.cut_short, "nothing is left to do"


def test_without_the_local_planner_the_corner_stays_out_of_reach(corner):
    joined = Joined(corner, enabled=False)
    joined.add(3.45, 1.35)
    far = joined.add(4.75, 3.35)
    _, tree = bridged(joined)
    assert math.isinf(tree.cost[far])


def test_a_pair_that_failed_is_not_solved_twice_while_nothing_changes(two_rooms, monkeypatch):
    joined = Joined(two_rooms(0.0), base_pose(2.0, 2.85, 0.0, 0.0))
    joined.add(3.3, 2.85)
    joined.add(4.5, 2.85)
    # As if the wall had not been noticed when the floor was flooded.
    cells = np.full(joined.floor.grid.kind.shape, 2, dtype=np.uint8)
    _, tree = joined.tree()
    solved = []
    solve = Connector._solve
    monkeypatch.setattr(Connector, "_solve", lambda *a: solved.append(1) or solve(*a))
    for _ in range(4):
        assert not joined.connector.bridge(tree, cells)
    assert len(solved) == 1


def test_a_node_with_the_number_of_a_removed_one_is_tried_anew(two_rooms):
    joined = Joined(two_rooms(0.0), base_pose(2.0, 2.85, 0.0, 0.0))
    joined.add(3.3, 2.85)
    lost = joined.add(4.5, 2.85)
    cells = np.full(joined.floor.grid.kind.shape, 2, dtype=np.uint8)
    assert not joined.connector.bridge(joined.tree()[1], cells)
    joined.connector.thin_out([lost])
    joined.connector.thin_out([joined.add(2.7, 1.3)])
    assert joined.add(2.7, 3.6) == lost, "its number is given anew"
    assert not joined.connector._failed


def test_thinning_out_joins_what_the_removed_ones_joined(dense_map):
    joined = Joined(dense_map().room((0.8, 0.8), (5.6, 5.6)), base_pose(1.6, 2.85, 0.0, 0.0))
    nodes = [joined.add(1.6 + 0.3 * k, 2.85) for k in range(12)]
    assert joined.road.neighbours([nodes[0]])
    joined.connector.thin_out(nodes[2:8] + nodes[10:])
    left = [nodes[k] for k in (0, 1, 8, 9)]
    assert joined.road.nodes.tolist() == left
    assert np.isfinite(joined.tree()[1].cost[left]).all()
    assert joined.road.has_edge(nodes[0], nodes[8])


def test_a_robot_that_is_shut_in_does_not_plan_the_same_again(two_rooms, monkeypatch):
    joined = Joined(two_rooms(0.0), base_pose(2.0, 2.85, 0.0, 0.0))
    joined.add(4.5, 2.85)
    solved = []
    monkeypatch.setattr(Connector, "_solve", lambda *_: solved.append(1))
    box = (0, 10_000, 0, 10_000)
    for step in range(30):
        assert len(joined.connector.seeds(3.4, 2.85, 0.0, None, None).node) == 0
        if step >= 10:
            joined.connector.follow(box)
    assert 1 <= len(solved) <= 3, "again only after the floor has changed"
    joined.connector.seeds(3.0, 2.85, 0.0, None, None)
    assert len(solved) <= 4
    before = len(solved)
    joined.connector.seeds(3.4, 2.85, 0.0, None, None)
    assert len(solved) == before + 1, "and from elsewhere"


def test_a_robot_that_is_shut_in_tries_each_way_out_in_pieces(two_rooms, monkeypatch):
    joined = Joined(two_rooms(0.0), base_pose(2.0, 2.85, 0.0, 0.0))
    for y in (2.45, 2.85, 3.25):
        joined.add(4.5, y)
    begun = []

    class Noted(LocalQuery):
        def __init__(self, config, grid, limits, start, goal, **rest):
            begun.append(goal[1])
            super().__init__(config, grid, limits, start, goal, **rest)

    monkeypatch.setattr(connection_module, "LocalQuery", Noted)
    cut_short = []
    for step in range(60):
        # A robot that stands is never at the very same place.
        deadline = late()
        x = 3.4 + 0.001 * (step % 2)
        assert len(joined.connector.seeds(x, 2.85, 0.0, None, None, deadline).node) == 0
        cut_short.append(deadline.cut_short)
    assert sorted(begun) == [2.45, 2.85, 3.25], "each once, to its end"
    assert cut_short[0]
    assert not cut_short[-1], "nothing is left to try"


def test_the_robot_enters_the_roadmap_along_its_path_or_straight(two_rooms):
    joined = Joined(two_rooms(1.0), base_pose(3.3, 2.85, 0.0, 0.0))
    node = joined.add(4.75, 2.85)
    path = np.array([(1.5, 2.85), (2.5, 2.85), (4.75, 2.85)])
    seeds, tree = joined.tree(target=node, path=path)
    assert seeds.node[0] == node
    np.testing.assert_allclose(seeds.paths[0], [(3.3, 2.85), (4.75, 2.85)])
    assert tree.cost[node] < 4.0


def test_where_the_robot_stands_needs_no_turning(dense_map):
    volume = dense_map().room((0.8, 0.8), (5.6, 5.6))
    joined = Joined(volume, base_pose(2.9, 2.85, 0.0, 1.0))
    node = joined.add(2.85, 2.85)
    _, tree = joined.tree(yaw=1.0)
    assert tree.cost[node] < 0.2
    assert tree.heading[node] == pytest.approx(1.0)


def test_shortening_keeps_ends_and_clearance_and_never_lengthens(corner):
    joined = Joined(corner)
    zigzag = np.array(
        [(1.3, 1.3), (1.6, 1.45), (2.2, 1.15), (3.0, 1.45), (4.65, 1.35), (4.75, 2.0), (4.7, 4.0)]
    )
    short = joined.connector.shorten(zigzag, 0.0)
    np.testing.assert_allclose(short[[0, -1]], zigzag[[0, -1]])
    assert len(short) < len(zigzag)

    def length(p):
        return np.linalg.norm(np.diff(p, axis=0), axis=1).sum()

    assert length(short) <= length(zigzag)
    assert joined.connector._drive_time(short, 0.02, 0.0) is not None


def test_a_way_that_there_is_no_time_to_shorten_stays_what_it_was(dense_map):
    joined = Joined(dense_map((28.0, 3.2, 2.4)).room((0.8, 0.8), (27.2, 2.4)))
    x = np.arange(1.5, 26.6, 0.5)
    way = np.column_stack([x, 1.6 + 0.1 * (np.arange(len(x)) % 2)])
    deadline = late()
    short = joined.connector.shorten(way, 0.0, deadline)
    assert deadline.cut_short
    assert 2 < len(short) < len(way), "its beginning is shortened: that is driven next"
    np.testing.assert_array_equal(short[0], way[0])
    np.testing.assert_array_equal(short[1:], way[-len(short) + 1 :])
    assert joined.connector._drive_time(short, 0.02, 0.0) is not None


def test_a_long_way_is_shortened_piece_by_piece(dense_map):
    joined = Joined(dense_map((28.0, 3.2, 2.4)).room((0.8, 0.8), (27.2, 2.4)))
    x = np.arange(1.5, 26.6, 0.5)
    short = joined.connector.shorten(np.column_stack([x, 1.6 + 0.1 * (np.arange(len(x)) % 2)]), 0.0)
    pieces = np.linalg.norm(np.diff(short, axis=0), axis=1)
    assert pieces.max() <= SHORTCUT_M
    assert len(pieces) == 3
    assert pieces.sum() == pytest.approx(25.0, abs=0.05)


def test_a_door_that_opens_joins_old_neighbours(two_rooms):
    volume = two_rooms(1.0)
    volume.fill((3.8, 2.2, 0.0), (3.9, 3.4, 2.0), OCCUPIED)
    joined = Joined(volume, base_pose(2.0, 2.85, 0.0, 0.0))
    a, b = joined.add(3.3, 2.85), joined.add(4.5, 2.85)
    assert not joined.road.has_edge(a, b)
    volume.fill((3.8, 2.2, 0.0), (3.9, 3.4, 2.0), FREE)
    box = joined.floor.update(volume.arrays(), joined.pose)
    assert box is not None
    assert joined.connector.follow(box) == []
    assert joined.road.has_edge(a, b)


def test_what_is_left_of_a_path_begins_at_the_robot():
    path = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0)])
    np.testing.assert_allclose(
        remaining_path(path, 0.4, -0.1), [(0.4, -0.1), (1.0, 0.0), (1.0, 1.0)]
    )
    np.testing.assert_allclose(remaining_path(path, 1.0, 0.5), [(1.0, 0.5), (1.0, 1.0)])


def test_who_comes_back_to_a_path_does_so_farther_on():
    path = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0)])
    np.testing.assert_allclose(
        rejoined_path(path, 0.4, -0.1, 0.2), [(0.4, -0.1), (0.6, 0.0), (1.0, 0.0), (1.0, 1.0)]
    )
    np.testing.assert_allclose(
        rejoined_path(path, 0.9, -0.1, 0.2), [(0.9, -0.1), (1.0, 0.1), (1.0, 1.0)]
    )
    np.testing.assert_allclose(rejoined_path(path, 1.1, 0.9, 0.2), [(1.1, 0.9), (1.0, 1.0)])


@pytest.mark.parametrize("beside", [-0.04, 0.04])
def test_a_robot_beside_its_path_in_a_tight_passage_goes_on(dense_map, beside):
    volume = dense_map((6.4, 3.2, 2.4)).room((0.8, 0.8), (5.6, 2.4))
    volume.fill((2.0, 0.8, 0.0), (4.4, 1.4, 2.0), OCCUPIED)
    volume.fill((2.0, 1.9, 0.0), (4.4, 2.4, 2.0), OCCUPIED)
    joined = Joined(volume, base_pose(2.6, 1.65 + beside, 0.0, 0.0), enabled=False)
    there = joined.add(5.0, 1.65)
    path = np.array([(1.4, 1.65), (5.0, 1.65)])
    seeds, tree = joined.tree(target=there, path=path)
    assert tree.cost[there] < 20.0
    np.testing.assert_allclose(
        joined.road.path_to(there, tree, seeds),
        [(2.6, 1.65 + beside), (2.75, 1.65), (5.0, 1.65)],
    )

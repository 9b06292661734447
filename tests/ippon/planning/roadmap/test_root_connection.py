"""The robot's own way into the roadmap."""

import dataclasses

import numpy as np
import pytest

from ippon.geometry import base_pose
from ippon.mapping.arrays import OCCUPIED
from ippon.planning.roadmap import local_planner as local_planner_module
from ippon.planning.roadmap.local_planner import LocalPlanner, LocalQuery
from ippon.planning.roadmap.robot_path import drive_time
from ippon.robot import ZED
from tests.ippon.planning.joined import Joined, late
from tests.long_robot import LONG


def test_a_robot_that_is_shut_in_does_not_plan_the_same_again(two_rooms, monkeypatch):
    joined = Joined(two_rooms(0.0), base_pose(2.0, 2.85, 0.0, 0.0))
    joined.add(4.5, 2.85)
    solved = []
    monkeypatch.setattr(LocalPlanner, "solve", lambda *_: solved.append(1))
    box = (0, 10_000, 0, 10_000)
    for step in range(30):
        assert len(joined.root.edges(3.4, 2.85, 0.0, None, None).node) == 0
        if step >= 10:
            joined.connector.update_floor(box)
    assert 1 <= len(solved) <= 3, "again only after the floor has changed"
    joined.root.edges(3.0, 2.85, 0.0, None, None)
    assert len(solved) <= 4
    before = len(solved)
    joined.root.edges(3.4, 2.85, 0.0, None, None)
    assert len(solved) == before + 1, "and from elsewhere"


def test_a_robot_that_is_shut_in_tries_again_with_less_margin(two_rooms, monkeypatch):
    joined = Joined(two_rooms(0.0), base_pose(2.0, 2.85, 0.0, 0.0))
    joined.add(4.5, 2.85)
    solved = []
    monkeypatch.setattr(LocalPlanner, "solve", lambda *_: solved.append(1))
    for _ in range(3):
        joined.root.edges(3.4, 2.85, 0.0, None, None)
    assert len(solved) == 1
    joined.floor.relax()
    for _ in range(3):
        joined.root.edges(3.4, 2.85, 0.0, None, None)
    assert len(solved) == 2


def test_a_robot_that_is_shut_in_tries_each_way_out_in_pieces(two_rooms, monkeypatch):
    joined = Joined(two_rooms(0.0), base_pose(2.0, 2.85, 0.0, 0.0))
    for y in (2.45, 2.85, 3.25):
        joined.add(4.5, y)
    begun = []

    class Noted(LocalQuery):
        def __init__(self, config, grid, limits, start, goal, **rest):
            begun.append(goal[1])
            super().__init__(config, grid, limits, start, goal, **rest)

    monkeypatch.setattr(local_planner_module, "LocalQuery", Noted)
    cut_short = []
    for step in range(60):
        # A robot that stands is never at the very same place.
        deadline = late()
        x = 3.4 + 0.001 * (step % 2)
        assert len(joined.root.edges(x, 2.85, 0.0, None, None, deadline).node) == 0
        cut_short.append(deadline.cut_short)
    assert sorted(begun) == [2.45, 2.85, 3.25], "each once, to its end"
    assert cut_short[0]
    assert not cut_short[-1], "nothing is left to try"


def test_the_robot_enters_the_roadmap_along_its_path_or_straight(two_rooms):
    joined = Joined(two_rooms(1.0), base_pose(3.3, 2.85, 0.0, 0.0))
    node = joined.add(4.75, 2.85)
    path = np.array([(1.5, 2.85), (2.5, 2.85), (4.75, 2.85)])
    root_edges, tree = joined.tree(target=node, path=path)
    assert root_edges.node[0] == node
    np.testing.assert_allclose(root_edges.paths[0], [(3.3, 2.85), (4.75, 2.85)])
    assert tree.cost[node] < 4.0


def test_where_the_robot_stands_needs_no_turning(dense_map):
    volume = dense_map().room((0.8, 0.8), (5.6, 5.6))
    joined = Joined(volume, base_pose(2.9, 2.85, 0.0, 1.0))
    node = joined.add(2.85, 2.85)
    _, tree = joined.tree(yaw=1.0)
    assert tree.cost[node] < 0.2
    assert tree.heading[node] == pytest.approx(1.0)


@pytest.mark.parametrize("beside", [-0.04, 0.04])
def test_a_robot_beside_its_path_in_a_tight_passage_goes_on(dense_map, beside):
    volume = dense_map((6.4, 3.2, 2.4)).room((0.8, 0.8), (5.6, 2.4))
    volume.fill((2.0, 0.8, 0.0), (4.4, 1.4, 2.0), OCCUPIED)
    volume.fill((2.0, 1.9, 0.0), (4.4, 2.4, 2.0), OCCUPIED)
    joined = Joined(volume, base_pose(2.6, 1.65 + beside, 0.0, 0.0), enabled=False)
    there = joined.add(5.0, 1.65)
    path = np.array([(1.4, 1.65), (5.0, 1.65)])
    root_edges, tree = joined.tree(target=there, path=path)
    assert tree.cost[there] < 20.0
    np.testing.assert_allclose(
        joined.roadmap.path_to(there, tree, root_edges),
        [(2.6, 1.65 + beside), (2.75, 1.65), (5.0, 1.65)],
    )


def test_a_point_is_reached_straight_over_the_roadmap_or_by_a_local_way(corner):
    joined = Joined(corner)
    root_edges, tree = joined.tree()
    near = joined.root.path_to_point(np.array([3.0, 1.35]), joined.pose, root_edges, tree)
    np.testing.assert_allclose(near, [(1.3, 1.3), (3.0, 1.35)])
    far = np.array([4.75, 2.9])
    assert joined.root.path_to_point(far, joined.pose, root_edges, tree) is None, (
        "there is no roadmap yet"
    )
    joined.add(3.0, 1.35)
    node = joined.add(4.7, 1.35)
    way = joined.root.path_to_point(far, joined.pose, *joined.tree())
    np.testing.assert_allclose(way, [(1.3, 1.3), joined.roadmap.xy[node], far])
    joined.connector.thin_out([node])
    assert joined.root.path_to_point(far, joined.pose, *joined.tree()) is None
    way = joined.root.detour_to_point(far, joined.pose, *joined.tree())
    np.testing.assert_allclose(way[[0, -1]], [(1.3, 1.3), far])
    assert joined.local_planner.begun == 1
    assert drive_time(way, joined.floor, ZED, 0.0, 0.0) is not None


def test_a_point_that_only_a_local_way_leads_to_is_out_of_reach_without_one(corner):
    joined = Joined(corner, enabled=False)
    joined.add(3.45, 1.35)
    assert joined.root.detour_to_point(np.array([4.75, 2.9]), joined.pose, *joined.tree()) is None


def test_a_long_robot_enters_the_roadmap_backwards_where_it_cannot_turn(dense_map):
    volume = dense_map((6.4, 3.2, 2.4)).room((0.8, 1.2), (5.6, 2.0))
    for robot, entries in ((LONG, 1), (dataclasses.replace(LONG, can_reverse=False), 0)):
        joined = Joined(volume, base_pose(4.0, 1.6, 0.0, 0.0), robot, enabled=False)
        joined.add(2.5, 1.6)
        root_edges, _ = joined.tree()
        assert len(root_edges.node) == entries
    joined.add(4.9, 1.6)
    assert len(joined.tree()[0].node) == 1, "that lies ahead"


def test_where_no_straight_move_is_free_a_local_way_leads_in(corner):
    joined = Joined(corner, base_pose(3.45, 1.35, 0.0, 0.0))
    node = joined.add(4.75, 3.0)
    root_edges, tree = joined.tree()
    assert root_edges.node.tolist() == [node]
    way = root_edges.paths[0]
    np.testing.assert_allclose(way[[0, -1]], [(3.45, 1.35), (4.75, 3.0)])
    assert len(way) > 2
    assert (
        tree.cost[node] > root_edges.time[0] > np.linalg.norm(way[0] - way[-1]) / ZED.max_linear_m_s
    )


def test_a_way_to_the_target_that_is_blocked_by_now_is_none(two_rooms):
    joined = Joined(two_rooms(0.0), base_pose(2.0, 2.85, 0.0, 0.0), enabled=False)
    near, target = joined.add(3.2, 2.85), joined.add(4.5, 2.85)
    root_edges, tree = joined.tree(target=target, path=np.array([(2.0, 2.85), (4.5, 2.85)]))
    assert root_edges.node.tolist() == [near]
    assert np.isinf(tree.cost[target])

"""Joining viewpoints."""

import math

import numpy as np

from ippon.geometry import base_pose
from ippon.mapping.arrays import FREE, OCCUPIED
from ippon.planning.roadmap.local_planner import LocalPlanner
from ippon.planning.terrain.reachability import reachable_cells
from ippon.robot import ZED
from tests.ippon.planning.joined import Joined, late


def bridged(joined, tries=5):
    root_edges, tree = joined.tree()
    cells = reachable_cells(joined.floor.grid, joined.floor.limits, 1.3, 1.3, 0.02, 0.05)
    for _ in range(tries):
        if joined.connector.bridge(tree, cells):
            root_edges, tree = joined.tree()
    return root_edges, tree


def test_the_local_planner_joins_what_no_straight_line_does(corner):
    joined = Joined(corner)
    near, far = joined.add(3.45, 1.35), joined.add(4.75, 3.35)
    assert not joined.roadmap.neighbours([near])
    root_edges, tree = bridged(joined)
    assert math.isfinite(tree.cost[far])
    path = joined.roadmap.path_to(far, tree, root_edges)
    np.testing.assert_allclose(path[0], [1.3, 1.3])
    np.testing.assert_allclose(path[-1], joined.roadmap.xy[far])
    length = np.linalg.norm(np.diff(path, axis=0), axis=1).sum()
    assert tree.cost[far] > length / ZED.max_linear_m_s
    assert joined.roadmap.has_edge(near, far)


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
    assert joined.local_planner.begun == 1, "one query, looked at in pieces"
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
    solve = LocalPlanner.solve
    monkeypatch.setattr(LocalPlanner, "solve", lambda *a: solved.append(1) or solve(*a))
    for _ in range(4):
        assert not joined.connector.bridge(tree, cells)
    assert len(solved) == 1


def test_a_pair_that_failed_is_tried_again_with_less_margin(two_rooms):
    """The last thing that a search does before it ends without a find."""
    joined = Joined(two_rooms(0.4), base_pose(2.0, 2.85, 0.0, 0.0))
    joined.add(3.3, 2.8)
    beyond = joined.add(4.5, 2.8)
    cells = np.full(joined.floor.grid.kind.shape, 2, dtype=np.uint8)
    assert not joined.connector.bridge(joined.tree()[1], cells)
    assert joined.floor.relax()
    assert joined.floor.update(joined.volume.arrays(), joined.pose) is None, "no cell has changed"
    assert joined.connector.bridge(joined.tree()[1], cells)
    assert math.isfinite(joined.tree()[1].cost[beyond])


def test_a_node_with_the_number_of_a_removed_one_is_tried_again(two_rooms):
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
    assert joined.roadmap.neighbours([nodes[0]])
    joined.connector.thin_out(nodes[2:8] + nodes[10:])
    left = [nodes[k] for k in (0, 1, 8, 9)]
    assert joined.roadmap.nodes.tolist() == left
    assert np.isfinite(joined.tree()[1].cost[left]).all()
    assert joined.roadmap.has_edge(nodes[0], nodes[8])


def test_a_door_that_opens_joins_old_neighbours(two_rooms):
    volume = two_rooms(1.0)
    volume.fill((3.8, 2.2, 0.0), (3.9, 3.4, 2.0), OCCUPIED)
    joined = Joined(volume, base_pose(2.0, 2.85, 0.0, 0.0))
    a, b = joined.add(3.3, 2.85), joined.add(4.5, 2.85)
    assert not joined.roadmap.has_edge(a, b)
    volume.fill((3.8, 2.2, 0.0), (3.9, 3.4, 2.0), FREE)
    box = joined.floor.update(volume.arrays(), joined.pose)
    assert box is not None
    assert joined.connector.update_floor(box) == []
    assert joined.roadmap.has_edge(a, b)

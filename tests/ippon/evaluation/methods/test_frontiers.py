import math
from itertools import pairwise

import numpy as np
import pytest

from ippon.evaluation.methods.frontiers import FloorRoutes, find_frontiers

_ROOM = [
    "####################",
    *["#..................#"] * 6,
    *["#........#.........#"] * 8,
    *["#..................#"] * 2,
    "####################",
]


def _length(path):
    return float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())


def test_a_path_over_free_floor_is_a_straight_line(floor_of):
    floor = floor_of(["." * 40] * 40)
    routes = FloorRoutes(floor, 1.0, 1.0)
    path = routes.path_to((30, 30))
    assert path[0].tolist() == [1.0, 1.0]
    assert path[-1] == pytest.approx([3.05, 3.05])
    assert _length(path) == pytest.approx(math.hypot(2.05, 2.05), rel=0.01)
    # At full speed, since nothing is near; the staircase of the grid is at most 8 % longer.
    assert 1.0 <= routes.time_s[30, 30] / (_length(path) / 0.5) < 1.09


def test_a_path_around_a_wall_leaves_clearance(floor_of):
    floor = floor_of(_ROOM)
    routes = FloorRoutes(floor, 1.1, 0.5)
    path = routes.path_to(routes.nearest_cell(1.1, 1.4, 0.2))
    assert _length(path) > 1.2
    for a, b in pairwise(path):
        for t in np.linspace(0.0, 1.0, 20):
            assert floor.clearance(*(a + t * (b - a))) >= 0.15 - 0.02


def test_the_time_to_unreachable_cells_is_infinite(floor_of):
    rows = ["." * 12] * 6 + ["#" * 12] + ["." * 12] * 6
    routes = FloorRoutes(floor_of(rows), 0.3, 0.6)
    assert np.isinf(routes.time_s[10, 6])
    assert routes.nearest_cell(1.05, 0.6, 0.2) is None
    assert routes.nearest_cell(0.35, 0.6, 0.2) is not None


def test_an_enclosed_robot_has_no_paths(floor_of):
    routes = FloorRoutes(floor_of(["#" * 10] * 10), 0.5, 0.5)
    assert not routes.reachable.any()
    assert routes.nearest_cell(0.5, 0.5, 5.0) is None
    assert find_frontiers(routes) == ()


def test_a_frontier_lies_where_the_floor_ends_unseen(floor_of):
    rows = ["#" * 14, *["#" + "." * 12 + "#"] * 12, *[" " * 14] * 6]
    (frontier,) = find_frontiers(FloorRoutes(floor_of(rows), 0.5, 0.7))
    assert frontier.position[0] == pytest.approx(1.25)
    assert frontier.yaw_rad == pytest.approx(0.0, abs=0.2)
    assert frontier.length_m == pytest.approx(1.2)
    assert frontier.time_s > 0.0


def test_a_fully_seen_room_has_no_frontier(floor_of):
    assert find_frontiers(FloorRoutes(floor_of(_ROOM), 0.4, 0.5)) == ()


def test_slits_are_no_frontiers(floor_of):
    rows = ["#" * 14, *["#" + "." * 12 + "#"] * 8, "####..########", *[" " * 14] * 4]
    routes = FloorRoutes(floor_of(rows), 0.5, 0.7)
    assert find_frontiers(routes) == ()
    assert len(find_frontiers(routes, min_length_m=0.1)) == 1

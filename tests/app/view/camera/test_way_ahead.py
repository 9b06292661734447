import math

import numpy as np
import pytest

from app.view.camera.way_ahead import (
    AHEAD_M,
    AHEAD_S,
    STANDING_M,
    commanded_way,
    edges_of,
    limit_ahead,
    planned_way,
)
from ippon.geometry import base_pose

POSE = base_pose(1.0, 2.0, 0.1, 0.5 * math.pi)


def test_a_command_straight_ahead_is_a_line():
    way = commanded_way(POSE, 0.4, 0.0)
    np.testing.assert_allclose(way[0], [1.0, 2.0, 0.1])
    np.testing.assert_allclose(way[-1], [1.0, 2.0 + 0.4 * AHEAD_S, 0.1], atol=1e-9)


def test_a_curve_ends_on_its_circle():
    speed, rate = 0.5, 0.8
    way = commanded_way(POSE, speed, rate)
    radius = speed / rate
    centre = np.array([1.0 - radius, 2.0])
    distance = np.linalg.norm(way[:, :2] - centre, axis=1)
    np.testing.assert_allclose(distance, radius, atol=1e-9)


def test_a_standing_robot_shows_straight_ahead():
    way = commanded_way(POSE, 0.0, 1.0)
    np.testing.assert_allclose(way[-1], [1.0, 2.0 + STANDING_M, 0.1], atol=1e-9)


def test_a_planned_way_begins_at_the_robot_and_ends_after_some_metres():
    path = np.array([[1.0, 2.0, 0.1], [1.0, 3.0, 0.1], [9.0, 3.0, 0.1]])
    way = planned_way(path, POSE)
    np.testing.assert_allclose(way[0], [1.0, 2.0, 0.1])
    np.testing.assert_allclose(way[-1], [1.0 + AHEAD_M - 1.0, 3.0, 0.1])
    steps = np.linalg.norm(np.diff(way, axis=0), axis=1)
    assert steps.max() < 0.11


@pytest.mark.parametrize("path", [np.empty((0, 3)), np.array([[1.0, 2.0, 0.1], [1.0, 2.0, 0.1]])])
def test_no_path_is_no_way(path):
    assert planned_way(path, POSE).shape == (0, 3)


def test_edges_are_as_far_apart_as_the_body_is_wide():
    left, right = edges_of(commanded_way(POSE, 0.4, 0.3), 0.25)
    np.testing.assert_allclose(np.linalg.norm(left - right, axis=1), 0.5, atol=1e-9)
    assert left[0, 0] < right[0, 0], "north is ahead, so left is west"


def test_a_limit_is_at_its_distance_ahead():
    limit = limit_ahead(POSE, 0.7)
    np.testing.assert_allclose(np.linalg.norm(limit - POSE[:3, 3], axis=1), 0.7)
    np.testing.assert_allclose(limit[8], [1.0, 2.7, 0.1])

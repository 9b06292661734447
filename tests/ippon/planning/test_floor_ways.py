"""Lengths of ways on maps whose every voxel is known."""

import numpy as np
import pytest

from ippon.geometry import base_pose
from ippon.mapping.arrays import OCCUPIED
from ippon.planning.floor_ways import FloorSurvey
from ippon.planning.terrain.traversability import TraversabilityConfig
from ippon.robot import ZED


def ways_on(volume, x=1.4, y=1.3):
    survey = FloorSurvey(TraversabilityConfig(), ZED)
    return survey.read(volume.arrays(), base_pose(x, y, 0.0, 0.0)).ways()


def test_the_way_goes_round_the_corner(l_shape):
    ways = ways_on(l_shape)
    way_m = ways.to_any(np.array([[4.75, 4.65]]))
    # Along the inner corner, from which the body keeps its radius: shorter than both legs, longer
    # than the straight line through the wall.
    straight, legs = np.hypot(3.35, 3.35), 3.35 + 3.35
    assert straight + 0.3 < way_m < legs
    assert ways.to_any(np.array([[2.4, 1.3]])) == pytest.approx(1.0, abs=0.1)


def test_of_several_points_the_nearest_counts(l_shape):
    ways = ways_on(l_shape)
    near, far = [2.4, 1.3], [4.75, 4.65]
    assert ways.to_any(np.array([far, near])) == ways.to_any(np.array([near]))
    assert ways.to_any(np.zeros((0, 2))) is None


def test_the_way_to_a_thing_on_a_table_ends_beside_it(l_shape):
    ways = ways_on(l_shape)
    in_the_wall = np.array([[2.4, 2.2]])
    assert ways.to_any(in_the_wall) is None
    way_m = ways.to_any(in_the_wall, within_m=1.2)
    assert way_m == pytest.approx(np.hypot(1.0, 0.9), abs=0.4)
    assert way_m >= np.hypot(1.0, 0.9) - 0.15


def test_no_way_leads_off_the_map_or_through_a_closed_door(l_shape):
    l_shape.fill((3.2, 0.7, 0.0), (3.3, 1.9, 2.0), OCCUPIED, ooi=0.0, level=1)
    ways = ways_on(l_shape)
    assert ways.to_any(np.array([[4.75, 4.65]])) is None
    assert ways.to_any(np.array([[2.4, 1.3]])) is not None
    assert ways.to_any(np.array([[400.0, -400.0]]), within_m=1.0) is None


def test_only_changes_are_read_again(l_shape):
    survey = FloorSurvey(TraversabilityConfig(), ZED)
    pose, goal = base_pose(1.4, 1.3, 0.0, 0.0), np.array([[4.75, 4.65]])
    before = survey.read(l_shape.arrays(), pose)
    assert before.ways().to_any(goal) is not None
    l_shape.fill((3.2, 0.7, 0.0), (3.3, 1.9, 2.0), OCCUPIED, ooi=0.0, level=1)
    after = survey.read(l_shape.arrays(), pose)
    assert after.ways().to_any(goal) is None
    assert before.ways().to_any(goal) is not None, "what was read is a copy"


def test_a_robot_on_an_empty_map_reaches_where_it_stands(dense_map):
    ways = ways_on(dense_map((6.4, 6.4, 2.4)), 3.0, 3.0)
    assert ways.to_any(np.array([[5.5, 5.5]])) is None

import math

import numpy as np
import pytest

from ippon.evaluation.geodesic import GeodesicField
from ippon.evaluation.methods.method_table import widened
from ippon.evaluation.methods.oracle import OraclePlanner
from ippon.evaluation.metrics import Judge
from ippon.geometry import base_pose
from ippon.planning.plan import NodeKind
from ippon.simulation.robot.navigation_grid import robot_grid


def _length(path):
    return float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())


def test_a_path_is_as_long_as_the_distance(make_scene, flat_boxes, robot):
    grid = robot_grid(make_scene(flat_boxes), robot)
    field = GeodesicField(grid, np.array([[7.0, 0.5]]))
    rng = np.random.default_rng(2)
    ways = 0
    for x, y in rng.uniform((0.3, 0.3), (7.7, 5.7), (60, 2)).tolist():
        path = field.path_from(x, y)
        if len(path):
            ways += 1
            assert path[0].tolist() == [x, y]
            assert _length(path) == pytest.approx(field.distance_from(x, y), abs=0.12)
    assert ways > 40


def test_there_is_no_path_from_inside_a_wall(make_scene, flat_boxes, robot):
    field = GeodesicField(robot_grid(make_scene(flat_boxes), robot), np.array([[7.0, 0.5]]))
    assert field.path_from(-5.0, 1.0).shape == (0, 2)


def _oracle(scene, robot, goal):
    judge = Judge(scene, robot, goal)
    return OraclePlanner(scene, judge, Judge(scene, widened(robot, 0.05), goal)), judge


def test_the_oracle_drives_the_shortest_path_and_faces_the_object(make_scene, flat_boxes, robot):
    scene = make_scene(flat_boxes)
    oracle, judge = _oracle(scene, robot, "hat")
    plan = oracle.step(None, base_pose(1.0, 1.0, 0.0, 0.0), 0.1)
    assert plan.target is not None
    assert plan.target.kind is NodeKind.TERMINATING
    assert judge.is_success(plan.target.position_world)
    d0 = judge.shortest_path_m(scene.start_poses[0])
    assert d0 - 0.1 <= _length(plan.path_world) <= d0 + 0.3
    x, y, _ = plan.target.position_world
    assert plan.target.yaw_rad == pytest.approx(math.atan2(1.55 - y, 6.55 - x))


def test_the_oracle_reports_a_missing_path(make_scene, flat_boxes, robot):
    oracle, _ = _oracle(make_scene(flat_boxes), robot, "unicorn")
    plan = oracle.step(None, base_pose(1.0, 1.0, 0.0, 0.0), 0.0)
    assert plan.exhausted
    assert plan.target is None

import dataclasses
import math

import numpy as np
import pytest

from ippon.evaluation.goal_objects import goal_viewpoints, matching_instances
from ippon.simulation.camera.line_of_sight import LineOfSight
from ippon.simulation.robot.navigation_grid import robot_grid


def _views(scene, robot, instance):
    return goal_viewpoints(scene, robot_grid(scene, robot), robot, instance, LineOfSight(scene))


def test_a_goal_means_label_or_category_however_it_is_written(make_scene, flat_boxes):
    scene = make_scene(
        [*flat_boxes, ("chest_of_drawers", "dresser", (0.1, 0.1, 0.0), (0.9, 0.5, 0.8))]
    )
    assert matching_instances(scene, "hat") == (7,)
    assert matching_instances(scene, "Chair") == (8,)
    assert matching_instances(scene, "armchair") == (8,)
    assert matching_instances(scene, "chest of drawers") == (9,)
    assert matching_instances(scene, "dresser") == (9,)
    assert matching_instances(scene, "unicorn") == ()
    # A baseball cap is a hat; a hat need not be a baseball cap.
    more = make_scene(
        [
            *flat_boxes,
            ("sofa", "couch", (0.1, 0.1, 0.0), (0.9, 0.5, 0.8)),
            ("clothes", "baseball cap", (2.0, 0.1, 0.0), (2.2, 0.3, 0.1)),
            ("tv_monitor", "television", (3.0, 0.1, 0.0), (3.4, 0.3, 0.4)),
        ]
    )
    assert matching_instances(more, "sofa") == matching_instances(more, "couch") == (9,)
    assert matching_instances(more, "hat") == (7, 10)
    assert matching_instances(more, "baseball cap") == (10,)
    assert matching_instances(more, "tv") == (11,)
    assert matching_instances(scene, "") == ()


def test_viewpoints_surround_an_object_within_a_metre_of_its_box(make_scene, flat_boxes, robot):
    scene = make_scene(flat_boxes)
    points = _views(scene, robot, 7)
    box = scene.instances[7]
    dx = np.maximum(np.maximum(box.aabb_min[0] - points[:, 0], points[:, 0] - box.aabb_max[0]), 0)
    dy = np.maximum(np.maximum(box.aabb_min[1] - points[:, 1], points[:, 1] - box.aabb_max[1]), 0)
    assert np.hypot(dx, dy).max() <= 1.0
    assert np.hypot(dx, dy).max() > 0.9
    # The table keeps the base 0.2 m off its edge, so no viewpoint is nearer.
    assert np.maximum(np.abs(points[:, 0] - 6.5), np.abs(points[:, 1] - 1.5)).min() > 0.65
    angles = np.arctan2(points[:, 1] - 1.55, points[:, 0] - 6.55)
    assert np.diff(np.sort(angles)).max() < math.radians(60.0)


def test_nothing_is_seen_through_a_wall(make_scene, flat_boxes, robot):
    boxes = [*flat_boxes, ("plant", "plant", (4.1, 1.0, 0.0), (4.4, 1.3, 0.8))]
    points = _views(make_scene(boxes), robot, 9)
    assert len(points) > 10
    assert points[:, 0].min() > 4.0


def test_an_enclosed_object_has_no_viewpoint(make_scene, flat_boxes, robot):
    shut = [*flat_boxes, ("objects", "box", (6.3, 1.3, 0.7), (6.8, 1.8, 1.0))]
    assert len(_views(make_scene(shut), robot, 7)) == 0


def test_camera_limits_decide_what_can_be_seen(make_scene, flat_boxes, robot):
    low = [*flat_boxes, ("objects", "keys", (2.0, 2.0, 0.0), (2.05, 2.05, 0.02))]
    scene = make_scene(low)
    assert len(_views(scene, robot, 9)) > 50
    level = dataclasses.replace(robot, min_tilt_rad=-0.05, max_tilt_rad=0.05)
    assert len(_views(scene, level, 9)) == 0
    high = [*flat_boxes, ("picture", "picture", (2.0, 0.0, 2.2), (2.4, 0.05, 2.4))]
    assert len(_views(make_scene(high), level, 9)) == 0


def test_a_floor_that_is_out_of_reach_gives_no_viewpoint(make_scene, flat_boxes, robot):
    far = [*flat_boxes, ("vase", "vase", (20.0, 20.0, 0.0), (20.1, 20.1, 0.3))]
    far[-1] = ("objects", "vase", (20.0, 20.0, 0.0), (20.1, 20.1, 0.3))
    assert len(_views(make_scene(far), robot, 9)) == 0


@pytest.mark.parametrize("instance", [6, 7, 8])
def test_the_same_home_gives_the_same_viewpoints(make_scene, flat_boxes, robot, instance):
    first = _views(make_scene(flat_boxes), robot, instance)
    np.testing.assert_array_equal(first, _views(make_scene(flat_boxes), robot, instance))

"""Orientation towards a point, and the robot in front of it."""

import math

import numpy as np
import pytest

from ippon.geometry import base_pose
from ippon.planning.selection.look_target import (
    LookConfig,
    is_same_cluster,
    look_at,
    stands_facing,
    yaw_tilt_to,
)

CONFIG = LookConfig()
HERE = np.array([1.0, 2.0])


@pytest.mark.parametrize("yaw", [0.0, 1.2, -2.5])
@pytest.mark.parametrize("tilt", [0.0, 0.4, -0.9])
def test_yaw_and_tilt_point_the_camera_at_the_point(yaw, tilt):
    ahead = 2.0 * np.array([math.cos(yaw), math.sin(yaw), math.tan(tilt)])
    point = np.array([*HERE, 1.1]) + ahead
    assert yaw_tilt_to(HERE, point, 1.1) == pytest.approx((yaw, tilt))
    look = look_at(3, HERE, point, 1.1, 2.0)
    assert (look.node, look.away_m) == (3, 2.0)
    assert (look.yaw_rad, look.tilt_rad) == pytest.approx((yaw, tilt))


def test_the_tilt_to_a_point_below_the_camera_is_bounded():
    assert yaw_tilt_to(HERE, np.array([*HERE, 0.1]), 1.1)[1] == pytest.approx(math.atan2(-1.0, 0.1))


def test_the_robot_faces_the_point_within_distance_and_heading():
    aside = CONFIG.reached_m
    assert stands_facing(CONFIG, base_pose(1.0, 2.0 + 0.9 * aside, 0.0, 3.1), HERE, -3.1)
    assert not stands_facing(CONFIG, base_pose(1.0, 2.0 + 1.1 * aside, 0.0, 3.1), HERE, -3.1)
    turned = base_pose(1.0, 2.0, 0.0, 1.1 * CONFIG.facing_rad)
    assert not stands_facing(CONFIG, turned, HERE, 0.0)


def test_centres_of_one_cluster_may_move_over_the_floor_and_in_height():
    x, y, z = one = np.array([1.0, 2.0, 0.3])
    assert is_same_cluster(CONFIG, one, np.array([x + 0.9 * CONFIG.same_cluster_m, y, z + 1.0]))
    assert not is_same_cluster(CONFIG, one, np.array([x, y + 1.1 * CONFIG.same_cluster_m, z]))
    assert not is_same_cluster(CONFIG, one, np.array([x, y, z + 2.6])), "on the floor above"


def test_counts_and_distances_without_meaning_are_refused():
    with pytest.raises(ValueError, match="max_viewpoints and sight_points must be at least 1"):
        LookConfig(sight_points=0)
    with pytest.raises(ValueError, match="reached_m and facing_rad must be above 0; got 0"):
        LookConfig(reached_m=0.0)

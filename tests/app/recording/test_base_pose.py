"""Where the base is, by the transforms of a robot with localisation."""

import numpy as np
import pytest

from app.messages.motion import StampedTransform
from app.recording.base_pose import BasePose

S = 1_000_000_000


def link(parent, child, x, stamp_ns):
    T = np.eye(4)
    T[0, 3] = x
    return StampedTransform(stamp_ns=stamp_ns, parent=parent, child=child, T_parent_child=T)


def test_the_pose_of_a_localised_robot_has_the_time_of_its_odometry():
    base = BasePose()
    base.take([link("base_footprint", "base_link", 0.5, 99 * S)], fixed=True)
    # Nav2's AMCL stamps its transform a second ahead.
    base.take([link("map", "odom", 1.0, 11 * S)], fixed=False)
    assert base.pose() is None
    assert base.stamp_ns() is None
    base.take([link("odom", "base_footprint", 0.25, 10 * S)], fixed=False)
    assert base.pose()[0, 3] == pytest.approx(1.75)
    assert base.stamp_ns() == 10 * S


def test_transforms_in_a_loop_or_without_time_give_no_time():
    base = BasePose()
    base.take([link("odom", "base_link", 0.0, S), link("base_link", "odom", 0.0, S)], fixed=False)
    assert base.pose() is None
    still = BasePose()
    still.take([link("map", "base_link", 2.0, S)], fixed=True)
    assert still.pose()[0, 3] == 2.0
    assert still.stamp_ns() is None

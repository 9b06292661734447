"""Directions for who carries the camera: one thing at a time, and no flicker."""

import math

import numpy as np
import pytest

from ippon.command import Command, NavigationGoal
from ippon.control.walking_guide import WalkingGuide, WalkingStep
from ippon.geometry import base_pose

AROUND_A_CORNER = np.array([[0, 0, 0], [2, 0.1, 0], [4, 0, 0], [4, 3, 0]], float)


class Person(WalkingGuide):
    def __init__(self):
        super().__init__(0.08)

    def at(self, x, y, yaw=0.0, *, to=(4.0, 3.0, 1.5), tilt=-0.3, path=AROUND_A_CORNER):
        goal = to and NavigationGoal(number=1, x_m=to[0], y_m=to[1], yaw_rad=to[2])
        command = Command(tilt_rad=-0.3, goal=goal)
        return self.step(command, path, base_pose(x, y, 0.0, yaw), tilt)


def test_the_way_leads_along_the_path_corner_by_corner():
    walk = Person().at(0.0, 0.0)
    assert walk.step is WalkingStep.WALK
    assert walk.walk_m == pytest.approx(4.0)
    assert walk.way_m == pytest.approx(7.0, abs=0.01)
    assert walk.turn_rad == pytest.approx(0.0)
    assert walk.look_up_rad == 0.0
    turn = Person().at(4.0, 0.1, path=AROUND_A_CORNER[2:])
    assert turn.step is WalkingStep.TURN
    assert turn.turn_rad == pytest.approx(0.5 * math.pi, abs=0.01)
    assert turn.walk_m == pytest.approx(2.9)


def test_turning_ends_within_12_degrees_and_begins_again_beyond_35():
    person = Person()
    steps = [person.at(0, 0, math.radians(a)).step.value for a in (60, 20, 10, 30, 20, 40, 20)]
    assert steps == ["turn", "turn", "walk", "walk", "walk", "turn", "turn"]


def test_at_the_goal_the_heading_comes_first_then_the_camera_then_nothing():
    person = Person()
    turn = person.at(3.9, 2.9, 0.0, tilt=-0.6, path=AROUND_A_CORNER[3:])
    assert (turn.step, turn.walk_m, turn.way_m) == (WalkingStep.TURN, 0.0, 0.0)
    assert turn.turn_rad == pytest.approx(1.5)
    look = person.at(3.9, 2.9, 1.5, tilt=-0.6, path=AROUND_A_CORNER[3:])
    assert look.step is WalkingStep.LOOK
    assert look.look_up_rad == pytest.approx(0.3)
    assert person.at(3.9, 2.9, 1.5, path=AROUND_A_CORNER[3:]).step is WalkingStep.HOLD
    # A step aside does not send the person back.
    assert person.at(3.6, 2.9, 1.5, path=AROUND_A_CORNER[3:]).step is WalkingStep.HOLD
    assert person.at(3.4, 2.9, 1.5, path=AROUND_A_CORNER[3:]).step is WalkingStep.TURN


def test_a_path_that_leads_elsewhere_is_ignored():
    walk = Person().at(0.0, 0.0, 0.0, to=(0.0, 2.0, 0.0))
    assert walk.turn_rad == pytest.approx(0.5 * math.pi)
    assert walk.walk_m == walk.way_m == pytest.approx(2.0)


def test_without_a_goal_only_the_camera_is_directed():
    assert Person().at(0.0, 0.0, to=None) is None
    assert Person().at(0.0, 0.0, to=None, tilt=0.1).step is WalkingStep.LOOK

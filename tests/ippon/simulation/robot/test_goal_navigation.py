"""The simulated navigation: around walls, to the goal, and a report of each outcome."""

import dataclasses
import math

import pytest

from ippon.command import Command, GoalOutcome, NavigationGoal
from ippon.robot import ZED
from ippon.simulation.robot.mobile_base import camera_of
from ippon.simulation.scene import StartPose
from ippon.simulation.world import SimulatedWorld, WorldConfig
from tests.boxes import boxes_scene

ROBOT = dataclasses.replace(ZED, takes_goals=True, takes_velocities=False)
ROOM = [
    ("floor", "floor", (0.0, 0.0, -0.1), (6.0, 4.0, 0.0)),
    ("wall", "wall", (3.0, 0.0, 0.0), (3.1, 2.8, 2.0)),
]


@pytest.fixture
def world():
    start = StartPose(x=1.0, y=1.0, z=0.0, yaw=0.0)
    perfect = WorldConfig.perfect()
    return SimulatedWorld(boxes_scene(ROOM), ROBOT, camera_of(ROBOT, 64), start, 1, perfect)


def drive(world, goal, seconds):
    reports = []
    for _ in range(round(seconds / 0.2)):
        world.step(Command(goal=goal), 0.2)
        reports += world.navigation.take_reports()
        if (goal.number, GoalOutcome.REACHED) in reports:
            break
    return reports


def test_it_drives_around_a_wall_to_the_pose(world):
    goal = NavigationGoal(number=7, x_m=5.0, y_m=1.0, yaw_rad=2.0)
    assert drive(world, goal, 40.0) == [(7, GoalOutcome.ACCEPTED), (7, GoalOutcome.REACHED)]
    assert math.hypot(world.base.x_m - 5.0, world.base.y_m - 1.0) < 0.15
    assert abs(world.base.yaw_rad - 2.0) < 0.15
    assert world.collisions == 0


@pytest.mark.parametrize("at", [(3.05, 1.0), (9.0, 9.0)])
def test_a_goal_in_a_wall_or_outside_fails_without_motion(world, at):
    goal = NavigationGoal(number=1, x_m=at[0], y_m=at[1], yaw_rad=0.0)
    assert drive(world, goal, 1.0) == [(1, GoalOutcome.FAILED)]
    assert world.path_length_m() == 0.0


def test_without_a_goal_it_stops_and_says_that_the_goal_is_cancelled(world):
    goal = NavigationGoal(number=1, x_m=2.0, y_m=1.0, yaw_rad=0.0)
    drive(world, goal, 1.0)
    for _ in range(10):
        world.step(Command(), 0.2)
    assert world.navigation.take_reports() == [(1, GoalOutcome.CANCELLED)]
    assert world.base.linear_m_s == 0.0

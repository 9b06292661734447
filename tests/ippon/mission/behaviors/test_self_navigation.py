"""Searches of a robot that takes goals: it finds, and goals that fail count as out of reach."""

import dataclasses

import numpy as np
import pytest

from ippon.command import Command, GoalOutcome
from ippon.frame import NANOSECONDS
from ippon.geometry import base_pose, yaw_of
from ippon.mission.behaviors.operator_drive import plan_along
from ippon.mission.behaviors.self_navigation import SILENT_TEXT, planner_config
from ippon.mission.config import MissionConfig
from ippon.mission.snapshot import MissionState
from ippon.planning.selection.look_target import stands_facing
from ippon.robot import ZED

pytestmark = pytest.mark.slow

ROBOT = dataclasses.replace(ZED, takes_goals=True, takes_velocities=False)
CHAIR = ("chair", "chair", (4.0, 2.5, 0.0), (4.5, 3.0, 0.8))


@pytest.fixture
def robot(searcher, room):
    return searcher([*room(5.0, 3.5), CHAIR], 1.0, 1.0, yaw=3.0, robot=ROBOT)


def test_it_finds_an_object_with_a_handful_of_goals(robot):
    robot.ask("chair")
    results = robot.search(60.0)
    assert robot.last.state is MissionState.FOUND
    goals = {r.command.goal.number for r in results if r.command.goal is not None}
    assert 2 <= len(goals) <= 15
    assert all(r.command.linear_m_s == r.command.yaw_rate_rad_s == 0.0 for r in results)
    assert results[-1].command.goal is None
    assert robot.world.collisions == 0


def test_stop_ends_the_goal_and_resume_gives_one_again(robot):
    robot.ask("chair")
    robot.search(10.0, until=lambda r: r.command.goal is not None)
    robot.mission.operator.stop()
    assert robot.search(0.4)[-1].command.goal is None
    robot.mission.operator.resume()
    assert robot.search(4.0)[-1].command.goal is not None


def test_goals_that_fail_are_out_of_reach_and_others_are_tried(robot):
    follower = robot.mission.navigation.follower
    robot.world.navigation.take_reports = lambda: [(follower._numbers, GoalOutcome.FAILED)]
    robot.ask("lamp")
    results = robot.search(30.0)
    events = [e for r in results for e in r.snapshot.events if e.kind == "out_of_reach"]
    assert "the robot's navigation could not reach (" in events[0].text
    tried = [r.command.goal for r in results if r.command.goal is not None]
    places = {(round(g.x_m, 1), round(g.y_m, 1)) for g in tried}
    assert len(places) >= 2
    numbers = [g.number for g in tried]
    assert max(numbers) <= 31  # At most one a second.


def test_a_robot_that_does_not_answer_is_said_to_be_silent(robot):
    robot.world.navigation.take_reports = list
    robot.world.navigation.velocities = lambda *args: Command(tilt_rad=args[2])
    robot.ask("chair")
    results = robot.search(9.0)
    assert results[-1].snapshot.why.startswith("nobody answers the goal and nothing moves")


def test_a_point_of_the_operator_is_given_up_when_it_fails(robot):
    robot.ask("chair")
    robot.search(60.0)
    reach = robot.mission.operator.go_to((1.5, 1.5))
    assert reach > 0.5
    command = robot.mission.step(robot.world.observe()).command
    assert np.hypot(command.goal.x_m - 1.5, command.goal.y_m - 1.5) < 0.2
    robot.mission.navigation.follower.report(command.goal.number, GoalOutcome.FAILED)
    robot.mission.step(robot.world.observe())
    assert robot.mission.operator.waypoint is None
    robot.mission.operator.go_to((1.5, 1.5))
    again = robot.mission.step(robot.world.observe()).command.goal
    assert again is not None
    assert again.number == command.goal.number + 1, "the operator does not wait for a retry"


def test_a_robot_that_was_moved_is_sent_to_the_same_point_again(robot, room):
    robot.ask("chair")
    robot.search(60.0)
    operator, here = robot.mission.operator, tuple(robot.at)
    for _ in range(2):
        assert operator.go_to((1.5, 1.5)) > 0.5
        results = robot.search(30.0, until=lambda _: operator.waypoint is None)
        assert results[0].command.goal is not None
        assert results[0].snapshot.why.startswith("going to your point")
        assert results[-1].snapshot.why == "at the point that you chose"
        assert np.hypot(*(robot.at - (1.5, 1.5))) < 0.4
        robot.world.base.x_m, robot.world.base.y_m = here
        robot.rebuild([*room(5.0, 3.5), CHAIR])
        robot.world.stamp_ns += 5 * NANOSECONDS
        robot.mission.step(robot.world.observe())


def test_a_point_of_the_operator_stays_when_an_earlier_goal_fails(robot):
    robot.ask("lamp")
    goal = robot.search(60.0, until=lambda r: _is_far(r.command.goal, (1.0, 1.0)))[-1].command.goal
    robot.mission.operator.go_to((1.0, 1.0))
    robot.mission.navigation.follower.report(goal.number, GoalOutcome.FAILED)
    robot.mission.step(robot.world.observe())
    assert robot.mission.operator.waypoint == (1.0, 1.0)


def _is_far(goal, xy):
    return goal is not None and np.hypot(goal.x_m - xy[0], goal.y_m - xy[1]) > 1.0


def test_a_viewpoint_close_by_that_cannot_be_reached_is_out_of_reach(robot, monkeypatch):
    """Beside a table the next viewpoint is 30 cm farther on, and may be none for the robot."""
    robot.ask("lamp")
    robot.search(60.0, until=lambda r: r.snapshot.state is MissionState.SEARCHING)
    navigation, marked = robot.mission.navigation, []
    monkeypatch.setattr(robot.mission._planner, "mark_unreachable", marked.append)
    pose, (x, y) = robot.world.observe().T_world_base, robot.at
    plan = plan_along(np.array([(x, y), (x + 0.3, y)]), robot.last.plan, pose)
    goal = navigation.follower.step(plan, pose, 0.0, None, 2.0).goal
    navigation.follower.report(goal.number, GoalOutcome.FAILED)
    navigation.react(robot.mission.search)
    assert marked == [(pytest.approx(x + 0.3), pytest.approx(y))]
    goal = navigation.follower.turn(yaw_of(pose) + 1.5, pose, 0.0, 2.0).goal
    navigation.follower.report(goal.number, GoalOutcome.FAILED)
    navigation.react(robot.mission.search)
    assert len(marked) == 1, "it stands there: it cannot turn"


def test_viewpoints_count_as_reached_from_as_far_as_the_robot_stops():
    config = MissionConfig()
    planner, goals = planner_config(config), config.goals
    assert planner.selection.reached_m == goals.near_m
    for look in (planner.closer_look.look, planner.closer_look.passing.look):
        # A goal is kept while its target moves by `moved_m`; the robot stops `near_m` beside it.
        beside = base_pose(0.99 * (goals.moved_m + goals.near_m), 0.0, 0.0, 0.0)
        assert stands_facing(look, beside, np.zeros(2), 0.99 * (goals.turned_rad + goals.near_rad))


def test_a_person_who_carries_the_camera_is_led_to_the_object(searcher, room):
    carried = dataclasses.replace(ZED, name="held", takes_goals=False, takes_velocities=False)
    # The simulated person walks to the goals.
    person = searcher([*room(5.0, 3.5), CHAIR], 1.0, 1.0, yaw=3.0, robot=carried)
    person.ask("chair")
    results = person.search(60.0)
    assert person.last.state is MissionState.FOUND
    led = [r for r in results if r.command.goal is not None]
    assert led
    assert all(r.snapshot.walk is not None for r in led)
    steps = {r.snapshot.walk.step for r in led}
    assert {"turn", "walk"} <= steps
    assert results[-1].snapshot.walk is None
    assert not any(SILENT_TEXT in r.snapshot.why for r in results)


def test_a_person_who_stands_for_a_minute_has_not_failed(searcher, room):
    carried = dataclasses.replace(ZED, name="held", takes_goals=False, takes_velocities=False)
    person = searcher([*room(5.0, 3.5), CHAIR], 1.0, 1.0, yaw=3.0, robot=carried)
    person.world.navigation.velocities = lambda *args: Command(tilt_rad=args[2])
    person.ask("lamp")
    results = person.search(60.0)
    assert not [e for r in results for e in r.snapshot.events if e.kind == "out_of_reach"]
    assert results[-1].snapshot.walk is not None

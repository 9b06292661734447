"""Goals for a robot that navigates by itself: few of them, and what becomes of each."""

import math

import numpy as np
import pytest

from ippon.command import GoalOutcome
from ippon.control.goal_follower import GoalFollower, GoalFollowerConfig
from ippon.geometry import base_pose
from ippon.planning.plan import NodeKind
from ippon.robot import ZED
from tests.ippon.control.test_path_follower import make_plan

DT_S = 0.2
START = base_pose(0.0, 0.0, 0.0, 0.0)


class Follower(GoalFollower):
    def __init__(self, **changes):
        super().__init__(GoalFollowerConfig(**changes), ZED, 0.08)

    def to(self, x, y, yaw=0.0, *, at=START, tilt=-0.3, steps=1):
        for _ in range(steps):
            command = self.step(make_plan([(0, 0), (x, y)], yaw=yaw), at, tilt, None, DT_S)
        return command


def test_a_target_becomes_a_goal_and_no_velocity():
    command = Follower().to(3.0, 1.0, yaw=0.5)
    assert (command.linear_m_s, command.yaw_rate_rad_s, command.tilt_rad) == (0.0, 0.0, -0.3)
    assert (command.goal.number, command.goal.x_m, command.goal.y_m) == (1, 3.0, 1.0)
    assert command.goal.yaw_rad == 0.5


def test_only_a_target_that_moves_beyond_the_limits_is_a_new_goal():
    follower = Follower()
    follower.to(3.0, 1.0, steps=10)
    numbers = [
        follower.to(3.2, 1.0).goal.number,
        follower.to(3.0, 1.0, yaw=0.2).goal.number,
        follower.to(3.3, 1.0).goal.number,
        follower.to(3.3, 1.0, yaw=0.4, steps=6).goal.number,
    ]
    assert numbers == [1, 1, 2, 3]


def test_a_target_that_flickers_gives_at_most_one_goal_a_second():
    follower = Follower()
    numbers = {follower.to(3.0 + k % 2, 1.0).goal.number for k in range(100)}
    assert len(numbers) <= 20 * 1.0 + 1


def test_a_target_without_a_heading_of_its_own_keeps_that_of_the_goal():
    follower = Follower()
    plan = make_plan([(0, 0), (3, 1)])
    for k in range(20):
        target = plan.target.__class__(
            **{f: getattr(plan.target, f) for f in plan.target.__slots__}
            | {"kind": NodeKind.MINIMAL, "yaw_rad": 0.3 * k}
        )
        plan = make_plan([(0, 0), (3, 1)])
        object.__setattr__(plan, "target", target)
        command = follower.step(plan, START, 0.0, None, DT_S)
    assert command.goal.number == 1


def test_arrival_is_what_the_robot_says_once_the_camera_has_its_tilt():
    follower = Follower()
    follower.to(3.0, 1.0)
    follower.report(1, GoalOutcome.ACCEPTED)
    assert follower.to(3.0, 1.0).goal is not None
    follower.report(1, GoalOutcome.REACHED)
    assert follower.to(3.0, 1.0, tilt=0.0).goal is None
    assert not follower.reached
    follower.to(3.0, 1.0, tilt=-0.3)
    assert follower.reached


def test_arrival_does_not_wait_without_end_for_a_camera_that_sticks():
    follower = Follower()
    follower.to(3.0, 1.0)
    follower.report(1, GoalOutcome.REACHED)
    follower.to(3.0, 1.0, tilt=0.0, steps=20)
    assert not follower.reached, "4 s: it may be slow"
    follower.to(3.0, 1.0, tilt=0.0, steps=15)
    assert follower.reached


def test_a_robot_that_says_nothing_has_arrived_when_it_stands_near_the_goal():
    follower = Follower()
    follower.to(3.0, 1.0)
    there = base_pose(2.8, 1.1, 0.0, 0.1)
    follower.to(3.0, 1.0, at=there, steps=9)
    assert not follower.reached
    follower.to(3.0, 1.0, at=there, steps=4)
    assert follower.reached


@pytest.mark.parametrize("moved", [START, base_pose(2.9, 1.0, 0.0, 0.9)])
def test_a_robot_that_was_moved_away_from_what_it_had_reached_is_sent_there_again(moved):
    follower, there = Follower(), base_pose(2.9, 1.0, 0.0, 0.1)
    follower.to(3.0, 1.0)
    follower.report(1, GoalOutcome.REACHED)
    follower.to(3.0, 1.0, at=there)
    assert follower.reached
    assert follower.to(3.0, 1.0, at=moved).goal.number == 2
    assert not follower.reached
    follower.report(2, GoalOutcome.REACHED)
    assert follower.to(3.0, 1.0, at=there).goal is None
    assert follower.reached


def test_a_robot_that_is_carried_off_before_the_next_frame_is_sent_there_again():
    follower = Follower()
    follower.to(3.0, 1.0, at=base_pose(2.9, 1.0, 0.0, 0.1))
    follower.report(1, GoalOutcome.REACHED)
    assert follower.to(3.0, 1.0, at=START).goal.number == 2


@pytest.mark.parametrize("answers", [True, False])
def test_errors_of_the_pose_where_a_robot_has_stopped_send_no_goal_again(answers):
    follower = Follower()
    # Its navigation stops earlier than the follower asks for.
    x = 2.5 if answers else 2.66
    follower.to(3.0, 1.0, at=base_pose(x, 1.0, 0.0, 0.0), steps=1 if answers else 12)
    if answers:
        follower.report(1, GoalOutcome.REACHED)
    for k in range(60):
        off_m, off_rad = 0.3 * (-1) ** k, 0.3 * (-1) ** (k // 2)
        at = base_pose(x + off_m * (k > 0), 1.0, 0.0, off_rad * (k > 0))
        assert follower.to(3.0, 1.0, at=at).goal is None
        assert follower.reached


def test_a_pose_that_jumps_sends_a_goal_once_and_not_at_each_frame():
    follower = Follower()
    follower.to(3.0, 1.0)
    follower.report(1, GoalOutcome.REACHED)
    follower.to(3.0, 1.0, at=base_pose(2.5, 1.0, 0.0, 0.0))
    jumped = base_pose(2.1, 1.0, 0.0, 0.0)
    assert follower.to(3.0, 1.0, at=jumped).goal.number == 2
    follower.report(2, GoalOutcome.REACHED)
    for k in range(60):
        at = base_pose(2.1 + 0.2 * (k % 2), 1.0, 0.0, 0.0)
        assert follower.to(3.0, 1.0, at=at).goal is None


def test_a_failed_goal_that_is_forgotten_is_sent_at_once():
    follower = Follower()
    follower.to(3.0, 1.0)
    follower.report(1, GoalOutcome.FAILED)
    assert follower.to(3.0, 1.0).goal is None
    follower.forget_goal()
    assert follower.to(3.0, 1.0).goal.number == 2


def test_a_failed_goal_is_reported_once_and_not_sent_again_at_once():
    follower = Follower(retry_s=2.0)
    follower.to(3.0, 1.0)
    follower.report(1, GoalOutcome.FAILED)
    assert follower.take_failed().number == 1
    assert follower.take_failed() is None
    assert follower.to(3.0, 1.0, steps=9).goal is None
    assert follower.to(3.0, 1.0, steps=2).goal.number == 2


def test_another_target_after_a_failure_is_sent_at_once():
    follower = Follower()
    follower.to(3.0, 1.0)
    follower.report(1, GoalOutcome.FAILED)
    assert follower.to(1.0, 2.0).goal.number == 2


def test_reports_about_earlier_goals_are_ignored():
    follower = Follower()
    follower.to(3.0, 1.0, steps=6)
    follower.to(1.0, 2.0)
    follower.report(1, GoalOutcome.FAILED)
    follower.report(1, GoalOutcome.CANCELLED)
    assert follower.take_failed() is None
    assert follower.to(1.0, 2.0).goal.number == 2


def test_a_goal_that_somebody_else_cancelled_is_sent_again():
    follower = Follower()
    follower.to(3.0, 1.0)
    follower.report(1, GoalOutcome.CANCELLED)
    assert follower.to(3.0, 1.0).goal.number == 2


def test_a_robot_that_stands_still_far_from_its_goal_has_failed():
    follower = Follower(stuck_s=6.0)
    follower.to(3.0, 1.0)
    follower.report(1, GoalOutcome.ACCEPTED)
    follower.to(3.0, 1.0, steps=29)
    assert follower.take_failed() is None
    follower.to(3.0, 1.0, steps=2)
    assert follower.take_failed().number == 1


def test_a_gap_between_two_frames_is_no_time_in_which_the_robot_stood():
    follower = Follower(stuck_s=6.0)
    plan = make_plan([(0, 0), (3, 1)])
    follower.to(3.0, 1.0)
    follower.report(1, GoalOutcome.ACCEPTED)
    follower.step(plan, START, -0.3, None, 60.0)
    assert follower.take_failed() is None
    near = base_pose(2.8, 1.1, 0.0, 0.1)
    follower.step(plan, near, -0.3, None, DT_S)
    follower.step(plan, near, -0.3, None, 60.0)
    assert not follower.reached, "it may have arrived just now"


def test_without_any_answer_the_robot_is_silent_and_nothing_counts_as_out_of_reach():
    follower = Follower(stuck_s=6.0)
    follower.to(3.0, 1.0, steps=10)
    assert not follower.is_silent
    follower.to(3.0, 1.0, steps=90)
    assert follower.is_silent
    assert follower.take_failed() is None


def test_a_full_turn_takes_few_goals_and_goes_one_way():
    follower, yaw, numbers, turned = Follower(), 0.0, set(), 0.0
    while turned < 2.0 * math.pi:
        pose = base_pose(1.0, 2.0, 0.0, yaw)
        goal = follower.turn(yaw + follower.config.turn_ahead_rad, pose, 0.0, DT_S).goal
        assert (goal.x_m, goal.y_m) == (1.0, 2.0)
        assert 0.0 < (goal.yaw_rad - yaw + math.pi) % (2.0 * math.pi) - math.pi < math.pi
        numbers.add(goal.number)
        yaw, turned = yaw + 0.1, turned + 0.1
    assert len(numbers) <= 7


def test_without_a_target_there_is_no_goal():
    plan = make_plan([(0, 0), (1, 0)])
    object.__setattr__(plan, "path_world", np.zeros((0, 3)))
    assert Follower().step(plan, START, -0.1, None, DT_S).goal is None


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"moved_m": 0.0}, "must be positive and min_period_s at least 0.2"),
        ({"stuck_s": 1.0}, "stuck_s above stands_s"),
        ({"turn_ahead_rad": 3.3}, "lies in 0.5 to 3"),
    ],
)
def test_limits_without_sense_are_refused(changes, text):
    with pytest.raises(ValueError, match=text):
        GoalFollowerConfig(**changes)

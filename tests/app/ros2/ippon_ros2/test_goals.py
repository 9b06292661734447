"""A goal on its way to the robot: sent once, and kept only while the navigator wants it."""

import numpy as np
import pytest

from app.messages.navigation import StampedPose, decode_goal_status, encode_pose
from app.ros2.ippon_ros2.goals import (
    ACCEPTED,
    CANCELLED,
    FAILED,
    REACHED,
    WATCHDOG_S,
    Goals,
    with_pose,
)
from app.ros2.ippon_ros2.serialized import goal_status, stamp_bytes_of
from ippon.command import GoalOutcome

FIRST, SECOND = 1_700_000_000_123_456_789, 1_700_000_000_123_456_790


def pose(stamp_ns):
    return encode_pose(StampedPose(stamp_ns=stamp_ns, T_frame_base=np.eye(4)))


class Navigation:
    def __init__(self):
        self.sent, self.cancelled, self.there = [], 0, True
        self.cleared = []

    def send(self, goal):
        if self.there:
            self.sent.append(goal)
        return self.there

    def cancel(self, here):
        assert here
        self.cancelled += 1

    def cancel_every(self, here):
        if self.there:
            self.cleared.append(here)
        return self.there


@pytest.fixture
def navigation():
    return Navigation()


@pytest.fixture
def said():
    return []


@pytest.fixture
def goals(navigation, said):
    def report(stamp, status):
        said.append(decode_goal_status(goal_status(stamp, status)))

    return Goals(navigation, report)


def drive(goals, stamp_ns, seconds, start=0.0):
    goals.take_goal(pose(stamp_ns), start)
    for k in range(int(seconds * 30)):
        goals.take_active(pose(stamp_ns), start + k / 30)
        goals.tick(start + k / 30)


def test_a_goal_is_sent_once_however_often_it_is_confirmed(goals, navigation):
    drive(goals, FIRST, 2.0)
    drive(goals, FIRST, 2.0, 2.0)
    assert navigation.sent == [pose(FIRST)]
    assert navigation.cancelled == 0


def test_goals_a_nanosecond_apart_are_two(goals, navigation):
    drive(goals, FIRST, 0.1)
    drive(goals, SECOND, 0.1)
    assert len(navigation.sent) == 2
    assert navigation.cancelled == 0, "a new goal replaces the old one"


def test_the_navigator_cancels_at_once(goals, navigation):
    drive(goals, FIRST, 0.1)
    goals.take_active(pose(0), 0.1)
    goals.take_active(pose(0), 0.2)
    assert navigation.cancelled == 1


def test_silence_cancels_and_the_same_goal_goes_on_when_the_link_is_back(goals, navigation, said):
    drive(goals, FIRST, 0.1)
    goals.tick(0.1 + 0.9 * WATCHDOG_S)
    assert navigation.cancelled == 0
    goals.tick(0.2 + WATCHDOG_S)
    goals.tick(5.0)
    assert navigation.cancelled == 1
    goals.ended(pose(FIRST), CANCELLED)
    goals.take_active(pose(FIRST), 6.0)
    assert navigation.sent == [pose(FIRST)] * 2
    assert said == []


def test_what_the_robot_says_goes_back_with_the_stamp_of_the_goal(goals, said):
    drive(goals, FIRST, 0.1)
    goals.ended(pose(FIRST), ACCEPTED)
    goals.ended(pose(FIRST), FAILED)
    assert said == [(FIRST, GoalOutcome.ACCEPTED), (FIRST, GoalOutcome.FAILED)]


def test_a_goal_that_has_ended_is_neither_sent_again_nor_cancelled(goals, navigation):
    drive(goals, FIRST, 0.1)
    goals.ended(pose(FIRST), REACHED)
    drive(goals, FIRST, 0.1, 0.1)
    goals.take_active(pose(0), 0.3)
    assert (len(navigation.sent), navigation.cancelled) == (1, 0)


def test_an_earlier_goal_says_nothing_any_more(goals, said):
    drive(goals, FIRST, 0.1)
    drive(goals, SECOND, 0.1, 0.1)
    goals.ended(pose(FIRST), CANCELLED)
    assert said == []


def test_a_goal_waits_for_a_navigation_that_starts_late(goals, navigation, caplog):
    navigation.there = False
    drive(goals, FIRST, 1.0)
    assert navigation.sent == []
    assert caplog.text.count("nobody takes goals yet") == 1
    navigation.there = True
    goals.take_active(pose(FIRST), 1.0)
    assert navigation.sent == [pose(FIRST)]


def test_a_goal_is_sent_again_to_a_navigation_that_was_started_again(goals, navigation):
    goals.lost()
    drive(goals, FIRST, 1.0)
    navigation.there = False
    goals.lost()
    goals.lost()
    drive(goals, FIRST, 1.0, start=1.0)
    assert len(navigation.sent) == 1
    navigation.there = True
    drive(goals, FIRST, 1.0, start=2.0)
    assert len(navigation.sent) == 2
    assert navigation.cancelled == 0


def test_a_goal_does_not_go_on_where_nobody_takes_the_one_in_its_place(goals, navigation):
    drive(goals, FIRST, 0.1)
    navigation.there = False
    drive(goals, SECOND, 0.1, 0.1)
    assert navigation.cancelled == 1


def test_a_goal_does_not_go_on_where_the_one_in_its_place_was_lost(goals, navigation, said):
    drive(goals, FIRST, 0.1)
    goals.take_active(pose(SECOND), 0.1)
    assert navigation.cancelled == 1
    assert said == [(SECOND, GoalOutcome.CANCELLED)]


def test_a_goal_from_before_the_bridge_is_given_back(goals, said):
    goals.take_active(pose(FIRST), 0.0)
    assert said == [(FIRST, GoalOutcome.CANCELLED)]


def test_what_the_robot_drove_to_before_the_bridge_is_cancelled_once(goals, navigation):
    """A robot of which the bridge was killed drove on to its goal, and Stop did not reach it."""
    navigation.there = False
    goals.take_active(pose(0), 0.0)
    navigation.there = True
    for k in range(3):
        goals.take_active(pose(0), 0.1 * k)
    goals.tick(10.0)
    goals.stop()
    assert navigation.cleared == [pose(0)], "a goal that somebody gives later is not ours"


def test_a_goal_in_force_that_the_bridge_does_not_know_is_cancelled(goals, navigation):
    goals.take_active(pose(FIRST), 0.0)
    assert navigation.cleared == [pose(FIRST)]


def test_a_bridge_without_a_navigator_cancels_and_knows_no_place(goals, navigation):
    navigation.there = False
    goals.take_active(pose(0), 0.0)
    navigation.there = True
    goals.tick(WATCHDOG_S + 0.1)
    assert navigation.cleared == [b""], "the robot would drive back to the place of then"


def test_an_accepted_goal_takes_the_place_of_one_from_before(goals, navigation):
    drive(goals, FIRST, 0.1)
    goals.ended(pose(FIRST), ACCEPTED)
    goals.take_active(pose(0), 0.2)
    assert (navigation.cancelled, navigation.cleared) == (1, [])


def test_stop_cancels_and_nonsense_is_ignored(goals, navigation):
    goals.take_goal(b"nonsense", 0.0)
    goals.take_active(b"\x00\x01\x00\x00", 0.0)
    assert navigation.sent == []
    drive(goals, FIRST, 0.1)
    goals.stop()
    assert navigation.cancelled == 1
    assert stamp_bytes_of(b"\x00\x00" + bytes(20)) == b"", "big-endian"


def test_a_goal_that_arrives_after_the_stop_is_not_sent(goals, navigation):
    drive(goals, FIRST, 0.1)
    goals.stop()
    drive(goals, FIRST, 0.1, 0.1)
    drive(goals, SECOND, 0.1, 0.2)
    assert navigation.sent == [pose(FIRST)]
    assert navigation.cancelled == 1


def test_a_pose_that_is_none_does_not_reach_the_goals(caplog):
    """The watchdog sends the last place to a topic of goals: it ended with one that was NaN."""
    taken = []
    take = with_pose(taken.append)
    take(pose(FIRST)[:-56] + np.full(7, np.nan).tobytes())
    take(b"nonsense")
    assert taken == []
    assert caplog.text.count("a goal was refused") == 2
    take(pose(FIRST))
    assert taken == [pose(FIRST)]

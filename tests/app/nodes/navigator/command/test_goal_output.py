"""Goals over the network: each once, in the robot's frame, and cancelled by Stop and by silence."""

import queue
import time

import numpy as np
import pytest

from app.links.network.subscription import subscribe
from app.messages import keys
from app.messages.motion import decode_twist
from app.messages.navigation import decode_pose, encode_goal_status
from app.nodes.navigator.command import command_stream
from app.nodes.navigator.command.command_stream import CommandStream
from app.nodes.navigator.command.goal_output import GoalOutput
from ippon.command import Command, GoalOutcome, NavigationGoal
from ippon.geometry import base_pose, yaw_of

PATIENCE_S = 20.0
T_MAP_WORLD = base_pose(10.0, 0.0, 0.0, 0.0)
HERE = base_pose(11.0, 2.0, 0.0, 0.3)


def command(number, x=13.0):
    return Command(goal=NavigationGoal(number=number, x_m=x, y_m=1.0, yaw_rad=0.5))


class Bench:
    def __init__(self, navigator, robot):
        self.goals, self.active = queue.SimpleQueue(), queue.SimpleQueue()
        self.twists, self.reports = queue.SimpleQueue(), queue.SimpleQueue()
        self.robot = robot
        subscribe(robot, f"r/{keys.NAVIGATION_GOAL}", lambda p: self.goals.put(decode_pose(p)))
        subscribe(robot, f"r/{keys.NAVIGATION_ACTIVE}", lambda p: self.active.put(decode_pose(p)))
        subscribe(robot, f"r/{keys.CMD_VEL}", self.twists.put)
        output = GoalOutput(navigator, "r", lambda *report: self.reports.put(report), T_MAP_WORLD)
        self.stream = CommandStream(navigator, "r", 50.0, 0.2, output, velocities=False)
        while self.active.empty():  # The subscriptions have come through.
            self.stream.give(Command(), 1, HERE)
            time.sleep(0.02)

    def say(self, stamp_ns, outcome):
        self.robot.put(f"r/{keys.NAVIGATION_STATUS}", encode_goal_status(stamp_ns, outcome))

    def until_active(self, stamp_ns):
        deadline = time.monotonic() + PATIENCE_S
        while (last := self.active.get(timeout=PATIENCE_S)).stamp_ns != stamp_ns:
            assert time.monotonic() < deadline, last
        return last


@pytest.fixture
def bench(sessions, monkeypatch):
    """No frame of it gets too old within a test, however busy the machine is."""
    monkeypatch.setattr(command_stream, "GOAL_STALE_S", 2 * PATIENCE_S)
    bench = Bench(*sessions)
    yield bench
    bench.stream.close()


def test_a_goal_is_sent_once_in_the_frame_of_the_robot(bench):
    for k in range(10):
        bench.stream.give(command(1), 100 + k, HERE)
    goal = bench.goals.get(timeout=PATIENCE_S)
    np.testing.assert_allclose(goal.T_frame_base[:2, 3], (3.0, 1.0))
    assert yaw_of(goal.T_frame_base) == pytest.approx(0.5)
    active = bench.until_active(goal.stamp_ns)
    np.testing.assert_allclose(active.T_frame_base[:2, 3], (1.0, 2.0))
    bench.stream.give(command(2, 14.0), 120, HERE)
    assert bench.goals.get(timeout=PATIENCE_S).stamp_ns > goal.stamp_ns
    assert bench.goals.empty()


def test_stop_cancels_at_once_and_a_goal_that_goes_on_is_sent_anew(bench):
    bench.stream.give(command(1), 100, HERE)
    first = bench.goals.get(timeout=PATIENCE_S)
    bench.until_active(first.stamp_ns)
    bench.stream.halt()
    bench.until_active(0)
    bench.stream.give(command(1), 101, HERE)
    assert bench.stream.sent.goal is None
    assert bench.stream.release(bench.stream.halts)
    bench.stream.give(command(1), 102, HERE)
    assert bench.goals.get(timeout=PATIENCE_S).stamp_ns > first.stamp_ns


@pytest.mark.parametrize("end", ["drop", "close"])
def test_a_lost_stream_and_the_end_of_the_navigator_cancel(bench, end):
    bench.stream.give(command(1), 100, HERE)
    bench.until_active(bench.goals.get(timeout=PATIENCE_S).stamp_ns)
    getattr(bench.stream, end)()
    bench.until_active(0)


def test_a_frame_that_is_too_old_cancels(bench, monkeypatch):
    monkeypatch.setattr(command_stream, "GOAL_STALE_S", 0.3)
    bench.stream.give(command(1), 100, HERE)
    bench.until_active(bench.goals.get(timeout=PATIENCE_S).stamp_ns)
    bench.until_active(0)


def test_what_the_robot_says_comes_back_with_the_number_of_the_goal(bench):
    bench.stream.give(command(7), 100, HERE)
    stamp_ns = bench.goals.get(timeout=PATIENCE_S).stamp_ns
    bench.robot.put(f"r/{keys.NAVIGATION_STATUS}", b"nonsense")
    bench.say(stamp_ns + 12345, GoalOutcome.FAILED)
    bench.say(stamp_ns, GoalOutcome.ACCEPTED)
    bench.say(stamp_ns, GoalOutcome.REACHED)
    assert bench.reports.get(timeout=PATIENCE_S) == (7, GoalOutcome.ACCEPTED)
    assert bench.reports.get(timeout=PATIENCE_S) == (7, GoalOutcome.REACHED)


def test_what_the_hand_commanded_ends_before_the_robot_navigates_by_itself(sessions):
    told = queue.SimpleQueue()
    navigator, robot = sessions
    subscribe(robot, f"r/{keys.NAVIGATION_GOAL}", lambda _: told.put("goal"))
    subscribe(robot, f"r/{keys.CMD_VEL}", lambda p: told.put(decode_twist(p).linear_m_s))
    output = GoalOutput(navigator, "r", lambda *_: None)
    stream = CommandStream(navigator, "r", 50.0, PATIENCE_S, output)
    while told.empty():  # The subscriptions have come through.
        stream.give(Command(linear_m_s=0.5), 1, HERE)
        time.sleep(0.02)
    stream.give(command(1), 2, HERE)
    last = list(iter(lambda: told.get(timeout=PATIENCE_S), "goal"))[-1]
    stream.close()
    assert last == 0.0


def test_no_place_is_told_that_the_robot_may_have_left(sessions):
    """A robot that takes goals from a topic drives to the place to stop."""
    told = []

    class Output:
        def send(self, goal, T_map_base, stamp_ns):
            told.append(T_map_base)

    stream = CommandStream(sessions[0], "r", 50.0, PATIENCE_S, Output(), velocities=False)
    stream.halt()
    stream.give(Command(), 1)
    assert told == []
    stream.give(Command(), 2, HERE)
    stream.drop()
    assert told[-1] is HERE
    count = len(told)
    stream.halt()
    stream.close()
    assert len(told) == count


def test_a_robot_without_velocities_gets_none(bench):
    bench.stream.give(command(1), 100, HERE)
    bench.stream.halt()
    bench.until_active(bench.goals.get(timeout=PATIENCE_S).stamp_ns)
    bench.until_active(0)
    assert bench.twists.empty()

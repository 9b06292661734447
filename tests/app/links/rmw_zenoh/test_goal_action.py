import threading
import time

import numpy as np
import pytest

from app.links.network.subscription import subscribe
from app.links.rmw_zenoh import goal_action, robot_link
from app.links.rmw_zenoh.robot_link import RobotLink
from app.messages.navigation import (
    StampedPose,
    decode_goal_status,
    decode_pose,
    encode_pose,
)
from app.nodes.navigator.command.goal_output import GoalOutput
from app.ros2.ippon_ros2 import goals
from app.ros2.ippon_ros2.settings import read_settings
from ippon.command import GoalOutcome, NavigationGoal
from tests.app.links.rmw_zenoh.rmw_robot import ActionServer, Received, RmwRobot

POSE = "geometry_msgs::msg::dds_::PoseStamped_"
PATIENCE_S = 20.0
WATCHDOG_S = goals.WATCHDOG_S
ACCEPTED, REACHED = GoalOutcome.ACCEPTED, GoalOutcome.REACHED
FAILED, CANCELLED = GoalOutcome.FAILED, GoalOutcome.CANCELLED


def pose(stamp_ns, x=1.0):
    T = np.eye(4)
    T[0, 3] = x
    return encode_pose(StampedPose(stamp_ns=stamp_ns, T_frame_base=T))


class Navigator:
    """Sends goals as the navigator does, and hears what becomes of them.

    It is silent for the robot only after `fall_silent`, however seldom a busy machine lets it
    speak.
    """

    def __init__(self, session, monkeypatch):
        self._monkeypatch = monkeypatch
        self._be_silent_after(PATIENCE_S)
        self._goal = session.declare_publisher("r/navigation/goal")
        self._active = session.declare_publisher("r/navigation/active")
        self.outcomes = Received()
        subscribe(
            session, "r/navigation/status",
            lambda p: self.outcomes.add(decode_goal_status(p), None),
        )  # fmt: skip

    def send(self, stamp_ns, x=1.0):
        self._goal.put(pose(stamp_ns, x))

    def _be_silent_after(self, seconds):
        self._monkeypatch.setattr(goals, "WATCHDOG_S", seconds)

    def fall_silent(self):
        self._be_silent_after(WATCHDOG_S)

    def keep(self, stamp_ns, until):
        """Say that a goal is in force, and where the robot is, until something holds."""
        self._be_silent_after(PATIENCE_S)
        end = time.monotonic() + PATIENCE_S
        while True:
            self._active.put(pose(stamp_ns))
            if until():
                return
            assert time.monotonic() < end, self.outcomes.messages
            time.sleep(0.02)

    def knows(self, *outcomes):
        return lambda: [outcome for outcome, _ in self.outcomes.messages] == list(outcomes)


@pytest.fixture
def scout(sessions, monkeypatch):
    """A robot with an action server, the link, and a navigator that sends goals."""
    monkeypatch.setattr(robot_link, "DISCOVER_S", 0.05)
    router, client = sessions
    robot = RmwRobot(client)
    server = ActionServer(robot, "/navigate_to_pose")
    section = {"middleware": "rmw_zenoh", "navigate": {"frame": "odom"}}
    profile = {"ros2": section, "motion": {"takes": ["goals"]}}
    link = RobotLink(router, "r", read_settings(profile))
    robot.sees("SC/%/%/ippon/%navigate_to_pose%_action%cancel_goal/")
    server.confirmed.wait_for(len)
    yield robot, server, Navigator(client, monkeypatch)
    link.close()


def test_goals_from_before_the_link_are_cancelled_once(scout):
    """After a crash of the navigator, its successor stood, and the robot drove on."""
    _, server, navigator = scout
    end = time.monotonic() + 0.3
    navigator.keep(0, lambda: time.monotonic() > end)
    navigator.fall_silent()
    time.sleep(2 * WATCHDOG_S)
    assert len(server.cleared.messages) == 1
    navigator.send(7)
    navigator.keep(7, server.has_result)
    server.finish(4)
    navigator.keep(7, navigator.knows((7, ACCEPTED), (7, REACHED)))
    assert (len(server.cleared.messages), server.cancelled.messages) == (1, [])


def test_a_cancel_of_earlier_goals_without_an_answer_does_not_cancel_a_new_one(
    sessions, monkeypatch
):
    monkeypatch.setattr(robot_link, "DISCOVER_S", 0.05)
    monkeypatch.setattr(goal_action, "ANSWER_S", 0.5)
    robot = RmwRobot(sessions[1])
    server = ActionServer(robot, "/navigate_to_pose")
    server.silent = 1
    profile = {"ros2": {"middleware": "rmw_zenoh"}, "motion": {"takes": ["goals"]}}
    link = RobotLink(sessions[0], "r", read_settings(profile))
    server.cleared.wait_for(len)
    navigator = Navigator(sessions[1], monkeypatch)
    navigator.send(7)
    navigator.keep(7, server.has_result)
    end = time.monotonic() + 1.0
    navigator.keep(7, lambda: time.monotonic() > end)
    assert len(server.cleared.messages) == 1
    link.close()
    server.cleared.wait_for(lambda m: len(m) == 2)


def test_a_goal_is_sent_once_in_its_frame_and_its_arrival_comes_back(scout):
    _, server, navigator = scout
    navigator.send(7, x=2.5)
    navigator.keep(7, server.has_result)
    ((payload, _),) = server.goals.messages
    goal = decode_pose(payload)
    assert (goal.frame_id, goal.stamp_ns, goal.T_frame_base[0, 3]) == ("odom", 7, 2.5)
    server.finish(4)
    navigator.keep(7, navigator.knows((7, ACCEPTED), (7, REACHED)))
    assert len(server.goals.messages) == 1


def test_a_goal_that_is_refused_or_given_up_has_failed(scout):
    _, server, navigator = scout
    server.accepts = False
    navigator.send(7)
    navigator.keep(7, navigator.knows((7, FAILED)))
    server.accepts = True
    navigator.send(8)
    navigator.keep(8, server.has_result)
    server.finish(6, code=206)
    navigator.keep(8, navigator.knows((7, FAILED), (8, ACCEPTED), (8, FAILED)))


def test_silence_of_the_navigator_cancels_the_goal_at_the_server(scout):
    _, server, navigator = scout
    navigator.send(7)
    navigator.keep(7, server.has_result)
    ((_, number),) = server.goals.messages
    navigator.fall_silent()
    server.cancelled.wait_for(lambda m: m == [(number, None)])


def test_a_cancelled_goal_is_cancelled_again_until_the_server_answers(scout):
    _, server, navigator = scout
    navigator.send(7)
    navigator.keep(7, server.has_result)
    ((_, number),) = server.goals.messages
    # Not a number of times: the link may also cancel again what was driven to before it.
    server.silent = 1000
    navigator.fall_silent()
    server.cancelled.wait_for(lambda m: m[:3] == 3 * [(number, None)])
    server.silent = 0
    server.confirmed.wait_for(lambda m: (number, None) in m)
    sent = len(server.cancelled.messages)
    time.sleep(0.3)
    assert len(server.cancelled.messages) == sent, "and not after it"


def test_a_goal_whose_acceptance_is_lost_is_cancelled(scout):
    _, server, navigator = scout
    server.silent = 1
    navigator.send(7)
    navigator.keep(7, navigator.knows((7, FAILED)))
    ((_, number),) = server.goals.messages
    server.cancelled.wait_for(lambda m: m == [(number, None)])


def test_a_goal_does_not_go_on_where_the_one_in_its_place_has_failed(scout):
    """Nav2 goes on to the first goal where it gives up the second before it begins."""
    _, server, navigator = scout
    navigator.send(7)
    navigator.keep(7, server.has_result)
    ((_, first),) = server.goals.messages
    server.accepts = False
    navigator.send(8)
    navigator.keep(8, navigator.knows((7, ACCEPTED), (8, FAILED)))
    server.cancelled.wait_for(lambda m: m == [(first, None)])


def test_a_stop_cancels_the_goal_that_was_to_be_replaced_by_one_without_an_answer(scout):
    _, server, navigator = scout
    navigator.send(7)
    navigator.keep(7, server.has_result)
    server.silent = 1
    navigator.send(8)
    (_, first), (_, second) = server.goals.wait_for(lambda m: len(m) == 2)
    navigator.fall_silent()
    server.cancelled.wait_for(lambda m: {number for number, _ in m} == {first, second})


def test_the_end_of_a_cancelled_goal_does_not_end_the_same_goal_sent_again(scout):
    _, server, navigator = scout
    navigator.send(7)
    navigator.keep(7, server.has_result)
    navigator.fall_silent()
    server.cancelled.wait_for(len)
    first = server.take_result()
    navigator.keep(7, lambda: len(server.goals.messages) == 2 and server.has_result())
    server.finish_query(first, 5)
    navigator.keep(7, lambda: len(navigator.outcomes.messages) >= 2)
    time.sleep(0.3)
    assert {outcome for outcome, _ in navigator.outcomes.messages} == {(7, ACCEPTED)}


def test_a_goal_that_somebody_else_cancels_comes_back_so(scout):
    _, server, navigator = scout
    navigator.send(7)
    navigator.keep(7, server.has_result)
    server.finish(5)
    navigator.keep(7, navigator.knows((7, ACCEPTED), (7, CANCELLED)))


def test_the_end_of_the_link_cancels_the_goal(sessions, monkeypatch):
    monkeypatch.setattr(robot_link, "DISCOVER_S", 0.05)
    robot = RmwRobot(sessions[1])
    server = ActionServer(robot, "/navigate_to_pose")
    profile = {"ros2": {"middleware": "rmw_zenoh"}, "motion": {"takes": ["goals"]}}
    link = RobotLink(sessions[0], "r", read_settings(profile))
    robot.sees("SC/%/%/ippon/%navigate_to_pose%_action%cancel_goal/")
    navigator = Navigator(sessions[1], monkeypatch)
    navigator.send(7)
    navigator.keep(7, server.has_result)
    link.close()
    server.cancelled.wait_for(len)


@pytest.fixture
def goal_topic(sessions, monkeypatch):
    """A robot that takes goals on a topic and was sent goal 7: link and received messages."""
    monkeypatch.setattr(robot_link, "DISCOVER_S", 0.05)
    robot = RmwRobot(sessions[1])
    received = robot.subscription("/goal_pose", POSE)
    profile = {
        "ros2": {"middleware": "rmw_zenoh", "goal": "goal_pose"},
        "motion": {"takes": ["goals"]},
    }
    link = RobotLink(sessions[0], "r", read_settings(profile))
    robot.sees("MP/%/%/ippon/%goal_pose/")
    navigator = Navigator(sessions[1], monkeypatch)
    navigator.send(7, x=2.5)
    # The goal may be accepted before the link has subscribed to where the robot is.
    accepted = navigator.knows((7, ACCEPTED))
    navigator.keep(7, lambda: accepted() and link._goals._here)
    yield link, received, robot, navigator
    link.close()


def test_goals_can_be_a_topic_and_a_stop_is_a_goal_where_the_robot_stands(goal_topic):
    _, received, _, navigator = goal_topic
    (first, _), *_ = received.wait_for(len)
    assert decode_pose(first).T_frame_base[0, 3] == 2.5
    navigator.fall_silent()
    messages = received.wait_for(lambda m: len(m) == 2)
    assert decode_pose(messages[1][0]).T_frame_base[0, 3] == 1.0, "where the robot stands"


def _stamps(received):
    return [decode_pose(payload).stamp_ns for payload, _ in received.messages]


def test_a_goal_waits_where_nobody_subscribes_any_more(goal_topic):
    link, received, robot, navigator = goal_topic
    received.wait_for(len)
    for token in (robot.tokens.pop(), robot.tokens.pop()):
        token.undeclare()
    robot.misses("MS/%/%/scout/%goal_pose/")
    end = time.monotonic() + 0.5
    navigator.send(8)
    navigator.keep(8, lambda: time.monotonic() > end)
    assert navigator.knows((7, ACCEPTED))(), "nobody has accepted the second goal"
    again = robot.subscription("/goal_pose", POSE)
    navigator.keep(8, navigator.knows((7, ACCEPTED), (8, ACCEPTED)))
    again.wait_for(len)
    assert _stamps(again)[0] == 8
    assert link._goals.sent == 2


def test_a_goal_is_sent_again_to_a_subscriber_that_was_started_again(goal_topic):
    link, received, robot, navigator = goal_topic
    received.wait_for(len)
    for token in (robot.tokens.pop(), robot.tokens.pop()):
        token.undeclare()
    navigator.keep(7, lambda: not link._goals._driving)
    again = robot.subscription("/goal_pose", POSE)
    navigator.keep(7, lambda: len(again.messages) > 0)
    assert _stamps(again)[0] == 7


def test_what_is_no_pose_ends_no_watchdog(goal_topic, sessions):
    link, received, _, navigator = goal_topic
    # Its stamp is that of the goal, and the rest is missing.
    sessions[1].put("r/navigation/active", pose(7)[:24])
    navigator.fall_silent()
    messages = received.wait_for(lambda m: len(m) == 2)
    assert decode_pose(messages[1][0]).T_frame_base[0, 3] == 1.0
    assert link._watchdog.is_alive()


def test_a_goal_of_a_topic_from_before_the_link_ends_where_the_robot_stands(sessions, monkeypatch):
    monkeypatch.setattr(robot_link, "DISCOVER_S", 0.05)
    robot = RmwRobot(sessions[1])
    received = robot.subscription("/goal_pose", POSE)
    section = {"middleware": "rmw_zenoh", "goal": "goal_pose"}
    profile = {"ros2": section, "motion": {"takes": ["goals"]}}
    link = RobotLink(sessions[0], "r", read_settings(profile))
    robot.sees("MP/%/%/ippon/%goal_pose/")
    navigator = Navigator(sessions[1], monkeypatch)
    navigator.keep(0, lambda: len(received.messages) > 0)
    end = time.monotonic() + 0.3
    navigator.keep(0, lambda: time.monotonic() > end)
    link.close()
    ((payload, _),) = received.messages
    assert decode_pose(payload).T_frame_base[0, 3] == 1.0


def test_nobody_who_takes_goals_is_said(sessions, monkeypatch):
    monkeypatch.setattr(robot_link, "DISCOVER_S", 0.05)
    monkeypatch.setattr(robot_link, "MISSING_AFTER_S", 0.0)
    profile = {"ros2": {"middleware": "rmw_zenoh"}, "motion": {"takes": ["goals"]}}
    link = RobotLink(sessions[0], "r", read_settings(profile))
    end = time.monotonic() + 20.0
    while not any("nobody serves the action /navigate_to_pose" in note for note in link.notes()):
        assert time.monotonic() < end
        time.sleep(0.01)
    link.close()


@pytest.fixture
def output(sessions, monkeypatch):
    """The navigator's goals in the session of the link, as in its process, and what it is told."""
    monkeypatch.setattr(robot_link, "DISCOVER_S", 0.05)
    monkeypatch.setattr(goals, "WATCHDOG_S", PATIENCE_S)
    told = Received()
    output = GoalOutput(sessions[0], "r", lambda *report: told.add(report, None))
    output.told = told
    return output


def _ends(call, output):
    """Call in a thread; where that hangs, end it, so that sessions can be closed, and fail."""
    thread = threading.Thread(target=call, daemon=True)
    thread.start()
    thread.join(PATIENCE_S)
    hangs = thread.is_alive()
    if hangs:
        output._lock.release()
    assert not hangs


def test_goals_of_a_topic_and_a_stop_pass_in_the_session_of_the_navigator(sessions, output):
    robot = RmwRobot(sessions[1])
    received = robot.subscription("/goal_pose", POSE)
    section = {"middleware": "rmw_zenoh", "goal": "goal_pose"}
    profile = {"ros2": section, "motion": {"takes": ["goals"]}}
    link = RobotLink(sessions[0], "r", read_settings(profile))
    try:
        robot.sees("MP/%/%/ippon/%goal_pose/")
        goal = NavigationGoal(number=3, x_m=2.5, y_m=0.0, yaw_rad=0.0)

        def drive():
            while not (output.told.messages and received.messages):
                output.send(goal, np.eye(4), 7)
                time.sleep(0.02)
            output.send(None, np.eye(4), 7)

        _ends(drive, output)
        assert output.told.messages == [((3, ACCEPTED), None)]
        messages = received.wait_for(lambda m: len(m) >= 2)
        goals_x = [decode_pose(payload).T_frame_base[0, 3] for payload, _ in messages]
        assert (goals_x[0], goals_x[-1]) == (2.5, 0.0), "the goal, and where the robot stands"
    finally:
        link.close()


def test_a_status_of_an_action_holds_up_no_stop_in_the_session_of_the_navigator(
    sessions, output, monkeypatch
):
    robot = RmwRobot(sessions[1])
    server = ActionServer(robot, "/navigate_to_pose")
    profile = {"ros2": {"middleware": "rmw_zenoh"}, "motion": {"takes": ["goals"]}}
    status_comes, encode = threading.Event(), robot_link.goal_status

    def goal_status(*status):
        status_comes.set()
        return encode(*status)

    monkeypatch.setattr(robot_link, "goal_status", goal_status)
    link = RobotLink(sessions[0], "r", read_settings(profile))
    try:
        robot.sees("SC/%/%/ippon/%navigate_to_pose%_action%cancel_goal/")
        navigator = Navigator(sessions[0], monkeypatch)

        def stop():
            with output._lock:  # As a Stop that is being sent has it.
                navigator.send(7)
                navigator.keep(7, status_comes.is_set)
                navigator.keep(0, lambda: True)

        _ends(stop, output)
        server.cancelled.wait_for(len)
    finally:
        link.close()

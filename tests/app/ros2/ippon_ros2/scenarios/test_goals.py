"""The navigator's goals through the bridge to a real action server, and to a real topic."""

import json
import queue
import signal
import time
from pathlib import Path

import pytest
import yaml

from app.links.network.session import open_client, open_router
from app.messages import keys
from app.messages.navigation import decode_pose
from app.nodes.navigator.command.command_stream import CommandStream
from app.nodes.navigator.command.goal_output import GoalOutput
from ippon.command import Command, GoalOutcome, NavigationGoal
from ippon.geometry import base_pose
from tests.app.ros2.ippon_ros2.ros2_process import (
    HAS_COMPILER,
    Ros2Process,
    build_action_types,
)
from tests.locations import ROS2_PYTHON
from tests.ports import free_domain, free_endpoint

pytestmark = [
    pytest.mark.process,
    pytest.mark.skipif(not ROS2_PYTHON.exists(), reason="needs scripts/setup --ros2"),
    pytest.mark.skipif(not HAS_COMPILER, reason="needs gcc and g++ to build nav2_msgs"),
]
HERE = base_pose(1.0, 2.0, 0.0, 0.0)


class Rig:
    """The navigator's command stream, the bridge, and a navigation of ROS 2."""

    def __init__(self, folder: Path, endpoint: str, ros2: dict, options: dict) -> None:
        self.folder, self.endpoint = folder, endpoint
        self.domain = free_domain()
        self.router, self.session = open_router(endpoint), open_client(endpoint)
        self.goals, self.cancelled = queue.SimpleQueue(), queue.SimpleQueue()
        self.reports = queue.SimpleQueue()
        self._subscribers = [
            self.session.declare_subscriber(
                "robot/goal", lambda s: self.goals.put(decode_pose(s.payload.to_bytes()))
            ),
            self.session.declare_subscriber(
                "robot/cancelled", lambda s: self.cancelled.put(float(s.payload.to_string()))
            ),
        ]
        self._sends_goals = self.router.declare_publisher(f"ippon/{keys.NAVIGATION_GOAL}")
        output = GoalOutput(self.router, "ippon", lambda *report: self.reports.put(report))
        self.stream = CommandStream(self.router, "ippon", 30.0, 60.0, output, velocities=False)
        profile = {"motion": {"takes": ["goals"]}, "ros2": ros2}
        (folder / "scout.yaml").write_text(yaml.safe_dump(profile))
        self._options = json.dumps({"connect": endpoint, **options})
        self.robot = self.start_robot()
        self.bridge = self.start_bridge()

    def start_robot(self):
        script = Path(__file__).parents[1] / "ros2_navigation.py"
        log = self.folder / f"robot-{time.monotonic_ns()}.log"
        robot = Ros2Process([str(script), self._options], self.domain, log)
        robot.wait_for_log("ready")
        return robot

    def start_bridge(self):
        log = self.folder / f"bridge-{time.monotonic_ns()}.log"
        arguments = ["-m", "ippon_ros2", "--connect", self.endpoint]
        profile = ["--profile", str(self.folder / "scout.yaml")]
        bridge = Ros2Process([*arguments, *profile], self.domain, log)
        bridge.wait_for_log("goals go to")
        # The router learns of its subscription a moment later, and a goal is sent once.
        deadline = time.monotonic() + 20.0
        while not self._sends_goals.matching_status.matching:
            assert time.monotonic() < deadline, bridge.log()
            time.sleep(0.01)
        return bridge

    def give(self, number, x=3.0):
        goal = NavigationGoal(number=number, x_m=x, y_m=1.0, yaw_rad=0.0)
        self.stream.give(Command(goal=goal), time.time_ns(), HERE)

    def until_reported(self, *wanted):
        while (report := self.reports.get(timeout=20.0)) != wanted:
            pass
        return report

    def until_cancelled(self, x):
        while self.cancelled.get(timeout=20.0) != x:
            pass

    def close(self):
        self.stream.close()
        self.bridge.stop()
        self.robot.stop()
        self.session.close()
        self.router.close()


@pytest.fixture(scope="module")
def rig(tmp_path_factory):
    build_action_types()
    made = Rig(
        tmp_path_factory.mktemp("goals"), free_endpoint(),
        {"navigate": {"topic": "go", "frame": "odom"}}, {"action": "/go"},
    )  # fmt: skip
    yield made
    made.close()


def test_a_goal_reaches_the_action_and_its_result_comes_back(rig):
    rig.give(1)
    goal = rig.goals.get(timeout=20.0)
    assert goal.frame_id == "odom"
    assert goal.T_frame_base[:2, 3].tolist() == [3.0, 1.0]
    rig.until_reported(1, GoalOutcome.ACCEPTED)
    rig.session.put("robot/result", "reached")
    rig.until_reported(1, GoalOutcome.REACHED)


def test_what_the_navigation_gives_up_or_refuses_has_failed(rig):
    rig.give(2)
    rig.goals.get(timeout=20.0)
    rig.session.put("robot/result", "failed")
    rig.until_reported(2, GoalOutcome.FAILED)
    assert "no valid path" in rig.bridge.log()
    rig.give(3, x=60.0)
    rig.until_reported(3, GoalOutcome.FAILED)
    assert "refuses the goal" in rig.bridge.log()


def test_a_new_goal_replaces_the_old_one_without_a_stop(rig):
    rig.give(4)
    rig.goals.get(timeout=20.0)
    rig.give(5, x=4.0)
    assert rig.goals.get(timeout=20.0).T_frame_base[0, 3] == 4.0
    rig.until_reported(5, GoalOutcome.ACCEPTED)
    assert rig.cancelled.empty()


def test_stop_cancels_the_action_within_half_a_second(rig):
    rig.give(6, x=5.0)
    rig.goals.get(timeout=20.0)
    rig.until_reported(6, GoalOutcome.ACCEPTED)
    began = time.monotonic()
    rig.stream.halt()
    rig.until_cancelled(5.0)
    assert time.monotonic() - began < 0.5
    assert rig.stream.release(rig.stream.halts)


def test_silence_of_the_navigator_cancels_and_its_return_goes_on(rig, monkeypatch):
    rig.give(7, x=6.0)
    rig.goals.get(timeout=20.0)
    rig.until_reported(7, GoalOutcome.ACCEPTED)
    with rig.stream._lock:  # Nothing is sent: as when the navigator hangs.
        began = time.monotonic()
        rig.until_cancelled(6.0)
        assert time.monotonic() - began < 1.0
    assert rig.goals.get(timeout=20.0).T_frame_base[0, 3] == 6.0


def test_a_goal_does_not_go_on_where_the_one_in_its_place_is_refused(rig):
    rig.give(20, x=8.0)
    rig.until_reported(20, GoalOutcome.ACCEPTED)
    rig.give(21, x=60.0)
    rig.until_reported(21, GoalOutcome.FAILED)
    rig.until_cancelled(8.0)


def test_a_cancel_without_an_answer_is_sent_again(rig):
    rig.give(22, x=31.0)
    rig.until_reported(22, GoalOutcome.ACCEPTED)
    rig.stream.halt()
    rig.until_cancelled(31.0)
    assert rig.stream.release(rig.stream.halts)


def test_a_goal_that_is_accepted_too_late_has_failed_and_is_cancelled(rig):
    rig.give(23, x=41.0)
    rig.until_reported(23, GoalOutcome.FAILED)
    assert "does not answer" in rig.bridge.log()
    rig.until_cancelled(41.0)


def test_the_end_of_the_bridge_cancels(rig):
    rig.give(8, x=7.0)
    while rig.goals.get(timeout=20.0).T_frame_base[0, 3] != 7.0:
        pass
    rig.until_reported(8, GoalOutcome.ACCEPTED)
    rig.bridge.child.send_signal(signal.SIGTERM)
    assert rig.bridge.child.wait(timeout=20) == 0
    rig.until_cancelled(7.0)
    rig.bridge = rig.start_bridge()


def test_a_goal_from_before_a_crash_of_the_bridge_is_cancelled_by_the_next_one(rig):
    rig.give(9, x=9.0)
    rig.until_reported(9, GoalOutcome.ACCEPTED)
    rig.bridge.kill()
    rig.stream.halt()
    rig.bridge = rig.start_bridge()
    rig.until_cancelled(9.0)
    assert rig.stream.release(rig.stream.halts)


def test_a_topic_gets_each_goal_once_and_the_robots_place_to_stop_it(tmp_path, free_endpoint):
    rig = Rig(tmp_path, free_endpoint, {"goal": "goal_pose"}, {"topic": "/goal_pose"})
    try:
        rig.give(1)
        assert rig.goals.get(timeout=20.0).T_frame_base[:2, 3].tolist() == [3.0, 1.0]
        rig.until_reported(1, GoalOutcome.ACCEPTED)
        rig.robot.child.send_signal(signal.SIGINT)
        rig.robot.child.wait(20.0)
        rig.bridge.wait_for_log("who took the goal has gone")
        rig.robot = rig.start_robot()
        assert rig.goals.get(timeout=20.0).T_frame_base[:2, 3].tolist() == [3.0, 1.0]
        rig.stream.halt()
        assert rig.goals.get(timeout=20.0).T_frame_base[:2, 3].tolist() == [1.0, 2.0]
        assert rig.goals.empty()
    finally:
        rig.close()

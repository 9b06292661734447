"""The bridge of a robot in a simulator, which publishes its own time on /clock."""

import json
import struct
import threading
import time
from pathlib import Path

import pytest
import yaml

from app.links.network.session import open_client, open_router
from app.messages.motion import StampedTwist, encode_twist
from tests.app.ros2.ippon_ros2.ros2_process import Ros2Process
from tests.locations import ROS2_PYTHON
from tests.ports import free_domain

pytestmark = [
    pytest.mark.process,
    pytest.mark.skipif(not ROS2_PYTHON.exists(), reason="needs scripts/setup --ros2"),
]

SECOND = 100
CLOCK = struct.pack("<4siI", b"\0\1\0\0", SECOND, 0)
TWIST = "geometry_msgs/msg/TwistStamped"


@pytest.fixture
def robot(tmp_path, free_endpoint):
    """A simulated robot whose time is `SECOND`: what starts its bridge, and stamps of commands."""
    router, session = open_router(free_endpoint), open_client(free_endpoint)
    stamps, came = [], threading.Event()

    def on_twist(sample):
        stamp = json.loads(sample.payload.to_bytes())["stamp"]
        # Before the first message of the clock its time is 0.
        if stamp != 0:
            stamps.append(stamp)
            came.set()

    subscriber = session.declare_subscriber("robot/twist", on_twist)
    (tmp_path / "sim.yaml").write_text(yaml.safe_dump({"ros2": {"cmd_vel": "/cmd_vel"}}))
    options = {
        "connect": free_endpoint,
        "topics": {"/clock": {"type": "rosgraph_msgs/msg/Clock"}},
        "cmd_vel": "/cmd_vel",
        "cmd_type": TWIST,
    }
    domain = free_domain()
    script = Path(__file__).parents[1] / "ros2_robot.py"
    processes = [Ros2Process([str(script), json.dumps(options)], domain, tmp_path / "robot.log")]
    processes[0].wait_for_log("ready")

    def start(*more):
        arguments = ["-m", "ippon_ros2", "--connect", free_endpoint]
        profile = ["--profile", str(tmp_path / "sim.yaml")]
        bridge = Ros2Process([*arguments, *profile, *more], domain, tmp_path / "bridge.log")
        processes.append(bridge)
        return bridge

    def drive():
        end = time.monotonic() + 20.0
        while not came.wait(1 / 30):
            assert time.monotonic() < end
            session.put("robot/clock", CLOCK)
            command = StampedTwist(stamp_ns=SECOND * 10**9, linear_m_s=0.1, yaw_rate_rad_s=0.0)
            session.put("ippon/cmd_vel", encode_twist(command))
        return stamps[0]

    yield start, drive
    for process in processes:
        process.stop()
    del subscriber
    session.close()
    router.close()


def test_commands_have_the_time_of_the_simulator(robot):
    start, drive = robot
    bridge = start("--ros-args", "-p", "use_sim_time:=true")
    bridge.wait_for_log(f"cmd_vel: /cmd_vel ({TWIST})")
    assert drive() == SECOND


def test_a_clock_that_the_bridge_does_not_go_by_is_said(robot):
    start, drive = robot
    bridge = start()
    bridge.wait_for_log(f"cmd_vel: /cmd_vel ({TWIST})")
    assert drive() > 10**9
    bridge.wait_for_log("start it with --ros-args -p use_sim_time:=true")


def test_arguments_that_ros_does_not_know_are_said(robot):
    start, _ = robot
    bridge = start("--ros-args", "use_sim_time")
    assert bridge.child.wait(60.0) == 2
    assert "ippon_ros2: --ros-args use_sim_time: " in bridge.log()

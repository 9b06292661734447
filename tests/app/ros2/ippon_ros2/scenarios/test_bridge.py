"""The bridge between a real ROS 2 node and a zenoh router."""

import datetime as dt
import json
import signal
import threading
import time
from pathlib import Path

import numpy as np
import pytest
import yaml

from app.certificates.roles import write_roles
from app.links.network.session import PROFILE as ZENOH_PROFILE
from app.links.network.session import open_client, open_router
from app.messages.depth.depth_images import decode_depth, decode_depth_raw, encode_depth_raw
from app.messages.motion import StampedTwist, encode_twist
from tests.app.messages.robot_messages import odometry
from tests.app.ros2.ippon_ros2.ros2_process import Ros2Process
from tests.locations import ROS2_PYTHON
from tests.ports import free_domain, free_endpoint

pytestmark = [
    pytest.mark.process,
    pytest.mark.skipif(not ROS2_PYTHON.exists(), reason="needs scripts/setup --ros2"),
]

IMAGE = "sensor_msgs/msg/Image"
TOPICS = {
    "/scout/camera/color/image_raw": {"type": IMAGE, "best_effort": True},
    "/scout/camera/depth/image_raw": {"type": IMAGE},
    "/scout/camera/color/camera_info": {"type": "sensor_msgs/msg/CameraInfo", "latched": True},
    "/scout/odom": {"type": "nav_msgs/msg/Odometry"},
    "/scout/bumper": {"type": "std_msgs/msg/Float64"},
}
PROFILE = {
    "motion": {"max_speed_m_s": 0.5, "max_turn_deg_s": 60},
    "ros2": {
        "namespace": "/scout",
        "color": {"topic": "camera/color/image_raw"},
        "odom": "odom",
        "contact": "bumper",
    },
}


class Rig:
    """A router in place of the navigator, a robot with ROS 2 topics, and the bridge."""

    def __init__(self, folder: Path, domain: int, endpoint: str) -> None:
        self.folder, self.domain, self.endpoint = folder, domain, endpoint
        self.router = open_router(endpoint)
        self.session = open_client(endpoint)
        self.twists, self.arrived = [], {}
        self.changed = threading.Condition()
        self._subscribers = [
            self.session.declare_subscriber("robot/twist", self._on_twist),
            self.session.declare_subscriber("ippon/**", self._on_message),
        ]
        (folder / "scout.yaml").write_text(yaml.safe_dump(PROFILE))
        options = {
            "connect": endpoint,
            "topics": TOPICS,
            "cmd_vel": "/scout/cmd_vel",
            "cmd_type": "geometry_msgs/msg/Twist",
        }
        script = Path(__file__).parents[1] / "ros2_robot.py"
        self.robot = Ros2Process([str(script), json.dumps(options)], domain, folder / "robot.log")
        self.robot.wait_for_log("ready")
        self.bridge = self.start_bridge()
        self.bridge.wait_for_log("cmd_vel: /scout/cmd_vel (geometry_msgs/msg/Twist)")
        for key in ("color", "depth", "camera_info", "odom"):
            self.bridge.wait_for_log(f"{key}: /scout/")

    def start_bridge(self, *more):
        log = self.folder / f"bridge-{time.monotonic_ns()}.log"
        arguments = ["-m", "ippon_ros2", "--connect", self.endpoint]
        profile = ["--profile", str(self.folder / "scout.yaml")]
        return Ros2Process([*arguments, *profile, *more], self.domain, log)

    def _on_twist(self, sample):
        with self.changed:
            self.twists.append(json.loads(sample.payload.to_bytes()))
            self.changed.notify_all()

    def _on_message(self, sample):
        with self.changed:
            key = str(sample.key_expr).removeprefix("ippon/")
            self.arrived.setdefault(key, []).append(sample.payload.to_bytes())
            self.changed.notify_all()

    def publish(self, topic, payload):
        self.session.put(f"robot{topic}", payload)

    def wait_for(self, condition, timeout_s=20.0):
        with self.changed:
            assert self.changed.wait_for(condition, timeout_s), self.bridge.log()

    def publish_until(self, condition, *messages, timeout_s=20.0):
        """Publish messages until a condition holds: what is sent before two nodes know each other
        is lost, and nothing tells when they do."""
        deadline = time.monotonic() + timeout_s
        while not condition():
            assert time.monotonic() < deadline, self.bridge.log()
            for topic, payload in messages:
                self.publish(topic, payload)
            with self.changed:
                self.changed.wait_for(condition, 0.5)

    def drive(self, commands, linear, turn):
        """Send a number of commands at the navigator's rate."""
        for _ in range(commands):
            command = StampedTwist(stamp_ns=time.time_ns(), linear_m_s=linear, yaw_rate_rad_s=turn)
            self.session.put("ippon/cmd_vel", encode_twist(command))
            time.sleep(1 / 30)
        return time.monotonic()

    def close(self):
        self.bridge.stop()
        self.robot.stop()
        self.session.close()
        self.router.close()


@pytest.fixture(scope="module")
def rig(tmp_path_factory):
    endpoint = free_endpoint()
    made = Rig(tmp_path_factory.mktemp("ros2"), free_domain(), endpoint)
    yield made
    made.close()


@pytest.fixture(scope="module")
def checks(rig):
    """What `--check` says by profile while depth images come; each listens for four seconds."""
    misnamed = {**PROFILE["ros2"], "depth": "aligned/depth"}
    profiles = {
        "whole": PROFILE,
        "misnamed": {**PROFILE, "ros2": misnamed},
        "hand": {**PROFILE, "motion": {"takes": []}},
    }
    begun = {}
    # The zero velocity of the bridge that runs follows the last command of another test.
    time.sleep(1.5)
    rig.twists.clear()
    for name, profile in profiles.items():
        path = rig.folder / f"{name}.yaml"
        path.write_text(yaml.safe_dump(profile))
        begun[name] = rig.start_bridge("--check", "--profile", str(path))
    image = encode_depth_raw(np.full((48, 64), 2.0, np.float32), 5_000_000_000, "camera")
    deadline = time.monotonic() + 60.0
    while any(check.child.poll() is None for check in begun.values()):
        assert time.monotonic() < deadline
        rig.publish("/scout/camera/depth/image_raw", image)
        time.sleep(0.1)
    return begun


def test_a_bridge_with_the_certificate_of_another_role_says_that_it_is_refused(
    tmp_path, monkeypatch
):
    now, hosts = dt.datetime.now(dt.UTC), ("localhost", "127.0.0.1")
    write_roles(tmp_path, robots=("ippon",), hosts=hosts, days=2, now=now)
    routers, bridges = [], []
    for role in ("robot", "console"):
        endpoint = free_endpoint().replace("tcp/", "tls/")
        monkeypatch.setenv(ZENOH_PROFILE, str(tmp_path / "navigator.json5"))
        routers.append(open_router(endpoint))
        monkeypatch.setenv(ZENOH_PROFILE, str(tmp_path / f"{role}.json5"))
        arguments = ["-m", "ippon_ros2", "--connect", endpoint]
        bridges.append(Ros2Process(arguments, 100, tmp_path / f"{role}.log"))
    for bridge in bridges:
        bridge.wait_for_log("nobody publishes /tf")
        bridge.stop()
    for router in routers:
        router.close()
    refused = ["access rules refuse what this bridge sends" in bridge.log() for bridge in bridges]
    assert refused == [False, True]


def test_messages_of_the_robot_arrive_as_they_were_sent(rig):
    depth = np.linspace(0.5, 4.0, 480 * 640, dtype=np.float32).reshape(480, 640)
    image = encode_depth_raw(depth, 5_000_000_000, "camera")
    pose = odometry(5_000_000_000, 1.5, 0.0, 0.0)
    rig.publish_until(
        lambda: {"camera/depth/image_raw", "odom"} <= rig.arrived.keys(),
        ("/scout/camera/depth/image_raw", image),
        ("/scout/odom", pose),
    )
    came = decode_depth_raw(rig.arrived["camera/depth/image_raw"][-1])
    assert came.stamp_ns == 5_000_000_000
    np.testing.assert_array_equal(came.depth, decode_depth_raw(image).depth)
    assert rig.arrived["odom"][-1] == pose


def test_commands_reach_the_robot_within_limits_and_zero_follows_them(rig):
    rig.twists.clear()
    last = rig.drive(30, 0.9, 0.3)
    rig.wait_for(lambda: any(t["linear"] == 0.0 for t in rig.twists))
    moving = [t for t in rig.twists if t["linear"] != 0.0]
    assert {(t["linear"], t["turn"]) for t in moving} == {(0.5, 0.3)}
    assert len(moving) >= 20
    zero = next(t for t in rig.twists if t["linear"] == 0.0)
    assert zero["at"] - last < 0.5
    assert "exceeds the profile's limits" in rig.bridge.log()


def test_a_second_bridge_for_the_same_robot_is_refused(rig):
    second = rig.start_bridge()
    assert second.child.wait(timeout=30) == 2
    assert "another bridge serves the robot 'ippon' already" in second.log()
    assert f"process {rig.bridge.child.pid}" in second.log()


def test_check_says_what_is_there_and_what_is_not(checks):
    check = checks["whole"]
    assert check.child.returncode == 1
    lines = check.log().splitlines()
    assert any(line.startswith("ok") and "camera/depth/image_raw" in line for line in lines)
    silent = next(line for line in lines if "/scout/odom " in line and "INFO" not in line)
    assert silent.startswith("MISSING")
    assert silent.endswith("has a publisher, but nothing came in 4 s")
    wrong = next(line for line in lines if "/scout/bumper" in line and "INFO" not in line)
    assert wrong.startswith("MISSING")
    assert "is std_msgs/msg/Float64; needed: std_msgs/msg/Bool" in wrong


def test_check_stops_nobody_who_drives(rig, checks):
    assert checks["whole"].child.returncode is not None
    assert rig.twists == []


def test_check_names_the_topics_that_a_wrong_name_may_mean(checks):
    check = checks["misnamed"]
    assert check.child.returncode == 1
    line = next(line for line in check.log().splitlines() if "/scout/aligned/depth" in line)
    assert line.startswith("MISSING")
    assert "nobody publishes it; there is" in line
    assert "/scout/camera/depth/image_raw" in line


def test_the_robot_stops_when_the_bridge_is_ended(rig):
    rig.twists.clear()
    driving = threading.Thread(target=rig.drive, args=(30, 0.2, 0.0))
    driving.start()
    try:
        rig.wait_for(lambda: len(rig.twists) > 5)
        rig.bridge.child.send_signal(signal.SIGTERM)
        assert rig.bridge.child.wait(timeout=20) == 0, rig.bridge.log()
        driving.join()
        rig.wait_for(lambda: rig.twists[-1]["linear"] == 0.0)
    finally:
        driving.join()
        rig.bridge.stop()
        rig.bridge = rig.start_bridge()
        rig.bridge.wait_for_log("cmd_vel: /scout/cmd_vel")


def test_raw_depth_is_compressed_without_loss_where_the_profile_says_so(rig):
    section = {**PROFILE["ros2"], "depth": {"topic": "camera/depth/image_raw", "compress": True}}
    path = rig.folder / "compress.yaml"
    path.write_text(yaml.safe_dump({**PROFILE, "ros2": section}))
    second = rig.start_bridge("--robot", "ippon/second", "--profile", str(path))
    try:
        second.wait_for_log("depth: /scout/")
        depth = np.random.default_rng(0).uniform(0.4, 6.0, (480, 640)).astype(np.float32)
        image = encode_depth_raw(depth, 6_000_000_000, "camera")
        key = "second/camera/depth/image_raw/compressedDepth"
        deadline = time.monotonic() + 30.0
        while key not in rig.arrived:
            assert time.monotonic() < deadline, second.log()
            rig.publish("/scout/camera/depth/image_raw", image)
            time.sleep(0.2)
        came = decode_depth(rig.arrived[key][-1])
        assert (came.stamp_ns, came.frame_id) == (6_000_000_000, "camera")
        np.testing.assert_array_equal(came.depth, decode_depth_raw(image).depth)
        assert "second/camera/depth/image_raw" not in rig.arrived
    finally:
        second.stop()


def test_a_camera_in_a_hand_sends_its_images_and_gets_no_commands(rig, checks):
    assert checks["hand"].child.returncode == 1, "contact has another type"
    assert "cmd_vel" not in checks["hand"].log()
    path = rig.folder / "hand.yaml"
    hand = rig.start_bridge("--robot", "ippon/hand", "--profile", str(path))
    try:
        hand.wait_for_log("odom: /scout/odom")
        rig.twists.clear()
        pose = odometry(7_000_000_000, 1.5, 0.0, 0.0)
        end = time.monotonic() + 30.0
        while "hand/odom" not in rig.arrived:
            assert time.monotonic() < end, hand.log()
            rig.publish("/scout/odom", pose)
            twist = StampedTwist(stamp_ns=time.time_ns(), linear_m_s=0.2, yaw_rate_rad_s=0.0)
            rig.session.put("ippon/hand/cmd_vel", encode_twist(twist))
            time.sleep(0.05)
        assert rig.arrived["hand/odom"][-1] == pose
        hand.child.send_signal(signal.SIGTERM)
        assert hand.child.wait(timeout=20) == 0, hand.log()
        assert "cmd_vel" not in hand.log()
        assert [t for t in rig.twists if t["linear"] != 0.0] == []
    finally:
        hand.stop()

"""A whole search by a robot that is known through ROS 2 alone: by velocities, and by goals."""

import json
import threading
import time
from pathlib import Path

import pytest
import zenoh

from app.links.network.requests import last_message
from app.links.network.session import open_client
from app.links.network.subscription import is_alive, subscribe
from app.messages import keys
from app.messages.control import decode
from app.messages.images import decode_color, decompress_color
from app.messages.motion import StampedTwist, decode_transforms, encode_twist
from app.messages.navigation import decode_goal_status, decode_pose
from app.messages.status import Status
from ippon.command import GoalOutcome
from ippon.geometry import yaw_of
from tests.app.messages.robot_messages import odometry, raw_color
from tests.app.ros2.ippon_ros2.ros2_process import HAS_COMPILER, Ros2Process, build_action_types
from tests.locations import ROS2_PYTHON
from tests.ports import free_domain

pytestmark = [
    pytest.mark.process,
    pytest.mark.slow,
    pytest.mark.skipif(not ROS2_PYTHON.exists(), reason="needs scripts/setup --ros2"),
]

PROFILE = """
name: scout
body: {radius_m: 0.25, height_m: 1.2, clearance_m: 0.06}
motion: {max_speed_m_s: 0.8, max_turn_deg_s: 60, takes: [TAKES]}
camera:
  {height_m: 1.2, horizontal_fov_deg: 80, width_over_height: 1.33, max_depth_m: 5, tilt: -18}
ros2:
  color: {topic: camera/color/image_raw}
  depth: {topic: camera/depth/image_raw/compressedDepth}
  odom: odom
"""
COMPRESSED = "sensor_msgs/msg/CompressedImage"
TOPICS = {
    "/camera/color/image_raw": {"type": "sensor_msgs/msg/Image"},
    "/camera/depth/image_raw/compressedDepth": {"type": COMPRESSED},
    "/camera/color/camera_info": {"type": "sensor_msgs/msg/CameraInfo"},
    "/odom": {"type": "nav_msgs/msg/Odometry"},
}


class Robot:
    """Gives a simulated robot the topics that a real one has, and takes velocities from ROS 2.

    Its heatmaps go to the navigator as those of a segmentation on another machine do.
    """

    def __init__(self, session: zenoh.Session) -> None:
        self._session = session
        for topic in (keys.COLOR, keys.DEPTH, keys.CAMERA_INFO, keys.TF, keys.HEATMAP):
            handler = getattr(self, "_on_" + topic.split("/")[-1])
            session.declare_subscriber(f"sim/{topic}", handler)
        session.declare_subscriber("robot/twist", self._on_twist)
        session.declare_subscriber("robot/goal", self._on_goal)
        session.declare_subscriber("robot/cancelled", lambda _: self._active.clear())
        session.declare_subscriber(f"sim/{keys.NAVIGATION_STATUS}", self._on_status)
        self.goals, self._active, self._payload = 0, threading.Event(), b""
        threading.Thread(target=self._keep_goal, daemon=True).start()
        session.declare_subscriber(f"ippon/{keys.LABELS}", self._on_labels)
        session.declare_queryable(f"sim/{keys.LABELS}", self._answer_labels)

    def _on_compressed(self, sample: zenoh.Sample) -> None:
        color = decode_color(sample.payload.to_bytes())
        self._ros2(
            "/camera/color/image_raw", raw_color(decompress_color(color.encoded), color.stamp_ns)
        )

    def _on_compressedDepth(self, sample: zenoh.Sample) -> None:  # noqa: N802
        self._ros2("/camera/depth/image_raw/compressedDepth", sample.payload.to_bytes())

    def _on_camera_info(self, sample: zenoh.Sample) -> None:
        self._ros2("/camera/color/camera_info", sample.payload.to_bytes())

    def _on_tf(self, sample: zenoh.Sample) -> None:
        base = decode_transforms(sample.payload.to_bytes())[0]
        x, y, _ = base.T_parent_child[:3, 3]
        self._ros2("/odom", odometry(base.stamp_ns, x, y, yaw_of(base.T_parent_child)))

    def _on_heatmap(self, sample: zenoh.Sample) -> None:
        self._session.put(f"ippon/{keys.HEATMAP}", sample.payload.to_bytes())

    def _on_twist(self, sample: zenoh.Sample) -> None:
        twist = json.loads(sample.payload.to_bytes())
        command = StampedTwist(
            stamp_ns=time.time_ns(), linear_m_s=twist["linear"], yaw_rate_rad_s=twist["turn"]
        )
        self._session.put(f"sim/{keys.CMD_VEL}", encode_twist(command))

    def _on_goal(self, sample: zenoh.Sample) -> None:
        self.goals += 1
        self._payload = sample.payload.to_bytes()
        self._session.put(f"sim/{keys.NAVIGATION_GOAL}", self._payload)
        self._active.set()

    def _keep_goal(self) -> None:
        # The wheels stop half a second after the last of these.
        while not self._session.is_closed():
            if self._active.wait(0.1):
                self._session.put(f"sim/{keys.NAVIGATION_ACTIVE}", self._payload)
                time.sleep(0.1)

    def _on_status(self, sample: zenoh.Sample) -> None:
        stamp_ns, outcome = decode_goal_status(sample.payload.to_bytes())
        present = self._payload and stamp_ns == decode_pose(self._payload).stamp_ns
        if present and outcome in (GoalOutcome.REACHED, GoalOutcome.FAILED):
            self._active.clear()
            self._session.put("robot/result", outcome.value)

    def _on_labels(self, sample: zenoh.Sample) -> None:
        self._session.put(f"sim/{keys.LABELS}", sample.payload.to_bytes())

    def _answer_labels(self, query: zenoh.Query) -> None:
        with query:
            payload = last_message(self._session, f"ippon/{keys.LABELS}", 1.0)
            if payload is not None:
                query.reply(f"sim/{keys.LABELS}", payload)

    def _ros2(self, topic: str, payload: bytes) -> None:
        self._session.put(f"robot{topic}", payload)


# That velocities arrive, within limits, and end with the bridge: test_bridge.py. Without a compiler
# there are no goals, so a search by velocities is the only one.
VELOCITIES = pytest.param("velocities", marks=pytest.mark.large if HAS_COMPILER else ())


@pytest.mark.parametrize("takes", [VELOCITIES, "goals"])
def test_a_ros2_robot_with_raw_images_and_odometry_finds_a_hat(
    launch, tmp_path, free_endpoint, room, takes
):
    if takes == "goals":
        if not HAS_COMPILER:
            pytest.skip("needs gcc and g++ to build nav2_msgs")
        build_action_types()
    profile = tmp_path / "scout.yaml"
    profile.write_text(PROFILE.replace("TAKES", takes))
    navigator = launch("navigate", "--listen", free_endpoint, "--profile", str(profile))
    navigator.wait_for_log("navigator ready", 240.0)
    session = open_client(free_endpoint)
    assert is_alive(session, f"ippon/{keys.NAVIGATOR_ALIVE}", 20.0)
    robot = Robot(session)
    statuses = []
    subscribe(session, f"ippon/{keys.STATUS}", lambda p: statuses.append(decode(p, Status)))
    domain = free_domain()
    options = {
        "connect": free_endpoint,
        "topics": TOPICS,
        "cmd_vel": "/cmd_vel",
        "cmd_type": "geometry_msgs/msg/TwistStamped",
    }
    folder = Path(__file__).parents[1]
    script = folder / "ros2_robot.py"
    node = Ros2Process([str(script), json.dumps(options)], domain, tmp_path / "robot.log")
    server = json.dumps({"connect": free_endpoint, "action": "/navigate_to_pose"})
    action = [str(folder / "ros2_navigation.py"), server]
    navigation = (
        Ros2Process(action, domain, tmp_path / "navigation.log") if takes == "goals" else None
    )
    arguments = ["-m", "ippon_ros2", "--connect", free_endpoint, "--profile", str(profile)]
    bridge = Ros2Process(arguments, domain, tmp_path / "bridge.log")
    try:
        ready = "goals go to /navigate" if navigation else "cmd_vel: /cmd_vel (geometry_msgs/msg/T"
        bridge.wait_for_log(ready)
        bridge.wait_for_log("odom: /odom")
        launch(
            "sim", "--connect", free_endpoint, "--robot", "sim", "--home", str(room),
            "--profile", str(profile), "--width", "160",
        )  # fmt: skip
        ask = launch("ask", "hat", "--connect", free_endpoint, "--follow", "--json")
        status, out = ask.finish(100.0)
    finally:
        node.stop()
        if navigation is not None:
            navigation.stop()
        bridge.stop()
        session.close()
    assert status == 0, (out, ask.log(), bridge.log(), statuses[-1:])
    if navigation is not None:
        assert 1 <= robot.goals <= 30, "few goals"

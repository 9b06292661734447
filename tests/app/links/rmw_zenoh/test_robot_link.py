import json
import struct
import threading
import time

import pytest
import xxhash
import zenoh

from app.links.network.session import open_client, open_router
from app.links.network.subscription import subscribe
from app.links.rmw_zenoh import robot_link
from app.links.rmw_zenoh.robot_link import RobotLink
from app.links.rmw_zenoh.streams import Streams
from app.messages.cdr import decode
from app.messages.motion import StampedTwist, encode_number, encode_twist
from app.ros2.ippon_ros2 import rates
from app.ros2.ippon_ros2.settings import Ros2Error, read_settings
from app.ros2.ippon_ros2.zenoh_side import claim
from tests import ports
from tests.app.links.rmw_zenoh.rmw_robot import LATCHED, RELIABLE, SENSOR, Received, RmwRobot

IMAGE = "sensor_msgs::msg::dds_::Image_"
COMPRESSED = "sensor_msgs::msg::dds_::CompressedImage_"
CAMERA = "sensor_msgs::msg::dds_::CameraInfo_"
TF = "tf2_msgs::msg::dds_::TFMessage_"
TWIST = "geometry_msgs::msg::dds_::Twist_"
STAMPED = "geometry_msgs::msg::dds_::TwistStamped_"
OTHER_HASH = "RIHS01_" + "ab" * 32


@pytest.fixture(autouse=True)
def quick(monkeypatch):
    monkeypatch.setattr(robot_link, "DISCOVER_S", 0.05)
    monkeypatch.setattr(robot_link, "MISSING_AFTER_S", 0.0)
    monkeypatch.setattr(robot_link, "RETRY_S", 0.05)
    monkeypatch.setattr(robot_link, "CONNECT_S", 0.2)


@pytest.fixture
def start(sessions):
    """Return what starts a link in the navigator's session, and closes it at the end."""
    links = []

    def start(section=None, session=sessions[0], camera=None, **motion):
        section = {"middleware": "rmw_zenoh", **(section or {})}
        settings = read_settings({"ros2": section, "motion": motion, "camera": camera})
        links.append(RobotLink(session, "r", settings))
        return links[-1]

    yield start
    for link in links:
        link.close()


@pytest.fixture
def hear(sessions):
    """Return what hears a key of the navigator."""

    def hear(key, **options):
        received = Received()
        subscribe(sessions[0], f"r/{key}", lambda p: received.add(p, None), **options)
        return received

    return hear


def stamped(seconds, rest=b"payload"):
    """Return bytes that begin as a message with a header does."""
    return struct.pack("<4siI", b"\0\1\0\0", seconds, 0) + rest


def twist(stamp_s=0.0, linear=0.2, turn=0.0):
    command = StampedTwist(
        stamp_ns=round(1e9 * stamp_s), linear_m_s=linear, yaw_rate_rad_s=turn, tilt_rate_rad_s=0.0
    )
    return encode_twist(command)


def stamped_twist(messages):
    payload, _ = messages[-1]
    return decode(payload, "geometry_msgs/msg/TwistStamped")


def drive_after_an_image(sessions, start, hear, kind, seconds, command):
    """Send a command after an image with a stamp; return what the robot receives."""
    robot = RmwRobot(sessions[1])
    put = robot.publisher("/camera/color/image_raw/compressed", COMPRESSED, SENSOR)
    received = robot.subscription("/cmd_vel", kind)
    heard = hear("camera/color/image_raw/compressed")
    start()
    robot.sees("MP/%/%/ippon/%cmd_vel/")
    robot.sees("MS/%/%/ippon/%camera%color")
    put(stamped(seconds))
    heard.wait_for(len)
    sessions[1].declare_publisher("r/cmd_vel").put(command)
    return received


def repeat(publisher, payload, received, until, timeout_s=20.0):
    """Publish as a navigator does: a link drops what comes before it has its own publisher."""
    end = time.monotonic() + timeout_s
    while not until(received.messages):
        assert time.monotonic() < end, received.messages
        publisher.put(payload)
        time.sleep(0.05)


def wait_for_note(link, text, timeout_s=20.0):
    end = time.monotonic() + timeout_s
    while not any(text in note for note in link.notes()):
        assert time.monotonic() < end, link.notes()
        time.sleep(0.01)


def test_streams_reach_the_keys_of_the_navigator_bit_for_bit(sessions, start, hear):
    robot = RmwRobot(sessions[1])
    puts = {
        "camera/color/image_raw/compressed": robot.publisher(
            "/camera/color/image_raw/compressed", COMPRESSED, SENSOR
        ),
        "camera/depth/image_raw": robot.publisher("/camera/depth/image_raw", IMAGE, SENSOR),
        "camera/color/camera_info": robot.publisher("/camera/color/camera_info", CAMERA),
        "tf": robot.publisher("/tf", TF),
    }
    heard = {key: hear(key) for key in puts}
    start()
    for key, put in puts.items():
        robot.sees(f"MS/%/%/ippon/%{key.replace('/', '%')}/")
        for k in range(3):
            put(stamped(k, key.encode()))
            heard[key].wait_for(lambda m, k=k: len(m) == k + 1)
        assert [m for m, _ in heard[key].messages] == [stamped(k, key.encode()) for k in range(3)]


def test_what_was_sent_before_the_link_began_arrives_and_is_kept(sessions, start, hear):
    robot = RmwRobot(sessions[1])
    put = robot.publisher("/tf_static", TF, LATCHED)
    put(b"before")
    start()
    hear("tf_static", kept=True).wait_for(lambda m: m == [(b"before", None)])
    put(b"after")
    late = hear("tf_static", kept=True)
    late.wait_for(lambda m: (b"after", None) in m)


def test_the_robots_nodes_see_this_program_with_its_endpoints(sessions, start):
    robot = RmwRobot(sessions[1], domain=7)
    robot.publisher("/scout/tf_static", TF, LATCHED)
    robot.subscription("/scout/cmd_vel", TWIST)
    link = start({"domain": 7, "namespace": "/scout", "tf_static": "tf_static"})
    node = robot.sees("/0/0/NN/%/%scout/ippon")
    assert node == f"@ros2_lv/7/{sessions[0].zid()}/0/0/NN/%/%scout/ippon"
    assert robot.sees("MS/%/%scout/ippon/%scout%tf_static/").endswith("/:1:,100:,:,:,,")
    assert robot.sees("MP/%/%scout/ippon/%scout%cmd_vel/").endswith("/::,1:,:,:,,")
    link.close()
    robot.misses("/ippon")


@pytest.mark.parametrize("humble", [False, True])
def test_velocities_reach_the_type_that_is_subscribed_to_with_attachments(sessions, start, humble):
    robot = RmwRobot(sessions[1], humble=humble)
    received = robot.subscription("/cmd_vel", STAMPED)
    start(max_speed_m_s=0.5, max_turn_deg_s=60)
    token = robot.sees("MP/%/%/ippon/%cmd_vel/")
    publisher = sessions[1].declare_publisher("r/cmd_vel")
    turns = lambda m: m and stamped_twist(m).twist.angular.z == 0.3  # noqa: E731
    repeat(publisher, twist(linear=2.0, turn=0.3), received, until=turns)
    message = stamped_twist(received.messages)
    assert message.twist.linear.x == 0.5
    assert message.header.frame_id == "base_link"
    stands = lambda m: stamped_twist(m).twist.angular.z == 0.0  # noqa: E731
    received.wait_for(stands)
    assert stamped_twist(received.messages).twist.linear.x == 0.0, "the navigator is silent"
    messages = received.wait_for(lambda m: len(m) >= 5)
    assert [attached[0] for _, attached in messages[:5]] == [1, 2, 3, 4, 5]
    gid = xxhash.xxh3_128_intdigest(token.encode()).to_bytes(16, "little")
    assert {attached[2] for _, attached in messages} == {gid}


def test_a_command_has_the_time_of_the_robots_clock(sessions, start, hear):
    received = drive_after_an_image(sessions, start, hear, STAMPED, 1000, twist(stamp_s=1000.0))
    (payload, _), *_ = received.wait_for(len)
    stamp = decode(payload, "geometry_msgs/msg/TwistStamped").header.stamp
    assert 1000 <= stamp.sec <= 1010


@pytest.mark.parametrize("seconds", [-(2**31), 2**31 - 1])
def test_images_with_absurd_stamps_do_not_keep_the_robot_from_stopping(
    sessions, start, hear, seconds
):
    received = drive_after_an_image(sessions, start, hear, STAMPED, seconds, twist(linear=0.2))
    received.wait_for(lambda m: len(m) >= 3)
    last, _ = received.messages[-1]
    assert decode(last, "geometry_msgs/msg/TwistStamped").twist.linear.x == 0.0


def test_a_late_command_becomes_zero_velocity(sessions, start, hear):
    received = drive_after_an_image(sessions, start, hear, TWIST, 1000, twist(stamp_s=990.0))
    (payload, _), *_ = received.wait_for(len)
    assert decode(payload, "geometry_msgs/msg/Twist").linear.x == 0.0


def test_the_tilt_is_a_trajectory_where_one_is_subscribed_to(sessions, start, monkeypatch):
    monkeypatch.setattr(rates, "TILT_AGAIN_S", 1000.0)
    robot = RmwRobot(sessions[1])
    kind = "trajectory_msgs/msg/JointTrajectory"
    received = robot.subscription("/head", "trajectory_msgs::msg::dds_::JointTrajectory_")
    start({"cmd_tilt": {"topic": "head", "type": kind, "joint": "head_tilt", "sign": -1}})
    robot.sees("MP/%/%/ippon/%head/")
    publisher = sessions[1].declare_publisher("r/camera/cmd_tilt")
    repeat(publisher, encode_number(-0.3), received, until=len)
    for tilt in (-0.3001, float("nan"), 0.2):
        publisher.put(encode_number(tilt))
    messages = received.wait_for(lambda m: len(m) == 2)
    trajectories = [decode(payload, kind) for payload, _ in messages]
    assert [t.points[0].positions.tolist() for t in trajectories] == [[0.3], [-0.2]]
    assert {tuple(t.joint_names) for t in trajectories} == {("head_tilt",)}


def test_a_camera_whose_pose_is_tracked_misses_no_tf(sessions, start):
    RmwRobot(sessions[1])
    link = start({"contact": "bumper"}, camera={"pose": "tracked"})
    wait_for_note(link, "contact: nobody publishes")
    assert not any(note.startswith("tf") for note in link.notes())


def test_a_camera_in_a_hand_gets_no_commands(sessions, start):
    robot = RmwRobot(sessions[1])
    robot.publisher("/tf", TF)
    robot.subscription("/cmd_vel", TWIST)
    link = start(takes=[])
    robot.sees("MS/%/%/ippon/%tf/")
    assert not any("MP/" in token and "/ippon/" in token for token in robot.graph)
    assert not any("cmd_vel" in note for note in link.notes())


def test_what_is_missing_or_of_another_type_is_said(sessions, start):
    robot = RmwRobot(sessions[1])
    robot.publisher("/front/camera/color/camera_info", CAMERA)
    robot.publisher("/camera/depth/image_raw", TWIST)
    robot.publisher("/tf", TF, type_hash=OTHER_HASH)
    robot.publisher("/tf_static", TF, RELIABLE)
    link = start()
    wait_for_note(
        link, "nobody publishes /camera/color/camera_info; there is /front/camera/color/camera_info"
    )
    wait_for_note(link, "/camera/depth/image_raw is geometry_msgs/msg/Twist; needed: sensor_msgs")
    wait_for_note(
        link, "/tf has another definition of tf2_msgs/msg/TFMessage: its hash is RIHS01_ab"
    )
    wait_for_note(link, "/tf_static is published volatile: what was sent before now is lost")
    wait_for_note(link, "cmd_vel: nobody subscribes to /cmd_vel")


def test_a_node_of_another_domain_is_not_heard(sessions, start):
    robot = RmwRobot(sessions[1], domain=5)
    robot.publisher("/tf", TF)
    link = start({"domain": 4})
    wait_for_note(link, "nobody publishes /tf")


def test_a_node_that_comes_back_with_another_version_of_ros_is_found(sessions, start, hear):
    heard = hear("tf")
    jazzy = RmwRobot(sessions[1])
    jazzy.publisher("/tf", TF)
    start()
    jazzy.sees("MS/%/%/ippon/%tf/")
    for token in jazzy.tokens:
        token.undeclare()
    humble = RmwRobot(sessions[1], node="humble", humble=True)
    put = humble.publisher("/tf", TF)
    humble.sees("%tf/tf2_msgs::msg::dds_::TFMessage_/TypeHashNotSupported/::,100:")
    put(b"humble")
    heard.wait_for(lambda m: m == [(b"humble", None)])


def test_the_robots_own_router_is_waited_for_and_may_start_again(sessions, start, hear):
    endpoint = ports.free_endpoint()
    heard = hear("tf")
    link = start({"router": endpoint})
    wait_for_note(link, f"waiting for the robot: no router of the robot answers at {endpoint}")
    for payload in (b"by its router", b"by its next one"):
        router = open_router(endpoint)
        node = open_client(endpoint)
        robot = RmwRobot(node)
        put = robot.publisher("/tf", TF)
        robot.sees("MS/%/%/ippon/%tf/")
        put(payload)
        heard.wait_for(lambda m, payload=payload: (payload, None) in m)
        node.close()
        router.close()


def test_the_robots_router_may_connect_to_the_navigator(sessions, free_endpoint, start, hear):
    heard = hear("tf")
    endpoint = ports.free_endpoint()
    config = zenoh.Config()
    for key, value in {
        "mode": "router",
        "listen/endpoints": [endpoint],
        "connect/endpoints": [free_endpoint],
        "scouting/multicast/enabled": False,
    }.items():
        config.insert_json5(key, json.dumps(value))
    router = zenoh.open(config)
    node = open_client(endpoint)
    try:
        robot = RmwRobot(node)
        put = robot.publisher("/tf", TF)
        received = robot.subscription("/cmd_vel", TWIST)
        start()
        robot.sees("MS/%/%/ippon/%tf/")
        robot.sees("MP/%/%/ippon/%cmd_vel/")
        put(b"by two routers")
        heard.wait_for(lambda m: m == [(b"by two routers", None)])
        sessions[1].declare_publisher("r/cmd_vel").put(twist())
        received.wait_for(len)
    finally:
        node.close()
        router.close()


def test_what_nobody_expected_is_said_and_tried_again(sessions, start, monkeypatch):
    monkeypatch.setattr(robot_link, "DISCOVER_S", 0.05)
    fails = [True]
    follow = Streams.follow

    def fail(streams, entities):
        if fails:
            raise KeyError("a bug")
        return follow(streams, entities)

    monkeypatch.setattr(Streams, "follow", fail)
    link = start()
    wait_for_note(link, "the link to the robot's nodes fails: KeyError('a bug')")
    fails.clear()
    end = time.monotonic() + 20.0
    while any("KeyError" in note for note in link.notes()):
        assert time.monotonic() < end
        time.sleep(0.01)


def test_a_bridge_that_serves_the_robot_already_goes_first(sessions, start):
    robot = RmwRobot(sessions[1])
    robot.publisher("/tf", TF)
    bridge = claim(sessions[1], "r")
    link = start()
    wait_for_note(link, "another bridge serves the robot 'r' already")
    assert not any("/ippon" in token for token in robot.graph)
    bridge.undeclare()
    robot.sees("MS/%/%/ippon/%tf/")


def test_a_bridge_goes_first_whatever_its_clock_says(sessions, monkeypatch):
    bridge = claim(sessions[1], "r")
    monkeypatch.setattr(time, "time_ns", lambda: 10**9)
    with pytest.raises(Ros2Error, match="another bridge serves the robot 'r' already"):
        claim(sessions[1], "r")
    bridge.undeclare()


def test_many_lost_messages_are_said(sessions, start, monkeypatch):
    monkeypatch.setattr(robot_link, "LOSSES_S", 0.2)
    robot = RmwRobot(sessions[1])
    put = robot.publisher("/tf", TF)
    link = start()
    robot.sees("MS/%/%/ippon/%tf/")
    stop = threading.Event()

    def lose():
        while not stop.wait(0.01):
            put(b"one")
            for _ in range(3):
                next(put.numbers)

    thread = threading.Thread(target=lose)
    thread.start()
    try:
        wait_for_note(link, "tf: 75% of its messages are lost on their way")
    finally:
        stop.set()
        thread.join()

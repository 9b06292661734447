"""A node of zenoh-ros2-sdk (Robotis), which its authors use with nodes of rmw_zenoh.

It computes keys, hashes, tokens and attachments by code of its own, and connects as a peer, as
rmw_zenoh does. It is not installed with the tests, because its wheel holds packages named `scripts`
and `messages`: `pip install zenoh-ros2-sdk` runs this.
"""

import time

import pytest

from app.links.network.subscription import subscribe
from app.links.rmw_zenoh import robot_link
from app.links.rmw_zenoh.robot_link import RobotLink
from app.messages.motion import decode_flag, encode_number
from app.ros2.ippon_ros2.settings import read_settings
from tests.app.links.rmw_zenoh.rmw_robot import Received

sdk = pytest.importorskip("zenoh_ros2_sdk")
discovery = pytest.importorskip("zenoh_ros2_sdk.discovery")

BOOL, FLOAT = "std_msgs/msg/Bool", "std_msgs/msg/Float64"
SECTION = {
    "middleware": "rmw_zenoh",
    "domain": 3,
    "contact": "bumper",
    "cmd_tilt": {"topic": "head/tilt", "type": FLOAT},
}


def test_messages_pass_both_ways_and_the_node_sees_ours(sessions, free_endpoint, monkeypatch):
    monkeypatch.setattr(robot_link, "DISCOVER_S", 0.05)
    router, client = sessions
    port = int(free_endpoint.rpartition(":")[2])
    at = {"domain_id": 3, "router_ip": "127.0.0.1", "router_port": port}
    tilts, contacts = Received(), Received()
    bumper = sdk.ROS2Publisher("/bumper", BOOL, msg_definition="bool data\n", **at)
    head = sdk.ROS2Subscriber(
        "/head/tilt",
        FLOAT,
        callback=lambda m: tilts.add(m.data, None),
        msg_definition="float64 data\n",
        **at,
    )
    link = RobotLink(router, "r", read_settings({"ros2": SECTION}))
    try:
        subscribe(client, "r/contact", lambda p: contacts.add(decode_flag(p), None))
        tilt = client.declare_publisher("r/camera/cmd_tilt")
        _until(lambda: bumper.publish(data=True), lambda: contacts.messages)
        _until(lambda: tilt.put(encode_number(-0.25)), lambda: tilts.messages)
        assert contacts.messages[0] == (True, None)
        assert tilts.messages[0] == (-0.25, None)
        info = discovery.get_topic_info("/head/tilt", verbose=True, **at)
        assert [one.node_name for one in info.publishers] == ["ippon"]
        assert info.publishers[0].type_hash == head.type_hash
    finally:
        bumper.close()
        head.close()
        link.close()
        sdk.ZenohSession.get_instance().close()


def _until(act, test, tries=200):
    for _ in range(tries):
        act()
        if test():
            return
        time.sleep(0.05)
    raise AssertionError("nothing came")

import time

import pytest

from app.doctor.robot import ros_graph
from app.doctor.robot.ros_graph import RosGraph, check_graph
from app.links.network.session import LinkError
from app.links.rmw_zenoh.protocol.names import NO_HASH, type_hash
from app.links.rmw_zenoh.protocol.tokens import Entity, Qos
from app.ros2.ippon_ros2.settings import read_settings
from tests.app.links.rmw_zenoh.rmw_robot import RmwRobot

TF, TWIST = "tf2_msgs/msg/TFMessage", "geometry_msgs/msg/Twist"
SECTION = {"middleware": "rmw_zenoh", "domain": 7, "color": "image"}
NODE = Entity(domain=7, session="5a", node_id=0, entity_id=0, kind="NN", node="scout")
OURS = Entity(domain=7, session="5b", node_id=0, entity_id=0, kind="NN", node="ippon")


def settings(section=None, **motion):
    return read_settings({"ros2": {**SECTION, **(section or {})}, "motion": motion})


def entity(kind, topic, message, qos=None, hashed=None, domain=7):
    return Entity(
        domain=domain, session="5a", node_id=0, entity_id=1, kind=kind, node="scout",
        topic=topic, type=message, type_hash=hashed or type_hash(message), qos=qos or Qos(),
    )  # fmt: skip


def by_what(findings):
    return {finding.what.removeprefix("topic "): finding for finding in findings}


def test_a_graph_with_all_topics_is_well():
    entities = [
        NODE,
        OURS,
        entity("MP", "/image", "sensor_msgs/msg/CompressedImage", Qos(reliable=False)),
        entity("MP", "/camera/depth/image_raw", "sensor_msgs/msg/Image"),
        entity("MP", "/camera/color/camera_info", "sensor_msgs/msg/CameraInfo"),
        entity("MP", "/tf", TF, hashed=NO_HASH),
        entity("MP", "/tf_static", TF, Qos(transient_local=True)),
        entity("MS", "/cmd_vel", TWIST),
    ]
    findings = by_what(check_graph(settings(), entities))
    assert {finding.verdict for finding in findings.values()} == {"ok"}
    assert findings["ROS graph"].detail == (
        "domain 7: nodes 2, publishers 5, subscriptions 1; the navigator is one"
    )
    assert findings["color"].detail == (
        "/image: sensor_msgs/msg/CompressedImage, best effort, of /scout"
    )
    assert "without a hash, as with ROS 2 Humble" in findings["tf"].detail


def test_a_camera_whose_pose_is_tracked_has_no_line_for_tf_that_nobody_publishes():
    held = read_settings({"ros2": SECTION, "camera": {"pose": "tracked"}})
    assert {"tf", "tf_static"}.isdisjoint(by_what(check_graph(held, [NODE])))
    assert "tf" in by_what(check_graph(held, [NODE, entity("MP", "/tf", TF)]))


def test_what_does_not_fit_is_named_with_what_to_do():
    entities = [
        NODE,
        entity("MP", "/image", TWIST),
        entity("MP", "/tf", TF, hashed="RIHS01_" + "ab" * 32),
        entity("MP", "/tf_static", TF),
        entity("MP", "/scout/camera_info", "sensor_msgs/msg/CameraInfo"),
        entity("MS", "/cmd_vel", TWIST, Qos(transient_local=True)),
    ]
    findings = by_what(check_graph(settings({"camera_info": "camera_info"}), entities))
    assert findings["ROS graph"].verdict == "warning"
    assert findings["color"].verdict == "failed"
    assert "/image is geometry_msgs/msg/Twist; needed: sensor" in findings["color"].detail
    assert "another definition of tf2_msgs/msg/TFMessage" in findings["tf"].detail
    assert "republish the topic in the usual definition" in findings["tf"].do
    assert findings["camera_info"].verdict == "missing"
    assert "there is /scout/camera_info" in findings["camera_info"].detail
    assert findings["tf_static"].verdict == findings["cmd_vel"].verdict == "warning"
    assert "published volatile" in findings["tf_static"].detail
    assert "subscribed to transient local, but commands" in findings["cmd_vel"].detail


def test_another_domain_is_named():
    elsewhere = entity("MP", "/tf", TF, domain=3)
    (finding,) = check_graph(settings(), [elsewhere, OURS])
    assert finding.detail == "no node in domain 7; there are some in 3"
    assert "write `domain: 3`" in finding.do
    (finding,) = check_graph(settings(), [OURS])
    assert "RMW_IMPLEMENTATION=rmw_zenoh_cpp" in finding.do


@pytest.mark.parametrize(
    ("servers", "verdict"),
    [
        ([], "missing"),
        ([("nav2_msgs/action/NavigateToPose_SendGoal")], "ok"),
        ([("example_interfaces/action/Fibonacci_SendGoal")], "failed"),
    ],
)
def test_an_action_needs_its_server(servers, verdict):
    under = "/navigate_to_pose/_action/send_goal"
    entities = [NODE, *(entity("SS", under, kind, hashed="RIHS01_x") for kind in servers)]
    findings = by_what(check_graph(settings(takes=["goals"]), entities))
    assert findings["navigate"].verdict == verdict


def test_tokens_are_read_from_the_network(sessions):
    robot = RmwRobot(sessions[1], domain=7)
    robot.publisher("/tf", "tf2_msgs::msg::dds_::TFMessage_")
    graph = RosGraph(sessions[0], settings())
    end = time.monotonic() + 20.0
    while by_what(graph.check()).get("tf", graph.check()[0]).verdict != "ok":
        assert time.monotonic() < end
        time.sleep(0.01)
    graph.close()


def test_a_router_that_does_not_answer(sessions, monkeypatch):
    def refuse(endpoint, _):
        raise LinkError(f"no router at {endpoint}")

    monkeypatch.setattr(ros_graph, "open_robot_client", refuse)
    graph = RosGraph(sessions[0], settings({"router": "tcp/scout:7447"}))
    (finding,) = graph.check()
    assert finding.detail == "no router at tcp/scout:7447"
    assert "rmw_zenohd" in finding.do
    graph.close()

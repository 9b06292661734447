import math

import pytest

from app.ros2.ippon_ros2.settings import Ros2Error, read_settings


def test_without_a_section_the_usual_topics_are_carried():
    topics = read_settings({}).topics
    assert {key: topic.name for key, topic in topics.items()} == {
        "color": "/camera/color/image_raw/compressed",
        "depth": "/camera/depth/image_raw",
        "camera_info": "/camera/color/camera_info",
        "tf": "/tf",
        "tf_static": "/tf_static",
        "cmd_vel": "/cmd_vel",
    }


def test_names_get_the_namespace_and_odometry_takes_the_place_of_tf():
    section = {"namespace": "/scout/", "odom": "odom", "depth": {"topic": "/d", "max_hz": 5}}
    settings = read_settings(
        {"ros2": section, "motion": {"max_speed_m_s": 0.5, "max_turn_deg_s": 90}}
    )
    assert settings.topics["color"].name == "/scout/camera/color/image_raw/compressed"
    assert settings.topics["odom"].name == "/scout/odom"
    assert (settings.topics["depth"].name, settings.topics["depth"].max_hz) == ("/d", 5.0)
    assert "tf" not in settings.topics
    assert settings.max_linear_m_s == 0.5
    assert settings.max_yaw_rate_rad_s == pytest.approx(math.pi / 2)


def test_a_camera_whose_pose_is_tracked_needs_no_tf_but_what_its_profile_names():
    held = {"camera": {"pose": "tracked"}}
    optional = [k for k, topic in read_settings(held).topics.items() if topic.is_optional]
    assert optional == ["tf", "tf_static"]
    topics = read_settings({**held, "ros2": {"tf": "/tracker/tf"}}).topics
    assert [key for key, topic in topics.items() if topic.is_optional] == ["tf_static"]
    assert not read_settings({"camera": {"pose": "tf"}}).topics["tf"].is_optional


def test_a_robot_that_takes_goals_has_an_action_or_a_topic_and_no_velocities():
    takes = {"motion": {"takes": ["goals"]}}
    topics = read_settings(takes).topics
    assert topics["navigate"].name == "/navigate_to_pose"
    assert "cmd_vel" not in topics
    topics = read_settings({**takes, "ros2": {"goal": {"topic": "goal_pose", "frame": "odom"}}})
    assert (topics.topics["goal"].name, topics.topics["goal"].frame) == ("/goal_pose", "odom")
    assert "navigate" not in topics.topics
    both = read_settings({"motion": {"takes": ["goals", "velocities"]}}).topics
    assert {"navigate", "cmd_vel"} <= both.keys()


def test_a_robot_without_a_bridge_has_a_domain_and_a_router():
    section = {"middleware": "rmw_zenoh", "domain": 7, "router": "tcp/scout:7447"}
    settings = read_settings({"ros2": {**section, "namespace": "scout"}})
    assert (settings.middleware, settings.domain) == ("rmw_zenoh", 7)
    assert (settings.router, settings.namespace) == ("tcp/scout:7447", "/scout")
    assert settings.topics["cmd_vel"].name == "/scout/cmd_vel"
    usual = read_settings({})
    assert (usual.middleware, usual.router, usual.namespace) == ("bridge", "", "/")


@pytest.mark.parametrize(
    ("section", "takes", "text"),
    [
        ({"goal": "goal_pose"}, ["velocities"], "write `takes: \\[goals\\]` in `motion`"),
        ({"goal": "goal_pose", "navigate": "n"}, ["goals"], "give one of them"),
        ({"cmd_vel": "cmd_vel"}, ["goals"], "needs `takes: \\[goals, velocities\\]`"),
    ],
)
def test_topics_that_contradict_what_the_robot_takes_are_refused(section, takes, text):
    with pytest.raises(Ros2Error, match=text):
        read_settings({"ros2": section, "motion": {"takes": takes}})


@pytest.mark.parametrize(
    ("section", "text"),
    [
        (["color"], "holds entries such as"),
        ({"colour": "x"}, "has 'colour'; it may have namespace, .*, color, depth"),
        ({"color": {"topic": "x", "type": "std_msgs/msg/Bool"}}, "it may be sensor_msgs"),
        ({"color": ""}, "names no topic"),
        ({"middleware": "rmw_zenoh_cpp"}, "is bridge or rmw_zenoh; got 'rmw_zenoh_cpp'"),
        ({"domain": 3}, "are for `middleware: rmw_zenoh`"),
        ({"middleware": "rmw_zenoh", "domain": 233}, "from 0 to 232; got 233"),
        ({"middleware": "rmw_zenoh", "domain": True}, "from 0 to 232; got True"),
        ({"middleware": "rmw_zenoh", "router": "scout"}, "such as tcp/192.168.1.30:7447; got"),
        ({"odom": {}}, "names no topic"),
        ({"depth": {"topic": "x", "rate": 3}}, "takes topic, type, max_hz"),
        ({"depth": {"topic": "x", "max_hz": -1}}, "takes topic, type, max_hz"),
        ({"depth": {"topic": "x", "max_hz": "fast"}}, "takes topic, type, max_hz"),
        ({"depth": {"topic": "x", "max_hz": float("nan")}}, "takes topic, type, max_hz"),
        ({"tf": {"topic": "/tf", "max_hz": 30}}, "takes no max_hz: its messages have no stamp"),
        ({"tf_static": {"max_hz": 1}}, "takes no max_hz"),
        ({"contact": {"topic": "bumper", "max_hz": 1}}, "takes no max_hz"),
        ({"depth": ["x"]}, "is a topic, or {topic: NAME"),
        (
            {"cmd_tilt": {"topic": "x", "type": "trajectory_msgs/msg/JointTrajectory"}},
            "needs `joint`",
        ),
    ],
)
def test_entries_that_make_no_sense_are_refused(section, text):
    with pytest.raises(Ros2Error, match=text):
        read_settings({"ros2": section})


@pytest.mark.parametrize(
    ("motion", "text"),
    [
        ({"max_speed_m_s": -1.0}, "max_speed_m_s` is a number above 0; got -1.0"),
        ({"max_speed_m_s": float("nan")}, "a number above 0; got nan"),
        ({"max_turn_deg_s": "fast"}, "max_turn_deg_s` is a number above 0; got 'fast'"),
        ({"takes": "goals"}, "is a list such as"),
        ([0.5], "`motion` in the profile holds entries"),
    ],
)
def test_limits_that_are_none_are_refused(motion, text):
    """With a limit of -1 m/s, a command of zero velocity was one of 1 m/s."""
    with pytest.raises(Ros2Error, match=text):
        read_settings({"motion": motion})

import json

import pytest

from app.links.rmw_zenoh.protocol.names import (
    NO_HASH,
    dds_type,
    demangled,
    mangled,
    ros_type,
    topic_key,
    type_hash,
)
from app.messages.keys import ROS_TYPES
from app.ros2.ippon_ros2.settings import COMMANDS, STREAMS
from tests.app.links.rmw_zenoh.protocol.published import (
    CHATTER_KEY,
    GENERATED_HASHES,
    PUBLISHED_HASHES,
    STRING_HASH,
)
from tests.locations import ROOT

SHARE = ROOT / ".venv-ros2" / "share"
CARRIED = sorted(
    {kind for _, types in (*STREAMS.values(), *COMMANDS.values()) for kind in types}
    - {"nav2_msgs/action/NavigateToPose"}
)


def test_a_type_is_named_as_dds_names_it_and_back():
    for kind in {*CARRIED, *ROS_TYPES.values()}:
        assert ros_type(dds_type(kind)) == kind
    assert dds_type("sensor_msgs/msg/Image") == "sensor_msgs::msg::dds_::Image_"
    assert ros_type("somebody's own") == "somebody's own"


def test_a_name_without_package_is_no_type():
    with pytest.raises(ValueError, match="PACKAGE/KIND/NAME; got 'Image'"):
        dds_type("Image")


def test_the_published_key_of_a_topic():
    assert topic_key(0, "/chatter", "std_msgs/msg/String", STRING_HASH) == CHATTER_KEY
    humble = topic_key(7, "/scout/odom", "nav_msgs/msg/Odometry", NO_HASH)
    assert humble == "7/scout/odom/nav_msgs::msg::dds_::Odometry_/TypeHashNotSupported"


@pytest.mark.parametrize("name", ["/", "/chatter", "/scout/camera/color", "talker"])
def test_a_mangled_name_has_no_slash_and_comes_back(name):
    assert "/" not in mangled(name)
    assert demangled(mangled(name)) == name


def test_no_namespace_is_a_percent_sign():
    assert mangled("") == mangled("/") == "%"


@pytest.mark.parametrize(("kind", "known"), (PUBLISHED_HASHES | GENERATED_HASHES).items())
def test_hashes_agree_with_published_and_generated_ones(kind, known):
    assert type_hash(kind) == known


def test_the_hash_of_each_carried_type_is_compared_with_one_of_ros_2():
    compared = {*PUBLISHED_HASHES, *GENERATED_HASHES}
    packages = {"std_msgs", "sensor_msgs", "geometry_msgs", "nav_msgs", "trajectory_msgs"}
    assert [k for k in CARRIED if k not in compared and k.split("/")[0] not in packages] == []


@pytest.mark.skipif(not SHARE.is_dir(), reason="needs ROS 2: scripts/setup --ros2")
def test_hashes_agree_with_those_of_ros_2_itself():
    compared = 0
    for kind in {*CARRIED, *ROS_TYPES.values()}:
        described = SHARE / f"{kind}.json"
        if described.is_file():
            hashes = json.loads(described.read_text("utf-8"))["type_hashes"]
            known = {one["type_name"]: one["hash_string"] for one in hashes}
            assert type_hash(kind) == known[kind]
            compared += 1
    assert compared >= 12


def test_keys_agree_with_another_program():
    """pamoja-ros2 assembles keys of rmw_zenoh and reads hashes, by code of its own."""
    ros2 = pytest.importorskip("pamoja.ros2")
    for kind in CARRIED:
        key = topic_key(42, "/scout/camera/color", kind, type_hash(kind))
        assert key == ros2.entity_key(42, "/scout/camera/color", kind, type_hash(kind))
        assert dds_type(kind) == ros2.dds_type_name(kind)
        assert len(ros2.type_hash_digest(type_hash(kind))) == 32
    assert mangled("/scout/camera") == ros2.percent_mangle("/scout/camera")

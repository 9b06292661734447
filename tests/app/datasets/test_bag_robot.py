"""Names of the topics of a bag, by a profile."""

import pytest

from app.datasets.bag_robot import read_bag_robot
from app.errors import UsageError
from app.messages import keys
from app.recording.channels import key_of

ROBOT = """
name: own
body: {radius_m: 0.3, height_m: 1.0, clearance_m: 0.05}
motion: {max_speed_m_s: 0.5, max_turn_deg_s: 40}
camera: {height_m: 1.0, horizontal_fov_deg: 70, width_over_height: 1.6, tilt: 0}
"""
IMAGE, TF = "sensor_msgs/msg/Image", "tf2_msgs/msg/TFMessage"


@pytest.fixture
def names_of(tmp_path):
    def names_of(section):
        (tmp_path / "own.yaml").write_text(f"{ROBOT}ros2: {section}\n")
        return read_bag_robot(str(tmp_path / "own.yaml")).names

    return names_of


def test_topics_that_a_profile_does_not_name_are_known_by_their_ends(names_of):
    names = names_of("{depth: range}")
    assert key_of("/range", IMAGE, {}, names) == keys.DEPTH_RAW
    for prefix in ("", "/scout"):
        # Raw colour, too, though the usual topic of the bridge is the compressed one.
        assert key_of(f"{prefix}/camera/color/image_raw", IMAGE, {}, names) == keys.COLOR_RAW
        assert key_of(f"{prefix}/tf", TF, {}, names) == keys.TF
    assert key_of("/camera/depth/image_raw", IMAGE, {}, names) is None


@pytest.mark.parametrize("name", ["", "/"])
def test_the_name_of_the_base_is_not_empty(name):
    with pytest.raises(UsageError, match="names the frame of the base, such as base_footprint"):
        read_bag_robot(None, name)


def test_a_namespace_chooses_one_of_two_robots(names_of):
    names = names_of("{namespace: /scout}")
    assert key_of("/scout/camera/color/image_raw", IMAGE, {}, names) == keys.COLOR_RAW
    assert key_of("/rover/camera/color/image_raw", IMAGE, {}, names) is None
    assert key_of("/tf", TF, {}, names) == keys.TF
    assert key_of("/rover/tf", TF, {}, names) is None


def test_a_usual_name_that_the_profile_names_is_the_only_one(names_of):
    names = names_of("{tf: /tf}")
    assert key_of("/tf", TF, {}, names) == keys.TF
    assert key_of("/rover/tf", TF, {}, names) is None

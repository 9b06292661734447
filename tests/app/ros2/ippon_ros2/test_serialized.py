import numpy as np
import pytest

from app.messages.motion import StampedTwist, encode_number, encode_twist
from app.messages.navigation import StampedPose, encode_pose
from app.ros2.ippon_ros2.serialized import check_pose, stamp_of, velocity_of
from ippon.geometry import base_pose


@pytest.mark.parametrize("frame_id", ["", "b", "base_link", "a/rather/long/frame"])
def test_velocity_and_stamp_are_read_whatever_the_length_of_the_frame(frame_id):
    payload = encode_twist(
        StampedTwist(stamp_ns=7_250_000_000, linear_m_s=0.3, yaw_rate_rad_s=-0.4), frame_id
    )
    assert velocity_of(payload) == (7.25, 0.3, -0.4)
    assert stamp_of(payload) == 7.25


def test_other_messages_are_refused():
    twist = encode_twist(StampedTwist(stamp_ns=1, linear_m_s=0.3, yaw_rate_rad_s=0.0))
    for payload in (b"", b"\x00\x01", twist[:-1], twist + b"\x00", encode_number(0.3), bytes(5000)):
        with pytest.raises(ValueError, match="not a TwistStamped"):
            velocity_of(payload)
    with pytest.raises(ValueError, match="not finite"):
        velocity_of(twist[:-48] + b"\xff" * 48)
    assert stamp_of(b"\x00\x01\x00\x00") is None


@pytest.mark.parametrize("frame_id", ["", "map", "a/rather/long/frame"])
def test_poses_that_can_be_driven_to_pass(frame_id):
    T = base_pose(1.0, -2.0, 0.1, 2.5)
    check_pose(encode_pose(StampedPose(stamp_ns=7, T_frame_base=T, frame_id=frame_id)))


def test_what_is_no_pose_to_drive_to_is_refused():
    good = encode_pose(StampedPose(stamp_ns=7, T_frame_base=np.eye(4)))
    nan, far = np.array([np.nan]).tobytes(), np.array([2e6]).tobytes()
    for payload, text in (
        (b"", "not a PoseStamped"),
        (good[:-1], "not a PoseStamped"),
        (encode_number(0.3), "not a PoseStamped"),
        (good[:-56] + nan + good[-48:], "not finite"),
        (good[:-56] + far + good[-48:], "beyond 1e"),
        (good[:-8] + bytes(8), "unit quaternion"),
    ):
        with pytest.raises(ValueError, match=text):
            check_pose(payload)

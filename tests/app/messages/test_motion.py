import math

import numpy as np
import pytest

from app.messages.cdr import MessageError, decode, encode, header, make
from app.messages.motion import (
    StampedPath,
    StampedTransform,
    StampedTwist,
    decode_flag,
    decode_number,
    decode_odometry,
    decode_path,
    decode_transforms,
    decode_twist,
    encode_flag,
    encode_number,
    encode_path,
    encode_transforms,
    encode_twist,
    read_transforms,
)
from ippon.geometry import base_pose
from tests.app.messages.robot_messages import odometry


def transform(T, stamp_ns=7):
    return StampedTransform(stamp_ns=stamp_ns, parent="map", child="base_link", T_parent_child=T)


@pytest.mark.parametrize("yaw", np.linspace(-math.pi, math.pi, 9))
def test_transforms_round_trip(yaw):
    T = base_pose(1.0, -2.0, 0.5, yaw)
    (back,) = decode_transforms(encode_transforms([transform(T)]))
    assert (back.stamp_ns, back.parent, back.child) == (7, "map", "base_link")
    np.testing.assert_allclose(back.T_parent_child, T, atol=1e-12)


def test_a_slash_before_a_frame_does_not_count_as_in_tf2():
    slashed = StampedTransform(
        stamp_ns=7, parent="/map", child="/base_link", T_parent_child=np.eye(4)
    )
    (back,) = decode_transforms(encode_transforms([slashed]))
    assert (back.parent, back.child) == ("map", "base_link")


def tf_message(*, rotation=(0.0, 0.0, 0.0, 1.0), translation=(0.0, 0.0, 0.0), count=1):
    xyzw = dict(zip("xyzw", rotation, strict=True))
    xyz = dict(zip("xyz", translation, strict=True))
    entry = make(
        "geometry_msgs/msg/TransformStamped",
        header=header(0, "map"),
        child_frame_id="base_link",
        transform=make(
            "geometry_msgs/msg/Transform",
            translation=make("geometry_msgs/msg/Vector3", **xyz),
            rotation=make("geometry_msgs/msg/Quaternion", **xyzw),
        ),
    )
    return encode("tf2_msgs/msg/TFMessage", transforms=[entry] * count)


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"rotation": (0.0, 0.0, 0.0, 0.0)}, "not a unit quaternion"),
        ({"rotation": (math.nan, 0.0, 0.0, 1.0)}, "not a unit quaternion"),
        ({"translation": (math.nan, 0.0, 0.0)}, "not finite or beyond"),
        ({"translation": (1e30, 0.0, 0.0)}, "not finite or beyond"),
        ({"count": 1001}, "1001 transforms; at most 1000"),
    ],
)
def test_transforms_that_no_tracker_measures_are_refused(changes, text):
    with pytest.raises(MessageError, match=text):
        decode_transforms(tf_message(**changes))


def test_one_transform_without_a_rotation_costs_only_itself():
    both = encode_transforms([transform(np.eye(4)), transform(np.eye(4), stamp_ns=9)])
    damaged = bytearray(both)
    damaged[-8:] = bytes(8)  # w of the last quaternion: none is set
    (read,) = decode_transforms(bytes(damaged))
    assert read.stamp_ns == 7
    (same,), (why,) = read_transforms(bytes(damaged))
    assert same.stamp_ns == 7
    assert "is not a unit quaternion, its norm is 0" in why


def test_twist_round_trip():
    twist = StampedTwist(stamp_ns=9, linear_m_s=0.25, yaw_rate_rad_s=-1.5)
    assert decode_twist(encode_twist(twist)) == twist


def test_a_twist_that_is_not_finite_is_refused():
    twist = StampedTwist(stamp_ns=9, linear_m_s=math.inf, yaw_rate_rad_s=0.0)
    with pytest.raises(MessageError, match="velocities must be finite; got inf m/s"):
        decode_twist(encode_twist(twist))


def test_numbers_and_flags():
    assert decode_number(encode_number(-0.25)) == -0.25
    assert [decode_flag(encode_flag(value)) for value in (True, False)] == [True, False]
    with pytest.raises(MessageError, match="finite number"):
        decode_number(encode_number(math.nan))


def test_path_round_trip_and_headings():
    points = np.array([[0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [1.0, 2.0, 0.0]])
    payload = encode_path(StampedPath(stamp_ns=3, points_world=points))
    np.testing.assert_array_equal(decode_path(payload).points_world, points)
    poses = decode(payload, "nav_msgs/msg/Path").poses
    yaws = [2 * math.atan2(p.pose.orientation.z, p.pose.orientation.w) for p in poses]
    np.testing.assert_allclose(yaws, [math.pi / 4, math.pi / 2, math.pi / 2])


@pytest.mark.parametrize("count", [0, 1])
def test_short_paths(count):
    points = np.ones((count, 3))
    payload = encode_path(StampedPath(stamp_ns=3, points_world=points))
    assert decode_path(payload).points_world.shape == (count, 3)


def test_damaged_bytes_never_do_more_than_a_message_error(survives_damage):
    survives_damage(decode_transforms, encode_transforms([transform(np.eye(4))] * 3))
    twist = StampedTwist(stamp_ns=9, linear_m_s=0.25, yaw_rate_rad_s=-1.5)
    survives_damage(decode_twist, encode_twist(twist))
    path = StampedPath(stamp_ns=3, points_world=np.ones((5, 3)))
    survives_damage(decode_path, encode_path(path))


def test_the_pose_of_odometry():
    pose = decode_odometry(odometry(7, 1.0, -2.0, 0.5))
    assert (pose.stamp_ns, pose.parent, pose.child) == (7, "odom", "base_link")
    np.testing.assert_allclose(pose.T_parent_child, base_pose(1.0, -2.0, 0.0, 0.5), atol=1e-12)
    with pytest.raises(MessageError):
        decode_odometry(odometry(7, math.nan, 0.0, 0.0))
    with pytest.raises(MessageError, match="not a nav_msgs"):
        decode_odometry(b"\x00\x01\x00\x00")

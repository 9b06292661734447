import numpy as np
import pytest

from app.messages.cdr import MessageError, encode, header, make
from app.messages.navigation import (
    StampedPose,
    decode_goal_status,
    decode_pose,
    encode_goal_status,
    encode_pose,
)
from ippon.command import GoalOutcome
from ippon.geometry import base_pose


def test_a_pose_comes_back_as_it_was_sent():
    T = base_pose(1.0, -2.0, 0.1, 0.7)
    stamp_ns = 1_700_000_000_123_456_789
    came = decode_pose(encode_pose(StampedPose(stamp_ns=stamp_ns, T_frame_base=T)))
    assert (came.stamp_ns, came.frame_id) == (stamp_ns, "map")
    np.testing.assert_allclose(came.T_frame_base, T, atol=1e-12)


def test_each_outcome_comes_back_with_the_stamp_of_its_goal():
    for outcome in GoalOutcome:
        assert decode_goal_status(encode_goal_status(5_000_000_007, outcome)) == (
            5_000_000_007,
            outcome,
        )


def test_poses_and_statuses_that_are_none_are_refused():
    with pytest.raises(MessageError, match="not a geometry_msgs/msg/PoseStamped"):
        decode_pose(b"nonsense")
    zero = make("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=0.0, w=0.0)
    point = make("geometry_msgs/msg/Point", x=0.0, y=0.0, z=0.0)
    pose = make("geometry_msgs/msg/Pose", position=point, orientation=zero)
    with pytest.raises(MessageError, match="not a unit quaternion"):
        decode_pose(encode("geometry_msgs/msg/PoseStamped", header=header(0, "map"), pose=pose))
    unknown = encode_goal_status(1, GoalOutcome.REACHED)[:-1] + b"\x09"
    with pytest.raises(MessageError, match="status of a goal: 9"):
        decode_goal_status(unknown)

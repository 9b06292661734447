"""Commands of the navigator in the types that a robot's nodes subscribe to."""

from typing import Final

import numpy as np

from app.messages.cdr import encode, header, make
from app.messages.keys import BASE_FRAME
from app.messages.motion import encode_number
from app.ros2.ippon_ros2.settings import FLOAT, TWIST, TWIST_STAMPED, Topic

TILT_REACH_S: Final = 0.3
"""Time in which a trajectory reaches the camera's tilt."""


def encode_velocity(kind: str, linear_m_s: float, yaw_rate_rad_s: float, stamp_ns: int) -> bytes:
    """Write a Twist or TwistStamped.

    Args:
        kind: ROS 2 type.
        linear_m_s: Forward.
        yaw_rate_rad_s: Turn, positive to the left.
        stamp_ns: By the robot's clock; a Twist has none.
    """
    twist = {"linear": _vector(linear_m_s, 0.0), "angular": _vector(0.0, yaw_rate_rad_s)}
    if kind == TWIST:
        return encode(TWIST, **twist)
    return encode(TWIST_STAMPED, header=header(stamp_ns, BASE_FRAME), twist=make(TWIST, **twist))


def encode_tilt(kind: str, tilt_rad: float, topic: Topic) -> bytes:
    """Write a Float64, or a JointTrajectory of one point.

    Args:
        kind: ROS 2 type.
        tilt_rad: Above the horizon.
        topic: Names joint and sign of a trajectory, which is to begin at once (stamp 0).
    """
    if kind == FLOAT:
        return encode_number(tilt_rad)
    none = np.zeros(0)
    point = make(
        "trajectory_msgs/msg/JointTrajectoryPoint",
        positions=np.array([topic.sign * tilt_rad]),
        velocities=none,
        accelerations=none,
        effort=none,
        time_from_start=make(
            "builtin_interfaces/msg/Duration", sec=0, nanosec=int(1e9 * TILT_REACH_S)
        ),
    )
    return encode(kind, header=header(0, ""), joint_names=[topic.joint], points=[point])


def _vector(x: float, z: float) -> object:
    return make("geometry_msgs/msg/Vector3", x=x, y=0.0, z=z)

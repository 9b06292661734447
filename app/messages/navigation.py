"""Goals of a robot that navigates by itself, and what it says about them, as ROS 2 messages."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from app.messages.cdr import MessageError, decode, encode, header, make, stamp_ns_of
from app.messages.keys import WORLD_FRAME
from app.messages.motion import check_positions
from ippon.command import GoalOutcome
from ippon.geometry import (
    Float64Array,
    make_transform,
    quaternion_from_rotation,
    rotation_from_quaternion,
)

STATUSES: Final = {
    1: GoalOutcome.ACCEPTED,
    2: GoalOutcome.ACCEPTED,
    4: GoalOutcome.REACHED,
    5: GoalOutcome.CANCELLED,
    6: GoalOutcome.FAILED,
}
"""Outcome of each status of an action_msgs/GoalStatus."""
_SMALL: Final = 2**16
_NS: Final = 1_000_000_000


@dataclass(frozen=True, slots=True, kw_only=True)
class StampedPose:
    """Pose of the base in a frame, with its stamp."""

    stamp_ns: int
    T_frame_base: Float64Array
    """(4, 4)."""
    frame_id: str = WORLD_FRAME


def encode_pose(pose: StampedPose) -> bytes:
    """Write a PoseStamped."""
    x, y, z = pose.T_frame_base[:3, 3].tolist()
    w, i, j, k = quaternion_from_rotation(pose.T_frame_base[:3, :3]).tolist()
    return encode(
        "geometry_msgs/msg/PoseStamped",
        header=header(pose.stamp_ns, pose.frame_id),
        pose=make(
            "geometry_msgs/msg/Pose",
            position=make("geometry_msgs/msg/Point", x=x, y=y, z=z),
            orientation=make("geometry_msgs/msg/Quaternion", x=i, y=j, z=k, w=w),
        ),
    )


def decode_pose(payload: bytes) -> StampedPose:
    """Read a PoseStamped.

    Raises:
        MessageError: Not such a message, or a pose that is no rigid transform.
    """
    message = decode(payload, "geometry_msgs/msg/PoseStamped", max_bytes=_SMALL)
    p, q = message.pose.position, message.pose.orientation
    at = np.array([p.x, p.y, p.z])
    check_positions(at, "pose")
    wxyz = (q.w, q.x, q.y, q.z)
    if not abs(math.hypot(*wxyz) - 1.0) < 0.01:
        raise MessageError("pose: rotation is not a unit quaternion")
    return StampedPose(
        stamp_ns=stamp_ns_of(message.header),
        T_frame_base=make_transform(rotation_from_quaternion(wxyz), at),
        frame_id=message.header.frame_id,
    )


def encode_goal_status(goal_stamp_ns: int, outcome: GoalOutcome) -> bytes:
    """Write a GoalStatus about the goal with a stamp."""
    seconds, nanoseconds = divmod(goal_stamp_ns, _NS)
    return encode(
        "action_msgs/msg/GoalStatus",
        goal_info=make(
            "action_msgs/msg/GoalInfo",
            goal_id=make("unique_identifier_msgs/msg/UUID", uuid=np.zeros(16, np.uint8)),
            stamp=make("builtin_interfaces/msg/Time", sec=seconds, nanosec=nanoseconds),
        ),
        status=next(number for number, known in STATUSES.items() if known is outcome),
    )


def decode_goal_status(payload: bytes) -> tuple[int, GoalOutcome]:
    """Read a GoalStatus.

    Returns:
        Stamp of the goal, nanoseconds, and what became of it.

    Raises:
        MessageError: Not such a message, or a status that says nothing of these.
    """
    message = decode(payload, "action_msgs/msg/GoalStatus", max_bytes=_SMALL)
    outcome = STATUSES.get(message.status)
    if outcome is None:
        raise MessageError(f"status of a goal: {message.status}; {list(STATUSES)} are understood")
    stamp = message.goal_info.stamp
    return stamp.sec * _NS + stamp.nanosec, outcome

"""Transforms, commands, contact and paths as ROS 2 messages."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from app.messages.cdr import MessageError, decode, encode, header, make, stamp_ns_of
from app.messages.keys import BASE_FRAME, CAMERA_FRAME, WORLD_FRAME, frame_name
from ippon.geometry import (
    Float64Array,
    make_transform,
    quaternion_from_rotation,
    rotation_from_quaternion,
)

MAX_TRANSFORMS: Final = 1000
MAX_PATH_POSES: Final = 10_000
_SMALL: Final = 2**16
_FAR_M: Final = 1e6


@dataclass(frozen=True, slots=True, kw_only=True)
class StampedTransform:
    """Pose of the child frame in the parent frame at one moment."""

    stamp_ns: int
    parent: str
    child: str
    T_parent_child: Float64Array


def timed_link(
    frame: str,
    moving: Mapping[str, StampedTransform],
    fixed: Mapping[str, StampedTransform],
) -> StampedTransform | None:
    """Return the transform that tells the time of a frame's pose, None without any.

    It is the moving one next to the frame, or that of the frame itself if none moves.

    Args:
        frame: The frame.
        moving: Moving transforms by their child.
        fixed: Fixed ones, the time of which says nothing.
    """
    at: str | None = frame
    for _ in range(1 + len(fixed)):
        if at is None or at in moving:
            break
        at = fixed[at].parent if at in fixed else None
    return fixed.get(frame) if at is None else moving.get(at)


def robot_transforms(
    stamp_ns: int,
    T_world_base: Float64Array,
    T_base_camera: Float64Array,
    camera_frame: str = CAMERA_FRAME,
) -> tuple[StampedTransform, ...]:
    """Return tf of a robot at one moment: from the world by the base to the camera."""
    links = ((WORLD_FRAME, BASE_FRAME, T_world_base), (BASE_FRAME, camera_frame, T_base_camera))
    return tuple(
        StampedTransform(stamp_ns=stamp_ns, parent=a, child=b, T_parent_child=T)
        for a, b, T in links
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class StampedTwist:
    """Velocities in the base frame with their stamp."""

    stamp_ns: int
    linear_m_s: float
    yaw_rate_rad_s: float
    tilt_rate_rad_s: float = 0.0
    """Positive tilts the camera up; sent negated, as a rotation about the base's y axis (left)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StampedPath:
    """A path on the floor."""

    stamp_ns: int
    points_world: Float64Array
    """(K, 3) metres."""


def encode_transforms(transforms: Iterable[StampedTransform]) -> bytes:
    """Write a TFMessage."""
    return encode("tf2_msgs/msg/TFMessage", transforms=[_transform_message(t) for t in transforms])


def decode_transforms(payload: bytes) -> tuple[StampedTransform, ...]:
    """Read a TFMessage; without entries that are no rigid transform, as tf2 does, if others are.

    Raises:
        MessageError: Not such a message, too many entries, or none that is a rigid transform.
    """
    read, refused = read_transforms(payload)
    if refused and not read:
        raise MessageError(refused[0])
    return read


def read_transforms(payload: bytes) -> tuple[tuple[StampedTransform, ...], tuple[str, ...]]:
    """Read a TFMessage; return its rigid transforms, and what is wrong with each of the others.

    Raises:
        MessageError: Not such a message, or too many entries.
    """
    message = decode(payload, "tf2_msgs/msg/TFMessage", max_bytes=2**20)
    if len(message.transforms) > MAX_TRANSFORMS:
        raise MessageError(
            f"tf of {len(message.transforms)} transforms; at most {MAX_TRANSFORMS} are accepted"
        )
    read: list[StampedTransform] = []
    refused: list[str] = []
    for entry in message.transforms:
        try:
            read.append(_read_transform(entry))
        except MessageError as error:
            refused.append(str(error))
    return tuple(read), tuple(refused)


def decode_odometry(payload: bytes) -> StampedTransform:
    """Read the pose of a nav_msgs/Odometry: of its child frame in the frame of its header.

    Raises:
        MessageError: Not such a message, or a pose that is no rigid transform.
    """
    message = decode(payload, "nav_msgs/msg/Odometry", max_bytes=_SMALL)
    pose = message.pose.pose
    entry = make(
        "geometry_msgs/msg/TransformStamped",
        header=message.header,
        child_frame_id=message.child_frame_id,
        transform=make(
            "geometry_msgs/msg/Transform",
            translation=make(
                "geometry_msgs/msg/Vector3", x=pose.position.x, y=pose.position.y, z=pose.position.z
            ),
            rotation=pose.orientation,
        ),
    )
    return _read_transform(entry)


def encode_twist(twist: StampedTwist, frame_id: str = BASE_FRAME) -> bytes:
    """Write a TwistStamped."""
    return encode(
        "geometry_msgs/msg/TwistStamped",
        header=header(twist.stamp_ns, frame_id),
        twist=make(
            "geometry_msgs/msg/Twist",
            linear=_vector(twist.linear_m_s, 0.0, 0.0),
            angular=_vector(0.0, -twist.tilt_rate_rad_s, twist.yaw_rate_rad_s),
        ),
    )


def decode_twist(payload: bytes) -> StampedTwist:
    """Read a TwistStamped for a base that drives forward and turns.

    Raises:
        MessageError: Not such a message, or velocities that are not finite.
    """
    message = decode(payload, "geometry_msgs/msg/TwistStamped", max_bytes=_SMALL)
    linear, yaw_rate = message.twist.linear.x, message.twist.angular.z
    tilt_rate = -message.twist.angular.y
    if not all(math.isfinite(value) for value in (linear, yaw_rate, tilt_rate)):
        raise MessageError(
            f"velocities must be finite; got {linear} m/s, {yaw_rate} and {tilt_rate} rad/s"
        )
    return StampedTwist(
        stamp_ns=stamp_ns_of(message.header),
        linear_m_s=linear,
        yaw_rate_rad_s=yaw_rate,
        tilt_rate_rad_s=tilt_rate,
    )


def encode_number(value: float) -> bytes:
    """Write a Float64."""
    return encode("std_msgs/msg/Float64", data=float(value))


def decode_number(payload: bytes) -> float:
    """Read a Float64.

    Raises:
        MessageError: Not such a message, or not a finite number.
    """
    value = decode(payload, "std_msgs/msg/Float64", max_bytes=_SMALL).data
    if not math.isfinite(value):
        raise MessageError(f"a finite number was expected; got {value}")
    return value


def encode_flag(value: bool) -> bytes:
    """Write a Bool."""
    return encode("std_msgs/msg/Bool", data=bool(value))


def decode_flag(payload: bytes) -> bool:
    """Read a Bool.

    Raises:
        MessageError: Not such a message.
    """
    return bool(decode(payload, "std_msgs/msg/Bool", max_bytes=_SMALL).data)


def encode_path(path: StampedPath, frame_id: str = WORLD_FRAME) -> bytes:
    """Write a nav_msgs/Path; every pose looks along the path."""
    points = path.points_world
    ahead = np.diff(points, axis=0, append=points[-1:]) if len(points) else points
    yaws = np.arctan2(ahead[:, 1], ahead[:, 0])
    if len(yaws) > 1:
        yaws[-1] = yaws[-2]
    top = header(path.stamp_ns, frame_id)
    poses = [
        make(
            "geometry_msgs/msg/PoseStamped",
            header=top,
            pose=make(
                "geometry_msgs/msg/Pose",
                position=make("geometry_msgs/msg/Point", x=p[0], y=p[1], z=p[2]),
                orientation=_quaternion(math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2)),
            ),
        )
        for p, yaw in zip(points.tolist(), yaws.tolist(), strict=True)
    ]
    return encode("nav_msgs/msg/Path", header=top, poses=poses)


def decode_path(payload: bytes) -> StampedPath:
    """Read the positions of a nav_msgs/Path.

    Raises:
        MessageError: Not such a message, too long, or positions that are not finite.
    """
    message = decode(payload, "nav_msgs/msg/Path", max_bytes=4 * 2**20)
    if len(message.poses) > MAX_PATH_POSES:
        raise MessageError(f"a path has at most {MAX_PATH_POSES} poses; got {len(message.poses)}")
    positions = [pose.pose.position for pose in message.poses]
    points = np.array([(p.x, p.y, p.z) for p in positions], dtype=np.float64).reshape(-1, 3)
    check_positions(points, "path")
    return StampedPath(stamp_ns=stamp_ns_of(message.header), points_world=points)


def check_positions(points: NDArray[Any], what: str) -> None:
    """Refuse positions that are not finite or too far away.

    Raises:
        MessageError: There is such a position.
    """
    if points.size and not bool((np.abs(points) < _FAR_M).all()):
        raise MessageError(f"{what} holds positions that are not finite or beyond {_FAR_M:g} m")


def _vector(x: float, y: float, z: float) -> Any:
    return make("geometry_msgs/msg/Vector3", x=float(x), y=float(y), z=float(z))


def _quaternion(w: float, x: float, y: float, z: float) -> Any:
    return make("geometry_msgs/msg/Quaternion", x=float(x), y=float(y), z=float(z), w=float(w))


def _transform_message(transform: StampedTransform) -> Any:
    wxyz = quaternion_from_rotation(transform.T_parent_child[:3, :3])
    return make(
        "geometry_msgs/msg/TransformStamped",
        header=header(transform.stamp_ns, transform.parent),
        child_frame_id=transform.child,
        transform=make(
            "geometry_msgs/msg/Transform",
            translation=_vector(*transform.T_parent_child[:3, 3].tolist()),
            rotation=_quaternion(*wxyz.tolist()),
        ),
    )


def _read_transform(entry: Any) -> StampedTransform:
    t, q = entry.transform.translation, entry.transform.rotation
    name = f"tf {entry.header.frame_id[:40]!r} -> {entry.child_frame_id[:40]!r}"
    translation = np.array([t.x, t.y, t.z])
    check_positions(translation, name)
    wxyz = (q.w, q.x, q.y, q.z)
    if not abs(math.hypot(*wxyz) - 1.0) < 0.01:
        raise MessageError(
            f"{name}: rotation is not a unit quaternion, its norm is {math.hypot(*wxyz):.3g}"
        )
    return StampedTransform(
        stamp_ns=stamp_ns_of(entry.header),
        parent=frame_name(entry.header.frame_id),
        child=frame_name(entry.child_frame_id),
        T_parent_child=make_transform(rotation_from_quaternion(wxyz), translation),
    )

"""Rigid transforms, angles and quaternions.

`T_target_source` maps coordinates of the source frame to the target frame, so that neighbours
cancel: `T_world_camera = T_world_base @ T_base_camera`. Quaternions are wxyz.
"""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

Float64Array = NDArray[np.float64]

# Camera axes (x right, y down, z forward) seen from the base axes (x forward, y left, z up).
R_BASE_CAMERA_LEVEL: Float64Array = np.array(
    [[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]], dtype=np.float64
)


def wrap_angle(angle: float) -> float:
    """Return the same direction in [-pi, pi)."""
    return (angle + math.pi) % (2.0 * math.pi) - math.pi


def make_transform(rotation: ArrayLike, translation: ArrayLike) -> Float64Array:
    """Compose a (4, 4) transform from a (3, 3) rotation and a (3,) translation in metres."""
    transform = np.eye(4, dtype=np.float64)
    transform[:3, :3] = rotation
    transform[:3, 3] = translation
    return transform


def invert_transform(transform: Float64Array) -> Float64Array:
    """Invert a (4, 4) rigid transform."""
    rotation_t = transform[:3, :3].T
    return make_transform(rotation_t, -rotation_t @ transform[:3, 3])


def rotation_z(yaw: float) -> Float64Array:
    """Return the (3, 3) rotation by `yaw` radians about z, counter-clockwise from above."""
    c, s = math.cos(yaw), math.sin(yaw)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]], dtype=np.float64)


def rotation_y(angle: float) -> Float64Array:
    """Return the (3, 3) rotation by `angle` radians about y."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]], dtype=np.float64)


def base_pose(x: float, y: float, z: float, yaw: float) -> Float64Array:
    """Return T_world_base of a robot upright at (x, y, z) metres, heading `yaw` radians."""
    return make_transform(rotation_z(yaw), (x, y, z))


def yaw_of(T_world_base: Float64Array) -> float:
    """Return the heading of a pose in radians, counter-clockwise from the world's +x."""
    return math.atan2(T_world_base[1, 0], T_world_base[0, 0])


def views_differ(one: Float64Array, other: Float64Array, by_m: float, by_rad: float) -> bool:
    """Return whether two cameras, (4, 4) poses, stand farther apart or look farther aside."""
    if np.linalg.norm(one[:3, 3] - other[:3, 3]) > by_m:
        return True
    return math.acos(max(-1.0, min(1.0, float(one[:3, 2] @ other[:3, 2])))) > by_rad


def transform_points(transform: Float64Array, points: Float64Array) -> Float64Array:
    """Map (N, 3) points of the source frame to (N, 3) points of the target frame."""
    return points @ transform[:3, :3].T + transform[:3, 3]


def is_rigid(transform: Float64Array, tolerance: float = 1e-3) -> bool:
    """Tell whether a (4, 4) array is finite and its rotation is orthonormal and right-handed."""
    if transform.shape != (4, 4) or not np.isfinite(transform).all():
        return False
    rotation = transform[:3, :3]
    orthonormal = np.abs(rotation @ rotation.T - np.eye(3)).max() < tolerance
    return bool(
        orthonormal
        and np.linalg.det(rotation) > 0.0
        and np.abs(transform[3] - (0.0, 0.0, 0.0, 1.0)).max() < tolerance
    )


def quaternion_from_rotation(rotation: Float64Array) -> Float64Array:
    """Return the unit quaternion (4,) wxyz, w >= 0, of a (3, 3) rotation (Shepperd's method)."""
    trace = float(np.trace(rotation))
    diagonal = np.diag(rotation)
    k = int(np.argmax([trace, *diagonal]))
    q = np.empty(4, dtype=np.float64)
    if k == 0:
        q[0] = 1.0 + trace
        q[1] = rotation[2, 1] - rotation[1, 2]
        q[2] = rotation[0, 2] - rotation[2, 0]
        q[3] = rotation[1, 0] - rotation[0, 1]
    else:
        i = k - 1
        j, m = (i + 1) % 3, (i + 2) % 3
        q[0] = rotation[m, j] - rotation[j, m]
        q[1 + i] = 1.0 + 2.0 * rotation[i, i] - trace
        q[1 + j] = rotation[j, i] + rotation[i, j]
        q[1 + m] = rotation[m, i] + rotation[i, m]
    q /= np.linalg.norm(q)
    return q if q[0] >= 0.0 else -q


def rotation_from_quaternion(wxyz: ArrayLike) -> Float64Array:
    """Return the (3, 3) rotation of a quaternion wxyz of any non-zero norm.

    Raises:
        ValueError: The quaternion is zero or not finite.
    """
    q = np.asarray(wxyz, dtype=np.float64)
    norm = float(np.linalg.norm(q))
    if q.shape != (4,) or not math.isfinite(norm) or norm < 1e-9:
        raise ValueError(f"a quaternion needs four finite numbers that are not all zero; got {q}")
    w, x, y, z = q / norm
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ],
        dtype=np.float64,
    )

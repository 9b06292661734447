"""Where the robot will drive and when it will be stopped, as lines in the world."""

import math
from typing import Final

import numpy as np

from ippon.geometry import Float64Array, yaw_of

AHEAD_S: Final = 2.5
"""Time over which the present command is continued."""
AHEAD_M: Final = 4.0
"""Length of the planned path that is shown."""
STANDING_M: Final = 1.2
"""Length of the straight way of a robot that stands."""
_STEP_M: Final = 0.1
_ARC_RAD: Final = math.radians(40.0)


def commanded_way(
    T_world_base: Float64Array, linear_m_s: float, yaw_rate_rad_s: float
) -> Float64Array:
    """Return (N, 3) points of the arc that a command drives; straight if the robot stands."""
    if abs(linear_m_s) < 0.02:
        linear_m_s, yaw_rate_rad_s = STANDING_M / AHEAD_S, 0.0
    t = np.linspace(0.0, AHEAD_S, max(8, math.ceil(abs(linear_m_s) * AHEAD_S / _STEP_M)))
    half = 0.5 * yaw_rate_rad_s * t
    # The chord of an arc points to its middle heading.
    chord = linear_m_s * t * np.sinc(half / math.pi)
    heading = yaw_of(T_world_base) + half
    x, y, z = T_world_base[:3, 3]
    return np.column_stack(
        [x + chord * np.cos(heading), y + chord * np.sin(heading), np.full(len(t), z)]
    )


def planned_way(path_world: Float64Array, T_world_base: Float64Array) -> Float64Array:
    """Return (N, 3) points of a path from the robot on, `AHEAD_M` long and evenly spaced."""
    if len(path_world) < 2:
        return np.empty((0, 3))
    base = T_world_base[:3, 3]
    nearest = int(np.argmin(np.linalg.norm(path_world[:, :2] - base[:2], axis=1)))
    corners = np.vstack([base, path_world[nearest + 1 :]])
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1))])
    length = min(float(along[-1]), AHEAD_M)
    if length < _STEP_M:
        return np.empty((0, 3))
    at = np.linspace(0.0, length, math.ceil(length / _STEP_M) + 1)
    return np.column_stack([np.interp(at, along, corners[:, axis]) for axis in range(3)])


def edges_of(way: Float64Array, half_width_m: float) -> tuple[Float64Array, Float64Array]:
    """Return the left and right edges, (N, 3) each, of a way as wide as the body."""
    steps = np.gradient(way[:, :2], axis=0)
    length = np.maximum(np.linalg.norm(steps, axis=1), 1e-9)
    side = np.column_stack([-steps[:, 1], steps[:, 0]]) / length[:, None] * half_width_m
    left, right = way.copy(), way.copy()
    left[:, :2] += side
    right[:, :2] -= side
    return left, right


def limit_ahead(T_world_base: Float64Array, distance_m: float) -> Float64Array:
    """Return (N, 3) points of an arc on the floor at a distance ahead of the robot."""
    angle = yaw_of(T_world_base) + np.linspace(-_ARC_RAD, _ARC_RAD, 17)
    x, y, z = T_world_base[:3, 3]
    return np.column_stack(
        [x + distance_m * np.cos(angle), y + distance_m * np.sin(angle), np.full(17, z)]
    )

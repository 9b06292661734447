"""Points and poses along a path, and the rest of a path for a robot near it."""

import math
from itertools import pairwise

import numpy as np

from ippon.geometry import Float64Array


def point_along(path: Float64Array, distance: float) -> Float64Array:
    """Return the point `distance` metres along a (K, 2) path, its end beyond that."""
    for a, b in pairwise(path):
        length = float(np.linalg.norm(b - a))
        if distance <= length and length > 0.0:
            return a + distance / length * (b - a)
        distance -= length
    return path[-1]


def poses_along(path: Float64Array, distances: Float64Array) -> Float64Array:
    """Return the (N, 3) x, y and yaw at (N,) distances along a (K, 2) path."""
    points = np.array([point_along(path, distance) for distance in distances])
    steps = np.diff(path, axis=0)
    length = np.hypot(steps[:, 0], steps[:, 1])
    steps, ends = steps[length > 0.0], np.cumsum(length[length > 0.0])
    if not len(steps):
        return np.column_stack([points, np.zeros(len(points))])
    piece = np.minimum(np.searchsorted(ends, distances), len(steps) - 1)
    return np.column_stack([points, np.arctan2(steps[piece, 1], steps[piece, 0])])


def remaining_path(path: Float64Array, x: float, y: float) -> Float64Array:
    """Return the rest of a (K, 2) path for a robot at (x, y) near it, the robot first."""
    at, _ = _beside(path, x, y)
    return np.vstack([(x, y), path[at + 1 :]])


def rejoined_path(path: Float64Array, x: float, y: float, ahead_m: float) -> Float64Array:
    """Return the rest of a (K, 2) path for a robot that rejoins it `ahead_m` farther on.

    In a narrow passage the straight line from beside the path to its next corner may collide where
    the path itself is free.
    """
    at, beside = _beside(path, x, y)
    rest = np.vstack([beside, path[at + 1 :]])
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(rest, axis=0), axis=1))])
    later = int(np.searchsorted(along, ahead_m, side="right"))
    if later == len(rest):
        return np.vstack([(x, y), path[-1]])
    share = (ahead_m - along[later - 1]) / (along[later] - along[later - 1])
    back = rest[later - 1] + share * (rest[later] - rest[later - 1])
    return np.vstack([(x, y), back, rest[later:]])


def _beside(path: Float64Array, x: float, y: float) -> tuple[int, Float64Array]:
    """Return the segment of a path nearest to the robot, and the nearest point on it."""
    here = np.array([x, y])
    best, at, point = math.inf, len(path) - 2, path[-1]
    for n in range(len(path) - 1):
        step = path[n + 1] - path[n]
        length2 = float(step @ step)
        t = 0.0 if length2 == 0.0 else float(np.clip((here - path[n]) @ step / length2, 0.0, 1.0))
        distance = float(np.linalg.norm(path[n] + t * step - here))
        # On a tie the later segment: the robot has passed the corner.
        if distance <= best + 1e-9:
            best, at, point = distance, n, path[n] + t * step
    return at, point

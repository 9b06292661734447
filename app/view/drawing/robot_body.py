"""Mesh of a robot's body: an upright capsule for each column of its spheres."""

import math
from collections.abc import Iterable
from typing import Final

import numpy as np
from numpy.typing import NDArray

from app.messages.body import BodySphere

_AROUND: Final = 20
_RINGS: Final = 5
"""Of each half sphere, its pole and its equator included."""


def body_mesh(spheres: Iterable[BodySphere]) -> tuple[NDArray[np.float32], NDArray[np.uint32]]:
    """Return vertices (N, 3) in the base frame, metres, and triangles (M, 3) of a body.

    Spheres of one radius above each other are the ends of one capsule, as in an upright body.
    """
    columns: dict[tuple[float, float, float], list[float]] = {}
    for one in spheres:
        columns.setdefault((one.x_m, one.y_m, one.radius_m), []).append(one.z_m)
    unit, faces = _unit_capsule()
    is_top = np.arange(len(unit)) >= len(unit) // 2
    vertices: list[NDArray[np.float32]] = []
    triangles: list[NDArray[np.uint32]] = []
    for n, ((x, y, radius), heights) in enumerate(columns.items()):
        z = np.where(is_top, max(heights), min(heights))
        vertices.append((unit * radius + np.stack([z * 0 + x, z * 0 + y, z], 1)).astype(np.float32))
        triangles.append(faces + np.uint32(n * len(unit)))
    return np.concatenate(vertices), np.concatenate(triangles)


def _unit_capsule() -> tuple[NDArray[np.float64], NDArray[np.uint32]]:
    """Return a sphere with two equators: the lower half first, then the upper one."""
    lower = np.linspace(-0.5 * math.pi, 0.0, _RINGS)
    latitudes = np.concatenate([lower, -lower[::-1]])
    longitudes = np.arange(_AROUND) * (2.0 * math.pi / _AROUND)
    around = np.stack([np.cos(longitudes), np.sin(longitudes)], axis=1)
    rings = [np.column_stack([math.cos(at) * around, np.full(_AROUND, math.sin(at))])
             for at in latitudes]  # fmt: skip
    n = np.arange(_AROUND)
    after = (n + 1) % _AROUND
    faces: list[NDArray[np.int64]] = []
    for ring in range(len(latitudes) - 1):
        low, high = ring * _AROUND, (ring + 1) * _AROUND
        faces.append(np.stack([low + n, low + after, high + after], axis=1))
        faces.append(np.stack([low + n, high + after, high + n], axis=1))
    return np.concatenate(rings), np.concatenate(faces).astype(np.uint32)

"""Rays through points of the view, and the floor region of a rectangle dragged over it."""

import math
from typing import Any, Final

import numpy as np

from app.view.model.picking import floor_point
from ippon.geometry import Float64Array, rotation_from_quaternion

_DABS: Final = 360
"""Approximate number of strokes; a request may hold 500."""
_FINEST_M: Final = 0.15
_OVERLAP: Final = 0.75
"""Radius of a dab over the distance to the next; more than half a diagonal leaves no gaps."""


def floor_region(
    camera: Any, low: tuple[float, float], high: tuple[float, float], floor_z_m: float
) -> Float64Array:
    """Return the (4, 2) corners on the floor of a rectangle in the view, in order.

    Args:
        camera: Camera of the browser: `position`, `wxyz`, vertical `fov` in radians and `aspect`.
        low: Upper left corner as shares of the view's size, column and row.
        high: Lower right corner.
        floor_z_m: Height of the floor.

    Raises:
        ValueError: A corner does not lie on the floor.
    """
    corners = (low, (high[0], low[1]), high, (low[0], high[1]))
    rays = [view_ray(camera, u, v) for u, v in corners]
    return np.array([floor_point(eye, ray, floor_z_m)[:2] for eye, ray in rays])


def view_ray(camera: Any, u: float, v: float) -> tuple[Float64Array, Float64Array]:
    """Return origin and direction, (3,) each, of the ray through a point of the view.

    Args:
        camera: As for `floor_region`.
        u: Column as a share of the view's width.
        v: Row as a share of its height.
    """
    half = math.tan(0.5 * float(camera.fov))
    rotation = rotation_from_quaternion(np.array(camera.wxyz, dtype=np.float64))
    eye = np.array(camera.position, dtype=np.float64)
    ahead = np.array([(2 * u - 1) * half * float(camera.aspect), (2 * v - 1) * half, 1.0])
    return eye, rotation @ ahead


def brush_strokes(corners: Float64Array) -> tuple[list[tuple[float, float]], float]:
    """Return centres and radius in metres of dabs that cover a convex region."""
    following = np.roll(corners, -1, axis=0)
    sides = following - corners
    (x0, y0), (x1, y1) = corners.T, following.T
    area = 0.5 * float((x0 * y1 - x1 * y0).sum())
    step = max(_FINEST_M, math.sqrt(abs(area) / _DABS))
    low, high = corners.min(axis=0), corners.max(axis=0)
    x, y = (np.arange(a + 0.5 * step, b, step) for a, b in zip(low, high, strict=True))
    grid = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    offset = grid[:, None] - corners[None]
    left = sides[:, 0] * offset[..., 1] - sides[:, 1] * offset[..., 0]
    inside = grid[(left * math.copysign(1.0, area) >= 0.0).all(axis=1)]
    if not len(inside):
        inside = corners.mean(axis=0)[None]
    return [(float(a), float(b)) for a, b in inside], _OVERLAP * step

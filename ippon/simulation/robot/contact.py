"""Contact of the robot's body with the home: exact distances from its spheres to the triangles."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ippon.compiling import njit
from ippon.geometry import Float64Array
from ippon.robot import CollisionSphere
from ippon.simulation.scene import Scene

Int64Array = NDArray[np.int64]

_CELL_M = 0.25


class Penetration(NamedTuple):
    """Depth of the body in an obstacle, and the horizontal direction out of it."""

    depth_m: float
    """Metres; 0 without contact."""
    normal_x: float
    normal_y: float
    """Unit direction out of the deepest obstacle; (0, 0) if no horizontal direction leads out."""


class BodyContacts:
    """Contact queries for a body of spheres at a fixed height above the floor.

    Triangles are stored in a grid of columns, so that a query reads only those around the body.
    """

    def __init__(
        self, scene: Scene, spheres: tuple[CollisionSphere, ...], floor_z_m: float
    ) -> None:
        self._spheres = np.array(
            [(s.x_m, s.y_m, s.z_m + floor_z_m, s.radius_m) for s in spheres], dtype=np.float64
        )
        self._reach_m = max(math.hypot(s.x_m, s.y_m) + s.radius_m for s in spheres)
        bottom = float((self._spheres[:, 2] - self._spheres[:, 3]).min())
        top = float((self._spheres[:, 2] + self._spheres[:, 3]).max())
        corners = scene.vertices[scene.faces].astype(np.float64)
        z_min, z_max = corners[..., 2].min(axis=1), corners[..., 2].max(axis=1)
        self._triangles = np.ascontiguousarray(corners[(z_max > bottom) & (z_min < top)])
        self._origin, self._starts, self._members = _grid(self._triangles)

    def deepest(self, x: float, y: float, yaw: float) -> Penetration:
        """Return the deepest penetration of the body standing at (x, y), heading `yaw`."""
        depth, nx, ny = _deepest_kernel(
            x,
            y,
            yaw,
            self._reach_m,
            self._spheres,
            self._triangles,
            self._origin,
            self._starts,
            self._members,
        )
        return Penetration(depth, nx, ny)


def _grid(triangles: Float64Array) -> tuple[Float64Array, NDArray[np.int64], Int64Array]:
    """Sort triangles into columns of `_CELL_M`.

    Returns:
        Lower corner (2,), starts (NX, NY + 1) into members, members (K,) rows of `triangles`.
    """
    if len(triangles) == 0:
        return np.zeros(2), np.zeros((1, 2), dtype=np.int64), np.zeros(0, dtype=np.int64)
    low, high = triangles[..., :2].min(axis=1), triangles[..., :2].max(axis=1)
    origin = low.min(axis=0)
    first = np.floor((low - origin) / _CELL_M).astype(np.int64)
    last = np.floor((high - origin) / _CELL_M).astype(np.int64)
    nx, ny = (int(n) + 1 for n in last.max(axis=0))
    counts = np.zeros((nx, ny), dtype=np.int64)
    _count_kernel(first, last, counts)
    ends = np.cumsum(counts.ravel())
    starts = np.zeros((nx, ny + 1), dtype=np.int64)
    starts[:, 1:] = ends.reshape(nx, ny)
    starts[1:, 0] = starts[:-1, -1]
    members = np.empty(int(ends[-1]), dtype=np.int64)
    _fill_kernel(first, last, starts[:, :-1].copy(), members)
    return origin, starts, members


@njit(cache=True, nogil=True)
def _count_kernel(first: Int64Array, last: Int64Array, counts: Int64Array) -> None:
    for t in range(first.shape[0]):
        for i in range(first[t, 0], last[t, 0] + 1):
            for j in range(first[t, 1], last[t, 1] + 1):
                counts[i, j] += 1


@njit(cache=True, nogil=True)
def _fill_kernel(
    first: Int64Array, last: Int64Array, cursor: Int64Array, members: Int64Array
) -> None:
    for t in range(first.shape[0]):
        for i in range(first[t, 0], last[t, 0] + 1):
            for j in range(first[t, 1], last[t, 1] + 1):
                members[cursor[i, j]] = t
                cursor[i, j] += 1


@njit(allocates=True, cache=True, nogil=True)
def _deepest_kernel(
    x: float,
    y: float,
    yaw: float,
    reach: float,
    spheres: Float64Array,
    triangles: Float64Array,
    origin: Float64Array,
    starts: Int64Array,
    members: Int64Array,
) -> tuple[float, float, float]:
    nx, ny = starts.shape[0], starts.shape[1] - 1
    i0 = max(math.floor((x - reach - origin[0]) / _CELL_M), 0)
    i1 = min(math.floor((x + reach - origin[0]) / _CELL_M), nx - 1)
    j0 = max(math.floor((y - reach - origin[1]) / _CELL_M), 0)
    j1 = min(math.floor((y + reach - origin[1]) / _CELL_M), ny - 1)
    c, s = math.cos(yaw), math.sin(yaw)
    best, best_x, best_y = 0.0, 0.0, 0.0
    closest = np.empty(3, dtype=np.float64)
    for i in range(i0, i1 + 1):
        for j in range(j0, j1 + 1):
            for m in range(starts[i, j], starts[i, j + 1]):
                triangle = triangles[members[m]]
                if (
                    min(triangle[0, 0], triangle[1, 0], triangle[2, 0]) > x + reach
                    or max(triangle[0, 0], triangle[1, 0], triangle[2, 0]) < x - reach
                    or min(triangle[0, 1], triangle[1, 1], triangle[2, 1]) > y + reach
                    or max(triangle[0, 1], triangle[1, 1], triangle[2, 1]) < y - reach
                ):
                    continue
                for k in range(spheres.shape[0]):
                    px = x + c * spheres[k, 0] - s * spheres[k, 1]
                    py = y + s * spheres[k, 0] + c * spheres[k, 1]
                    pz, radius = spheres[k, 2], spheres[k, 3]
                    closest_point_kernel(triangle, px, py, pz, closest)
                    dx, dy, dz = px - closest[0], py - closest[1], pz - closest[2]
                    if dx * dx + dy * dy + dz * dz >= radius * radius:
                        continue
                    horizontal = math.sqrt(dx * dx + dy * dy)
                    depth = math.sqrt(radius * radius - dz * dz) - horizontal
                    if depth > best:
                        best = depth
                        if horizontal > 1e-9:
                            best_x, best_y = dx / horizontal, dy / horizontal
                        else:
                            best_x, best_y = 0.0, 0.0
    return best, best_x, best_y


@njit(cache=True, nogil=True)
def closest_point_kernel(
    triangle: Float64Array, px: float, py: float, pz: float, out: Float64Array
) -> None:
    """Write the point of a triangle nearest to p (Ericson, Real-Time Collision Detection, 5.1.5).

    Args:
        triangle: (3, 3) corners.
        px: The point.
        py: The point.
        pz: The point.
        out: (3,) overwritten.
    """
    ax, ay, az = triangle[0, 0], triangle[0, 1], triangle[0, 2]
    ux, uy, uz = triangle[1, 0] - ax, triangle[1, 1] - ay, triangle[1, 2] - az
    vx, vy, vz = triangle[2, 0] - ax, triangle[2, 1] - ay, triangle[2, 2] - az
    wx, wy, wz = px - ax, py - ay, pz - az
    d1, d2 = ux * wx + uy * wy + uz * wz, vx * wx + vy * wy + vz * wz
    uu, uv, vv = (
        ux * ux + uy * uy + uz * uz,
        ux * vx + uy * vy + uz * vz,
        vx * vx + vy * vy + vz * vz,
    )
    d3, d4 = d1 - uu, d2 - uv
    d5, d6 = d1 - uv, d2 - vv
    area_c = d1 * d4 - d3 * d2
    area_b = d5 * d2 - d1 * d6
    area_a = d3 * d6 - d5 * d4
    if d1 <= 0.0 and d2 <= 0.0:
        s, t = 0.0, 0.0
    elif d3 >= 0.0 and d4 <= d3:
        s, t = 1.0, 0.0
    elif d6 >= 0.0 and d5 <= d6:
        s, t = 0.0, 1.0
    elif area_c <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        s, t = d1 / (d1 - d3), 0.0
    elif area_b <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        s, t = 0.0, d2 / (d2 - d6)
    elif area_a <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
        t = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        s = 1.0 - t
    else:
        total = area_a + area_b + area_c
        s, t = area_b / total, area_c / total
    out[0] = ax + s * ux + t * vx
    out[1] = ay + s * uy + t * vy
    out[2] = az + s * uz + t * vz

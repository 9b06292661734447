"""Contact and floor support the slow way."""

import numpy as np
from numpy.typing import NDArray


def closest_point(triangle: NDArray[np.float64], point: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the point of a (3, 3) triangle nearest to a point: the best of plane and edges."""
    a, b, c = triangle
    candidates = []
    for p, q in ((a, b), (b, c), (c, a)):
        length = (q - p) @ (q - p)
        s = min(max(((point - p) @ (q - p)) / length, 0.0), 1.0) if length > 0 else 0.0
        candidates.append(p + s * (q - p))
    normal = _cross(b - a, c - a)
    if normal @ normal > 1e-20:
        foot = point - ((point - a) @ normal) / (normal @ normal) * normal
        sides = [_cross(q - p, foot - p) @ normal for p, q in ((a, b), (b, c), (c, a))]
        if min(sides) >= 0.0:
            candidates.append(foot)
    return min(candidates, key=lambda x: (x - point) @ (x - point))


def _cross(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the cross product; `np.cross` takes ten times as long for one."""
    (ax, ay, az), (bx, by, bz) = a.tolist(), b.tolist()
    return np.array((ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx))


def deepest(
    triangles: NDArray[np.float64], spheres: NDArray[np.float64]
) -> tuple[float, NDArray[np.float64]]:
    """Return the deepest horizontal penetration of (K, 4) world spheres, and the way out."""
    best, way = 0.0, np.zeros(2)
    for triangle in triangles:
        for *centre, radius in spheres:
            offset = np.array(centre) - closest_point(triangle, np.array(centre))
            if offset @ offset >= radius**2:
                continue
            horizontal = float(np.hypot(*offset[:2]))
            depth = float(np.sqrt(radius**2 - offset[2] ** 2)) - horizontal
            if depth > best:
                best, way = depth, offset[:2] / horizontal if horizontal > 1e-9 else np.zeros(2)
    return best, way

"""Intersection tests of rays and triangles, by a bounding volume hierarchy with median splits."""

import numpy as np
from numpy.typing import NDArray

from ippon.compiling import njit
from ippon.geometry import Float64Array

Int32Array = NDArray[np.int32]

_LEAF = 4
"""Most triangles in a leaf."""
_DEPTH = 64
"""Upper bound of the number of levels, for any number of triangles that fits in memory."""
_EDGE = 1e-9
"""Relative margin of triangles beyond their edges, so that neighbours leave no gap."""
_HAIR_M = 1e-9
"""Margin of boxes, so that rounding loses no triangle."""


class RayTree:
    """Bounding volume hierarchy of double-sided triangles."""

    def __init__(self, corners: NDArray[np.floating]) -> None:
        """Build the tree.

        Args:
            corners: (N, 3, 3) metres, the corners of each triangle.

        Raises:
            ValueError: The array is not (N, 3, 3), or not finite.
        """
        triangles = np.ascontiguousarray(corners, dtype=np.float64)
        if triangles.ndim != 3 or triangles.shape[1:] != (3, 3):
            raise ValueError(f"triangles are (N, 3, 3); got {triangles.shape}")
        if not np.isfinite(triangles).all():
            raise ValueError("triangles need finite corners")
        count = len(triangles)
        order = np.arange(count, dtype=np.int32)
        most = max(1, 2 * count)
        boxes = np.zeros((most, 6), dtype=np.float64)
        nodes = np.zeros((most, 2), dtype=np.int32)
        if count:
            _build_kernel(triangles.min(axis=1), triangles.max(axis=1), order, boxes, nodes)
        self._triangles = triangles[order]
        self._boxes = boxes
        self._nodes = nodes

    def is_hit(self, origins: Float64Array, segments: Float64Array) -> NDArray[np.bool_]:
        """Tell for each segment whether it meets a triangle.

        Args:
            origins: (N, 3) metres, the first ends.
            segments: (N, 3) metres, from the first to the second ends.

        Returns:
            (N,) bool; the ends are included.
        """
        out = np.zeros(len(origins), dtype=np.bool_)
        if len(self._triangles):
            _hit_kernel(
                np.ascontiguousarray(origins, dtype=np.float64),
                np.ascontiguousarray(segments, dtype=np.float64),
                self._triangles,
                self._boxes,
                self._nodes,
                out,
            )
        return out


@njit(allocates=True, cache=True, nogil=True)
def _build_kernel(
    low: Float64Array,
    high: Float64Array,
    order: Int32Array,
    boxes: Float64Array,
    nodes: Int32Array,
) -> None:
    """Fill boxes (lower, upper corner) and nodes: (first child, 0) or (first triangle, count)."""
    stack = np.empty((2 * _DEPTH, 3), dtype=np.int64)
    stack[0] = 0, 0, len(order)
    depth, used = 1, 1
    while depth > 0:
        depth -= 1
        node, begin, end = stack[depth]
        longest, axis = -1.0, 0
        for k in range(3):
            boxes[node, k] = np.inf
            boxes[node, 3 + k] = -np.inf
            for i in range(begin, end):
                boxes[node, k] = min(boxes[node, k], low[order[i], k])
                boxes[node, 3 + k] = max(boxes[node, 3 + k], high[order[i], k])
            if boxes[node, 3 + k] - boxes[node, k] > longest:
                longest, axis = boxes[node, 3 + k] - boxes[node, k], k
        if end - begin <= _LEAF:
            nodes[node] = begin, end - begin
            continue
        middles = np.empty(end - begin, dtype=np.float64)
        for i in range(begin, end):
            middles[i - begin] = low[order[i], axis] + high[order[i], axis]
        order[begin:end] = order[begin:end][np.argsort(middles, kind="mergesort")]
        half = (begin + end) // 2
        nodes[node] = used, 0
        stack[depth] = used, begin, half
        stack[depth + 1] = used + 1, half, end
        depth += 2
        used += 2


@njit(allocates=True, cache=True, nogil=True, error_model="numpy")
def _hit_kernel(
    origins: Float64Array,
    segments: Float64Array,
    triangles: Float64Array,
    boxes: Float64Array,
    nodes: Int32Array,
    out: NDArray[np.bool_],
) -> None:
    stack = np.empty(2 * _DEPTH, dtype=np.int64)
    # What blocks one segment mostly blocks the next.
    blocking = 0
    for r in range(origins.shape[0]):
        if _meets_triangle(origins, segments, r, triangles, blocking):
            out[r] = True
            continue
        stack[0] = 0
        depth = 1
        while depth > 0:
            depth -= 1
            node = stack[depth]
            if not _meets_box(origins, segments, r, boxes, node):
                continue
            first, count = nodes[node, 0], nodes[node, 1]
            if count == 0:
                stack[depth] = first
                stack[depth + 1] = first + 1
                depth += 2
                continue
            for t in range(first, first + count):
                if _meets_triangle(origins, segments, r, triangles, t):
                    out[r] = True
                    blocking = t
                    depth = 0
                    break


@njit(cache=True, nogil=True, inline="always", error_model="numpy")
def _meets_box(
    origins: Float64Array, segments: Float64Array, r: int, boxes: Float64Array, node: int
) -> bool:
    nearest, farthest = 0.0, 1.0
    for k in range(3):
        low = boxes[node, k] - origins[r, k] - _HAIR_M
        high = boxes[node, 3 + k] - origins[r, k] + _HAIR_M
        along = segments[r, k]
        if along == 0.0:
            if low > 0.0 or high < 0.0:
                return False
            continue
        a, b = low / along, high / along
        nearest = max(nearest, min(a, b))
        farthest = min(farthest, max(a, b))
        if nearest > farthest:
            return False
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def _meets_triangle(
    origins: Float64Array, segments: Float64Array, r: int, triangles: Float64Array, t: int
) -> bool:
    """Test a ray against a triangle (Möller and Trumbore 1997)."""
    ax, ay, az = triangles[t, 0, 0], triangles[t, 0, 1], triangles[t, 0, 2]
    e1x, e1y, e1z = triangles[t, 1, 0] - ax, triangles[t, 1, 1] - ay, triangles[t, 1, 2] - az
    e2x, e2y, e2z = triangles[t, 2, 0] - ax, triangles[t, 2, 1] - ay, triangles[t, 2, 2] - az
    dx, dy, dz = segments[r, 0], segments[r, 1], segments[r, 2]
    px, py, pz = dy * e2z - dz * e2y, dz * e2x - dx * e2z, dx * e2y - dy * e2x
    det = e1x * px + e1y * py + e1z * pz
    if det == 0.0:
        return False
    sx, sy, sz = origins[r, 0] - ax, origins[r, 1] - ay, origins[r, 2] - az
    u = (sx * px + sy * py + sz * pz) / det
    if u < -_EDGE or u > 1.0 + _EDGE:
        return False
    qx, qy, qz = sy * e1z - sz * e1y, sz * e1x - sx * e1z, sx * e1y - sy * e1x
    v = (dx * qx + dy * qy + dz * qz) / det
    if v < -_EDGE or u + v > 1.0 + _EDGE:
        return False
    along = (e2x * qx + e2y * qy + e2z * qz) / det
    return 0.0 <= along <= 1.0

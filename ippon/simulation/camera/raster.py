"""Rasterisation of triangles: a serial z-buffer over homogeneous edge functions.

With P = K (R p + t) the pixel-scaled camera coordinates of a corner, the ray through pixel (u, v)
has direction d = (u, v, 1), and the edge functions e_i = d . (P_j x P_k) are linear in u and v.
The ray meets the triangle where all e_i have the sign of det = P_0 . (P_1 x P_2), at inverse depth
w = (e_0 + e_1 + e_2) / det: exact ray casting at one multiplication per pixel, without clipping
(Olano and Greer, "Triangle scan conversion using 2D homogeneous coordinates", 1997). It is ten
times as fast as casting one ray per pixel into a bounding volume hierarchy.
"""

import math

import numpy as np
from numpy.typing import NDArray

from ippon.compiling import njit
from ippon.geometry import Float64Array

Float32Array = NDArray[np.float32]
Int32Array = NDArray[np.int32]
BoolArray = NDArray[np.bool_]

_WORTH_HIDING = 100
"""Objects of fewer faces are drawn without an occlusion test."""

NEAR_M = 0.01
"""Near plane: geometry closer than this along the optical axis is not drawn."""


def visible_instances(
    projection: Float64Array,
    width: int,
    height: int,
    aabb_min: Float64Array,
    aabb_max: Float64Array,
) -> BoolArray:
    """Tell which boxes may be in view.

    Args:
        projection: (3, 4) world to pixel-scaled camera coordinates.
        width: Image width in pixels.
        height: Image height in pixels.
        aabb_min: (N, 3) lower corners in the world, metres.
        aabb_max: (N, 3) upper corners.

    Returns:
        (N,) bool; False only where no part of the box is in view.
    """
    x, y, z = projection[0], projection[1], projection[2]
    near = np.array([0.0, 0.0, 0.0, NEAR_M])
    planes = np.stack(
        [
            z - near,
            x + 0.5 * z,
            (width - 0.5) * z - x,
            y + 0.5 * z,
            (height - 0.5) * z - y,
        ]
    )
    normals = planes[:, :3]
    # A box is outside a plane if its farthest corner along the normal is.
    farthest = np.maximum(aabb_min[:, None] * normals, aabb_max[:, None] * normals).sum(axis=2)
    return (farthest + planes[:, 3] > 0.0).all(axis=1)


def image_boxes(
    projection: Float64Array,
    width: int,
    height: int,
    aabb_min: Float64Array,
    aabb_max: Float64Array,
) -> Float64Array:
    """Return bounds of boxes in the image.

    Args:
        projection: (3, 4) world to pixel-scaled camera coordinates.
        width: Image width in pixels.
        height: Image height in pixels.
        aabb_min: (N, 3) lower corners in the world, metres.
        aabb_max: (N, 3) upper corners.

    Returns:
        (N, 5) first and last column, first and last row, greatest inverse depth (1 / m); the whole
        image at infinite inverse depth for boxes that reach behind the camera.
    """
    pick = np.array([[i & 1, i >> 1 & 1, i >> 2 & 1] for i in range(8)], dtype=np.bool_)
    corners = np.where(pick, aabb_max[:, None], aabb_min[:, None])
    camera = corners @ projection[:, :3].T + projection[:, 3]
    z = camera[..., 2]
    behind = (z <= NEAR_M).any(axis=1)
    inverse = 1.0 / np.maximum(z, NEAR_M)
    u, v = camera[..., 0] * inverse, camera[..., 1] * inverse
    boxes = np.stack(
        [
            np.clip(np.floor(u.min(axis=1)), 0, width - 1),
            np.clip(np.ceil(u.max(axis=1)), 0, width - 1),
            np.clip(np.floor(v.min(axis=1)), 0, height - 1),
            np.clip(np.ceil(v.max(axis=1)), 0, height - 1),
            inverse.max(axis=1),
        ],
        axis=1,
    )
    boxes[behind] = (0, width - 1, 0, height - 1, math.inf)
    return boxes


def rasterise(
    projection: Float64Array,
    vertices: Float32Array,
    faces: Int32Array,
    ranges: Int32Array,
    boxes: Float64Array,
    inverse_depth: Float32Array,
    face_index: Int32Array,
) -> None:
    """Draw triangles into a z-buffer.

    Args:
        projection: (3, 4) world to pixel-scaled camera coordinates.
        vertices: (V, 3) metres in the world.
        faces: (F, 3) rows of `vertices`.
        ranges: (M, 4) vertex begin, vertex end, face begin, face end of each object to draw;
            nearest first, since those may occlude others entirely.
        boxes: (M, 5) `image_boxes` of the objects.
        inverse_depth: (H, W), overwritten: 1 / metres along the optical axis, 0 for none.
        face_index: (H, W), overwritten: row of `faces`, -1 for none.
    """
    inverse_depth.fill(0.0)
    face_index.fill(-1)
    corners = np.empty((len(vertices), 3), dtype=np.float64)
    _rasterise_kernel(
        projection, vertices, faces, ranges, boxes, corners, inverse_depth, face_index
    )


@njit(allocates=True, cache=True, nogil=True)
def _rasterise_kernel(
    projection: Float64Array,
    vertices: Float32Array,
    faces: Int32Array,
    ranges: Int32Array,
    boxes: Float64Array,
    corners: Float64Array,
    inverse_depth: Float32Array,
    face_index: Int32Array,
) -> None:
    box = np.empty(4, dtype=np.float64)
    size = inverse_depth.shape
    zs, fs = inverse_depth.reshape(-1), face_index.reshape(-1)
    for r in range(ranges.shape[0]):
        many = ranges[r, 3] - ranges[r, 2] >= _WORTH_HIDING
        if many and _is_hidden(boxes, r, inverse_depth):
            continue
        for i in range(ranges[r, 0], ranges[r, 1]):
            x, y, z = vertices[i, 0], vertices[i, 1], vertices[i, 2]
            for k in range(3):
                corners[i, k] = (
                    projection[k, 0] * x
                    + projection[k, 1] * y
                    + projection[k, 2] * z
                    + projection[k, 3]
                )
        for f in range(ranges[r, 2], ranges[r, 3]):
            _draw_kernel(corners, faces, f, box, size, zs, fs)


@njit(cache=True, nogil=True)
def _is_hidden(boxes: Float64Array, r: int, inverse_depth: Float32Array) -> bool:
    """Tell whether what is drawn so far covers a box and lies before it."""
    nearest = boxes[r, 4]
    for v in range(int(boxes[r, 2]), int(boxes[r, 3]) + 1):
        for u in range(int(boxes[r, 0]), int(boxes[r, 1]) + 1):
            if inverse_depth[v, u] < nearest:
                return False
    return True


@njit(cache=True, nogil=True, inline="always")
def _grow(box: Float64Array, x: float, y: float, z: float) -> None:
    u, v = x / z, y / z
    box[0] = min(box[0], u)
    box[1] = max(box[1], u)
    box[2] = min(box[2], v)
    box[3] = max(box[3], v)


@njit(cache=True, nogil=True, inline="always")
def _grow_where_cut(box: Float64Array, corners: Float64Array, i: int, j: int) -> None:
    """Add the point where edge (i, j) meets the near plane."""
    zi, zj = corners[i, 2], corners[j, 2]
    if (zi > NEAR_M) != (zj > NEAR_M):
        s = (NEAR_M - zi) / (zj - zi)
        x = corners[i, 0] + s * (corners[j, 0] - corners[i, 0])
        y = corners[i, 1] + s * (corners[j, 1] - corners[i, 1])
        _grow(box, x, y, NEAR_M)


@njit(cache=True, nogil=True)
def _draw_kernel(
    corners: Float64Array,
    faces: Int32Array,
    f: int,
    box: Float64Array,
    size: tuple[int, int],
    inverse_depth: Float32Array,
    face_index: Int32Array,
) -> None:
    """Draw one triangle into flattened images of (height, width) `size`."""
    height, width = size
    a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
    za, zb, zc = corners[a, 2], corners[b, 2], corners[c, 2]
    if za <= NEAR_M and zb <= NEAR_M and zc <= NEAR_M:
        return
    box[0] = box[2] = math.inf
    box[1] = box[3] = -math.inf
    if za > NEAR_M:
        _grow(box, corners[a, 0], corners[a, 1], za)
    if zb > NEAR_M:
        _grow(box, corners[b, 0], corners[b, 1], zb)
    if zc > NEAR_M:
        _grow(box, corners[c, 0], corners[c, 1], zc)
    _grow_where_cut(box, corners, a, b)
    _grow_where_cut(box, corners, b, c)
    _grow_where_cut(box, corners, c, a)
    if box[1] < 0.0 or box[3] < 0.0 or box[0] > width - 1 or box[2] > height - 1:
        return
    # Slightly wider than the corners, so that rounding of u = x / z loses no pixel.
    u0 = math.ceil(max(box[0] - 1e-6, 0.0))
    u1 = math.floor(min(box[1] + 1e-6, width - 1.0))
    v0 = math.ceil(max(box[2] - 1e-6, 0.0))
    v1 = math.floor(min(box[3] + 1e-6, height - 1.0))
    if u0 > u1 or v0 > v1:
        return

    ax, ay = corners[a, 0], corners[a, 1]
    bx, by = corners[b, 0], corners[b, 1]
    cx, cy = corners[c, 0], corners[c, 1]
    # Rows are P_j x P_k. For a shared edge the neighbour's row is exactly the negative: no cracks.
    e0u, e0v, e0 = by * zc - zb * cy, zb * cx - bx * zc, bx * cy - by * cx
    e1u, e1v, e1 = cy * za - zc * ay, zc * ax - cx * za, cx * ay - cy * ax
    e2u, e2v, e2 = ay * zb - za * by, za * bx - ax * zb, ax * by - ay * bx
    det = ax * e0u + ay * e0v + za * e0
    if det == 0.0:
        return
    if det < 0.0:
        det = -det
        e0u, e0v, e0 = -e0u, -e0v, -e0
        e1u, e1v, e1 = -e1u, -e1v, -e1
        e2u, e2v, e2 = -e2u, -e2v, -e2
    wu, wv, w0 = (e0u + e1u + e2u) / det, (e0v + e1v + e2v) / det, (e0 + e1 + e2) / det
    for v in range(v0, v1 + 1):
        r0, r1, r2 = e0v * v + e0, e1v * v + e1, e2v * v + e2
        lo, hi = u0, u1
        lo, hi = _narrow(e0u, r0, lo, hi)
        lo, hi = _narrow(e1u, r1, lo, hi)
        lo, hi = _narrow(e2u, r2, lo, hi)
        wr = wv * v + w0
        for u in range(lo, hi + 1):
            w = np.float32(wu * u + wr)
            at = np.uint64(v * width + u)  # Unsigned: no check for negative indices.
            if w > inverse_depth[at] and w <= 1.0 / NEAR_M:
                inverse_depth[at] = w
                face_index[at] = f


@njit(cache=True, nogil=True, inline="always")
def _narrow(slope: float, offset: float, lo: int, hi: int) -> tuple[int, int]:
    """Narrow the pixels [lo, hi] of a row to those where slope * u + offset >= 0, exactly."""
    if lo > hi:
        return lo, hi
    if slope > 0.0:
        if slope * lo + offset < 0.0:
            lo = max(lo, math.ceil(min(-offset / slope, hi + 1.0)))
            while lo > 0 and slope * (lo - 1) + offset >= 0.0:
                lo -= 1
            while lo <= hi and slope * lo + offset < 0.0:
                lo += 1
    elif slope < 0.0:
        if slope * hi + offset < 0.0:
            hi = min(hi, math.floor(max(-offset / slope, lo - 1.0)))
            while slope * (hi + 1) + offset >= 0.0:
                hi += 1
            while hi >= lo and slope * hi + offset < 0.0:
                hi -= 1
    elif offset < 0.0:
        hi = lo - 1
    return lo, hi

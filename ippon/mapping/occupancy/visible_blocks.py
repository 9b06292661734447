"""Selection of the blocks that an image sees."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from ippon.compiling import njit
from ippon.mapping.arrays import BLOCK_EDGE, INNER
from ippon.mapping.blocks import allocate_block
from ippon.mapping.depth_image import TILE

CLEAR: Final = 0
"""The block lies before all surfaces in view: voxels with depth are free."""
MIXED: Final = 1
"""Some voxels may be at, behind or beside a surface."""
CULLED: Final = -1
OVER_BOUND: Final = -1


def frustum_box(
    rays: NDArray[np.float64], T_world_camera: NDArray[np.float64], depth_m: float, block_m: float
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the box [low, high) of blocks around a view frustum.

    Args:
        rays: (4, 3) directions of the image corners in the camera frame, z = 1.
        T_world_camera: (4, 4).
        depth_m: Far end of the frustum along the optical axis.
        block_m: Edge of a block.
    """
    corners = rays * depth_m @ T_world_camera[:3, :3].T + T_world_camera[:3, 3]
    points = np.concatenate([corners, T_world_camera[None, :3, 3]])
    low = np.floor(points.min(axis=0) / block_m).astype(np.int64)
    high = np.floor(points.max(axis=0) / block_m).astype(np.int64) + 1
    return low, high


@njit(cache=True, nogil=True, inline="always")
def classify_block(center, axes, depth_range, intrinsics, tiles, size):
    """Classify a box in an image: `CULLED`, `CLEAR` or `MIXED`.

    Args:
        center: (3,) of the box in the camera frame, metres.
        axes: (3, 3) half edges of the box in the camera frame, one a column.
        depth_range: Nearest depth fused, farthest, and how far before and behind a surface the
            signed distance is graded; metres.
        intrinsics: fx, fy, cx, cy.
        tiles: See `DepthImage.tiles`.
        size: (W, H) of the image in pixels.
    """
    x, y, z = center
    near_m, far_m, ahead_m, behind_m = depth_range
    reach = abs(axes[2, 0]) + abs(axes[2, 1]) + abs(axes[2, 2])
    z0, z1 = z - reach, z + reach
    if z1 <= near_m or z0 > far_m:
        return CULLED
    fx, fy, cx, cy = intrinsics
    width, height = size
    u0, u1, v0, v1 = 1e9, -1e9, 1e9, -1e9
    if z0 > 0.5 * near_m:
        for corner in range(8):
            a = 1.0 if corner & 1 else -1.0
            b = 1.0 if corner & 2 else -1.0
            c = 1.0 if corner & 4 else -1.0
            inverse = 1.0 / (z + a * axes[2, 0] + b * axes[2, 1] + c * axes[2, 2])
            u = fx * (x + a * axes[0, 0] + b * axes[0, 1] + c * axes[0, 2]) * inverse + cx
            v = fy * (y + a * axes[1, 0] + b * axes[1, 1] + c * axes[1, 2]) * inverse + cy
            u0, u1, v0, v1 = min(u0, u), max(u1, u), min(v0, v), max(v1, v)
        # One pixel of slack, because the kernels round in float32.
        u0, v0, u1, v1 = u0 - 1.0, v0 - 1.0, u1 + 1.0, v1 + 1.0
        if u1 < 0.0 or v1 < 0.0 or u0 > width - 1.0 or v0 > height - 1.0:
            return CULLED
        tx0, ty0 = int(max(u0, 0.0)) // TILE, int(max(v0, 0.0)) // TILE
        tx1, ty1 = int(min(u1, width - 1.0)) // TILE, int(min(v1, height - 1.0)) // TILE
    else:
        tx0, ty0 = 0, 0
        tx1, ty1 = tiles.shape[2] - 1, tiles.shape[1] - 1
    behind = max(z0 - behind_m, 0.0)
    before = z1 + ahead_m
    seen, clear = False, True
    # The greatest squares that fit; the last of a row and of a column overlap those before.
    k, side = 0, min(tx1 - tx0, ty1 - ty0) + 1
    while k + 1 < tiles.shape[0] and 2 << k <= side:
        k += 1
    edge = 1 << k
    for y in range(ty0, ty1 + 1, edge):
        ty = min(y, ty1 + 1 - edge)
        for x in range(tx0, tx1 + 1, edge):
            tx = min(x, tx1 + 1 - edge)
            if tiles[k, ty, tx, 1] > behind:
                seen = True
            if tiles[k, ty, tx, 0] < before:
                clear = False
            if seen and not clear:
                return MIXED
    return CLEAR if seen else CULLED


@INNER
def _sides(intrinsics, size):
    """Return the slopes of the view's left, right, upper and lower side, and their secants.

    Two pixels wider than the image, because the kernels round in float32.
    """
    fx, fy, cx, cy = intrinsics
    left, right = (-2.0 - cx) / fx, (size[0] + 1.0 - cx) / fx
    upper, lower = (-2.0 - cy) / fy, (size[1] + 1.0 - cy) / fy
    return (
        (left, np.sqrt(1.0 + left * left)),
        (right, np.sqrt(1.0 + right * right)),
        (upper, np.sqrt(1.0 + upper * upper)),
        (lower, np.sqrt(1.0 + lower * lower)),
    )


@INNER
def _is_beside(x, y, z, radius, sides):
    """Tell whether a ball lies outside one of the view's sides."""
    left, right, upper, lower = sides
    return (
        x - left[0] * z < -radius * left[1]
        or x - right[0] * z > radius * right[1]
        or y - upper[0] * z < -radius * upper[1]
        or y - lower[0] * z > radius * lower[1]
    )


@njit(cache=True, nogil=True)
def select_kernel(
    low,
    high,
    T_camera_world,
    axes,
    voxel_size,
    depth_range,
    intrinsics,
    size,
    tiles,
    origin,
    directory,
    pools,
    farthest,
    revision,
    rows,
    kinds,
    is_new,
    place,
    makes_rows,
):
    """List the rows of the blocks of [low, high) that the image sees, making those that lack one.

    `axes` are half the edges of a block, see `classify_block`. Without `makes_rows` blocks that
    lack a row are only counted.

    Returns:
        Length of the list in `rows`, `kinds` and `is_new`; `OVER_BOUND` when there was no row left.
        `place[1 + k]` is -(1 + n) if block k of the box, counted along z first, is number n of the
        list, and 0 if the image does not see it; `place[0]` is 0.
    """
    edge = voxel_size * BLOCK_EDGE
    m = T_camera_world
    radius = 0.5 * np.sqrt(3.0) * edge
    sides = _sides(intrinsics, size)
    n, cell = 0, 0
    place[:] = 0
    for bx in range(low[0], high[0]):
        for by in range(low[1], high[1]):
            for bz in range(low[2], high[2]):
                cell += 1
                wx = (bx + 0.5) * edge
                wy = (by + 0.5) * edge
                wz = (bz + 0.5) * edge
                x = m[0, 0] * wx + m[0, 1] * wy + m[0, 2] * wz + m[0, 3]
                y = m[1, 0] * wx + m[1, 1] * wy + m[1, 2] * wz + m[1, 3]
                z = m[2, 0] * wx + m[2, 1] * wy + m[2, 2] * wz + m[2, 3]
                if z + radius <= depth_range[0] or z - radius > depth_range[1]:
                    continue
                if _is_beside(x, y, z, radius, sides):
                    continue
                kind = classify_block((x, y, z), axes, depth_range, intrinsics, tiles, size)
                if kind == CULLED:
                    continue
                ix, iy, iz = bx - origin[0], by - origin[1], bz - origin[2]
                row = directory[ix, iy, iz]
                if row < 0 and not makes_rows:
                    n += 1
                    continue
                if row < 0:
                    row = allocate_block(pools, bx, by, bz, farthest, revision)
                    if row < 0:
                        return OVER_BOUND
                    directory[ix, iy, iz] = row
                # A row allocated for this image has its revision, even after an interrupted pass.
                is_new[n] = pools.appearance[row] == revision
                rows[n] = row
                kinds[n] = kind
                n += 1
                place[cell] = -n
    return n

"""Obstacles near the robot, straight from the map, for the moment before each command."""

import math

import numpy as np
from numba import njit

from ippon.geometry import Float64Array
from ippon.mapping.arrays import OCCUPIED, MapArrays
from ippon.planning.columns import ColumnBands
from ippon.planning.voxels import block_row
from ippon.robot import RobotProfile


def near_obstacles(
    arrays: MapArrays, robot: RobotProfile, T_world_base: Float64Array, radius_m: float
) -> Float64Array:
    """List what stands at the height of the robot's body.

    Args:
        arrays: The map.
        robot: Its body and step height.
        T_world_base: Where it stands.
        radius_m: How far round it to look.

    Returns:
        (M, 2) float64 world x and y of the centres of occupied voxel columns, metres.
    """
    v = arrays.voxel_size
    bands = ColumnBands.of(robot, float(T_world_base[2, 3]), v)
    cells = 2 * math.ceil(radius_m / v) + 2
    out = np.empty((cells * cells, 2), dtype=np.float64)
    count = _near_obstacles_kernel(
        arrays,
        float(T_world_base[0, 3]),
        float(T_world_base[1, 3]),
        radius_m,
        bands.body_low,
        bands.body_high,
        out,
    )
    return out[:count]


@njit(cache=True, nogil=True)
def _near_obstacles_kernel(arrays, x, y, radius, low, high, out):
    v = arrays.voxel_size
    count = 0
    for i in range(math.ceil((x - radius) / v - 0.5), math.floor((x + radius) / v - 0.5) + 1):
        for j in range(math.ceil((y - radius) / v - 0.5), math.floor((y + radius) / v - 0.5) + 1):
            cx, cy = (i + 0.5) * v, (j + 0.5) * v
            if (cx - x) ** 2 + (cy - y) ** 2 > radius * radius:
                continue
            for k in range(low, high + 1):
                row = block_row(arrays, i, j, k)
                if row < 0:
                    continue
                column = ((i & 7) << 6) | ((j & 7) << 3) | (k & 7)
                if arrays.state[row, column] == OCCUPIED:
                    out[count, 0], out[count, 1] = cx, cy
                    count += 1
                    break
    return count


def room_at(points: Float64Array, obstacles: Float64Array) -> Float64Array:
    """Return the distance of each of (N, 2) points to the nearest of (M, 2) obstacles.

    Infinite where there is no obstacle at all.
    """
    if len(obstacles) == 0:
        return np.full(len(points), np.inf)
    return np.sqrt(((points[:, None] - obstacles[None]) ** 2).sum(axis=2).min(axis=1))


def body_room(robot: RobotProfile, poses: Float64Array, obstacles: Float64Array) -> Float64Array:
    """Return the room between the body and the nearest obstacle at each pose.

    Args:
        robot: Its collision spheres, seen from above.
        poses: (N, 3) x, y and yaw.
        obstacles: (M, 2) points.

    Returns:
        (N,) metres, negative where a sphere covers an obstacle; infinite without obstacles.
    """
    discs = {(s.x_m, s.y_m): 0.0 for s in robot.spheres}
    for s in robot.spheres:
        discs[s.x_m, s.y_m] = max(discs[s.x_m, s.y_m], s.radius_m)
    room = np.full(len(poses), np.inf)
    c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    for (x, y), radius in discs.items():
        centres = np.column_stack([poses[:, 0] + x * c - y * s, poses[:, 1] + x * s + y * c])
        room = np.minimum(room, room_at(centres, obstacles) - radius)
    return room

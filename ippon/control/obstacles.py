"""Obstacles and drops near the robot, from map and newest image, and the body's clearance."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ippon.compiling import njit
from ippon.control.drops import NOWHERE, drops_around
from ippon.frame import Frame
from ippon.geometry import Float64Array, transform_points, yaw_of
from ippon.mapping.arrays import OCCUPIED, MapArrays
from ippon.planning.terrain.obstacle_columns import HeightBands
from ippon.planning.voxel_lookup import block_row
from ippon.robot import RobotProfile, disc_centres

OVERLAP_TOLERANCE_M = 0.02
"""Overlap of body and obstacle that does not count as a collision: a voxel is up to half its edge
off the surface."""
_MOST_PIXELS = 6000
"""Pixels of a depth image that are used at most, on a regular raster."""
_FEWEST_POINTS = 4
"""Least number of points in a column that count as an obstacle: fewer may be depth noise."""


class Hazards(NamedTuple):
    """What a body near it must not reach: (M, 2) float64 world x and y each, metres."""

    obstacles: Float64Array
    """At the height of the body."""
    drops: Float64Array
    """Where the floor ends: stairs that lead down, an edge."""
    hidden: Float64Array = NOWHERE
    """Beside a drop, where no image has shown the floor. The planner does not drive there; an
    operator might."""

    @property
    def all(self) -> Float64Array:
        """Obstacles and drops."""
        return np.concatenate(self[:2]) if len(self.drops) else self.obstacles

    @property
    def by_hand(self) -> "Hazards":
        """The same with what is hidden counted among the drops."""
        if len(self.hidden) == 0:
            return self
        return Hazards(self.obstacles, np.concatenate([self.drops, self.hidden]))


def mapped_obstacles(
    arrays: MapArrays, robot: RobotProfile, T_world_base: Float64Array, radius_m: float
) -> Float64Array:
    """List the mapped obstacles at the height of the robot's body.

    Args:
        arrays: The map.
        robot: Its body and step height.
        T_world_base: Pose of the robot.
        radius_m: Radius of the search around it.

    Returns:
        (M, 2) float64 world x and y of the centres of occupied voxel columns, metres.
    """
    v = arrays.voxel_size
    bands = HeightBands.of(robot, float(T_world_base[2, 3]), v)
    cells = 2 * math.ceil(radius_m / v) + 2
    out = np.empty((cells * cells, 2), dtype=np.float64)
    count = _mapped_obstacles_kernel(
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
def _mapped_obstacles_kernel(arrays, x, y, radius, low, high, out):
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


def hazards_around(
    arrays: MapArrays,
    robot: RobotProfile,
    T_world_base: Float64Array,
    radius_m: float,
    frame: Frame | None = None,
    floor_z_m: float | None = None,
    *,
    hidden: bool = False,
) -> Hazards:
    """List the obstacles of the map and, where there is one, of the newest image, and the drops.

    Args:
        arrays: The map.
        robot: Its body and step height.
        T_world_base: Pose of the robot.
        radius_m: Radius of the search around it.
        frame: The newest image; None for the map alone.
        floor_z_m: See `drops_around`.
        hidden: Whether to list hidden floor, too.

    Returns:
        See `mapped_obstacles`, `observed_obstacles` and `drops_around`.
    """
    obstacles = mapped_obstacles(arrays, robot, T_world_base, radius_m)
    if frame is not None:
        seen = observed_obstacles(frame, robot, arrays.voxel_size, radius_m)
        obstacles = np.concatenate([obstacles, seen])
    drops = drops_around(arrays, robot, T_world_base, radius_m, floor_z_m, hidden=hidden)
    return Hazards(obstacles, *drops)


def observed_obstacles(
    frame: Frame, robot: RobotProfile, voxel_size: float, radius_m: float
) -> Float64Array:
    """List the obstacles in the newest depth image at the height of the robot's body.

    The map needs more than one image to turn free space into occupied space, which is too late for
    a person who steps in front of the robot.

    Args:
        frame: Depth image and poses.
        robot: Its body and step height.
        voxel_size: Edge of the columns in which points are counted, metres.
        radius_m: Radius of the search around the robot.

    Returns:
        (M, 2) float64 world x and y, metres: the mean of the points in each column. Points inside
        the body belong to the robot itself and are left out.
    """
    floor_z_m = float(frame.T_world_base[2, 3])
    bands = HeightBands.of(robot, floor_z_m, voxel_size)
    rows, columns = frame.depth.shape
    step = max(1, math.ceil(math.sqrt(rows * columns / _MOST_PIXELS)))
    depth = frame.depth[::step, ::step]
    # No point within the radius has a larger depth than this.
    deepest = math.hypot(radius_m + robot.radius_m, robot.camera_height_m + 1.0)
    v, u = np.nonzero((depth >= robot.min_depth_m) & (depth < deepest))
    z = depth[v, u].astype(np.float64)
    camera = frame.camera
    x = (u * step - camera.cx) / camera.fx * z
    y = (v * step - camera.cy) / camera.fy * z
    points = transform_points(frame.T_world_camera, np.stack([x, y, z], axis=1))
    offset = points[:, :2] - frame.T_world_base[:2, 3]
    inside = np.hypot(*offset.T) <= radius_m
    inside &= _outside_body(robot, offset, yaw_of(frame.T_world_base), 0.5 * voxel_size)
    inside &= points[:, 2] >= bands.body_low * voxel_size
    inside &= points[:, 2] < (bands.body_high + 1) * voxel_size
    return _middles(points[inside, :2], voxel_size)


def _outside_body(
    robot: RobotProfile, offset: Float64Array, yaw: float, within_m: float
) -> NDArray[np.bool_]:
    """Return (N,) whether points relative to the base lie at most `within_m` inside the body."""
    centres = disc_centres(robot.outline, np.array([[0.0, 0.0, yaw]]))[0]
    outside = np.ones(len(offset), dtype=np.bool_)
    for (x, y), (_, _, radius) in zip(centres, robot.outline, strict=True):
        outside &= np.hypot(offset[:, 0] - x, offset[:, 1] - y) > radius - within_m
    return outside


def _middles(points: Float64Array, cell_m: float) -> Float64Array:
    """Return the (M, 2) mean of the (N, 2) points in each square with enough of them."""
    cells = np.floor(points / cell_m).astype(np.int64)
    # One integer per square: comparing rows is far slower.
    names = (cells[:, 0] << 32) + cells[:, 1]
    _, member_of, count = np.unique(names, return_inverse=True, return_counts=True)
    sums = np.stack([np.bincount(member_of, points[:, k], len(count)) for k in range(2)], axis=1)
    enough = count >= _FEWEST_POINTS
    return sums[enough] / count[enough, None]


def nearest_distance(points: Float64Array, obstacles: Float64Array) -> Float64Array:
    """Return the distance of each of (N, 2) points to the nearest of (M, 2) obstacles.

    Infinite without obstacles.
    """
    if len(obstacles) == 0:
        return np.full(len(points), np.inf)
    return np.sqrt(((points[:, None] - obstacles[None]) ** 2).sum(axis=2).min(axis=1))


def body_clearance(
    robot: RobotProfile, poses: Float64Array, obstacles: Float64Array
) -> Float64Array:
    """Return the least free space between the body and each obstacle over some poses.

    Args:
        robot: Its collision spheres, seen from above.
        poses: (N, 3) x, y and yaw, N of at least 1.
        obstacles: (M, 2) points.

    Returns:
        (M,) metres, negative if a sphere covers the obstacle.
    """
    discs = {(s.x_m, s.y_m): 0.0 for s in robot.spheres}
    for s in robot.spheres:
        discs[s.x_m, s.y_m] = max(discs[s.x_m, s.y_m], s.radius_m)
    centres = disc_centres(tuple((x, y, r) for (x, y), r in discs.items()), poses)
    clearance = np.full(len(obstacles), np.inf)
    for k, radius in enumerate(discs.values()):
        squared = ((centres[:, k, None] - obstacles[None]) ** 2).sum(axis=2)
        clearance = np.minimum(clearance, np.sqrt(squared.min(axis=0)) - radius)
    return clearance


def disc_clearance(
    discs: tuple[tuple[float, float, float], ...], poses: Float64Array, obstacles: Float64Array
) -> Float64Array:
    """Return the free space between discs and the nearest obstacle at each pose.

    Args:
        discs: x and y in the base frame, and radius, metres, as in `RobotProfile.outline`.
        poses: (N, 3) x, y and yaw.
        obstacles: (M, 2) points.

    Returns:
        (N,) metres, negative if a disc covers an obstacle; infinite without obstacles.
    """
    clearance = np.full(len(poses), np.inf)
    centres = disc_centres(discs, poses)
    for k, (_, _, radius) in enumerate(discs):
        clearance = np.minimum(clearance, nearest_distance(centres[:, k], obstacles) - radius)
    return clearance

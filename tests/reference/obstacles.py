"""Obstacles in one image, and the body's room among obstacles, one point at a time."""

import math

import numpy as np
from numpy.typing import NDArray

from ippon.frame import Frame
from ippon.geometry import yaw_of
from ippon.planning.terrain.obstacle_columns import HeightBands
from ippon.robot import RobotProfile


def observed(
    frame: Frame, robot: RobotProfile, voxel_size: float, radius_m: float, step: int
) -> list[tuple[float, float]]:
    """Return the mean of the points in each column of voxels that holds four or more.

    Args:
        frame: Depth image and poses.
        robot: Its body.
        voxel_size: Edge of a column, metres.
        radius_m: Radius of the search.
        step: Pixels from one point to the next.
    """
    base = frame.T_world_base
    bands = HeightBands.of(robot, float(base[2, 3]), voxel_size)
    cells: dict[tuple[int, int], list[NDArray[np.float64]]] = {}
    for v in range(0, frame.depth.shape[0], step):
        for u in range(0, frame.depth.shape[1], step):
            z = float(frame.depth[v, u])
            if z < robot.min_depth_m:
                continue
            camera = frame.camera
            local = ((u - camera.cx) / camera.fx * z, (v - camera.cy) / camera.fy * z, z, 1.0)
            point = (frame.T_world_camera @ local)[:3]
            layer = math.floor(point[2] / voxel_size)
            away = math.dist(point[:2], base[:2, 3])
            if away > radius_m or not bands.body_low <= layer <= bands.body_high:
                continue
            if not is_inside(robot, base, point, 0.5 * voxel_size):
                cell = math.floor(point[0] / voxel_size), math.floor(point[1] / voxel_size)
                cells.setdefault(cell, []).append(point[:2])
    means = [np.mean(points, axis=0) for points in cells.values() if len(points) >= 4]
    return sorted((float(x), float(y)) for x, y in means)


def is_inside(
    robot: RobotProfile, T_world_base: NDArray[np.float64], point: NDArray[np.float64], by_m: float
) -> bool:
    """Tell whether a point lies at least `by_m` inside the body, seen from above."""
    yaw = yaw_of(T_world_base)
    for x, y, radius in robot.outline:
        centre = (
            T_world_base[0, 3] + x * math.cos(yaw) - y * math.sin(yaw),
            T_world_base[1, 3] + x * math.sin(yaw) + y * math.cos(yaw),
        )
        if math.dist(centre, point[:2]) <= radius - by_m:
            return True
    return False


def room(
    discs: list[tuple[float, float, float]],
    pose: tuple[float, float, float],
    obstacle: tuple[float, float],
) -> float:
    """Return the free space between discs of a body at one pose and one obstacle."""
    x, y, yaw = pose
    return min(
        math.dist(
            (
                x + dx * math.cos(yaw) - dy * math.sin(yaw),
                y + dx * math.sin(yaw) + dy * math.cos(yaw),
            ),
            obstacle,
        )
        - radius
        for dx, dy, radius in discs
    )

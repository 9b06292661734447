"""Instances of a goal, and the viewpoints from which they can be seen."""

import math

import numpy as np
from numpy.typing import NDArray

from ippon.guidance.language.naming import is_instance_of
from ippon.robot import RobotProfile
from ippon.simulation.camera.line_of_sight import LineOfSight
from ippon.simulation.robot.navigation_grid import NavigationGrid
from ippon.simulation.scene import Scene
from ippon.vocabulary import canonical_label

VIEWPOINT_DISTANCE_M = 1.0
"""Greatest horizontal distance from a viewpoint to the object's box."""

_LATTICE_M = 0.1
_SAMPLES = 96
_LEAST_SEEN = 0.03
"""Share of the points on an object's surface that must be visible."""


def matching_instances(scene: Scene, goal: str) -> tuple[int, ...]:
    """Return the rows of `scene.instances` whose label or category matches the goal.

    Args:
        scene: The home.
        goal: A label, for example "hat", "couch" or "chest of drawers".
    """
    wanted = canonical_label(goal)
    names = {name for i in scene.instances for name in (i.label, i.category)}
    answers = {name for name in names if is_instance_of(canonical_label(name), wanted)}
    return tuple(
        k for k, i in enumerate(scene.instances) if i.label in answers or i.category in answers
    )


def goal_viewpoints(
    scene: Scene,
    grid: NavigationGrid,
    robot: RobotProfile,
    instance: int,
    sight: LineOfSight,
) -> NDArray[np.float64]:
    """Return positions from which a robot sees an object by turning and tilting its camera.

    A viewpoint is a navigable position at most 1 m, measured on the floor, from the object's box,
    from which at least 3 % of points spread over the object's surface are in sight within the
    camera's tilt and vertical field of view (Habitat ObjectNav 2023).

    Args:
        scene: The home.
        grid: Where the robot's body fits.
        robot: Body and camera.
        instance: Row of `scene.instances`.
        sight: Line-of-sight tests in the home.

    Returns:
        (N, 2) metres, on a lattice of 0.1 m; empty if the object cannot be seen from close by.
    """
    positions = _near_positions(scene, grid, instance)
    points = _surface_points(scene, instance)
    if len(positions) == 0:
        return positions
    z = scene.start_poses[0].z if scene.start_poses else 0.0
    towards = points[None, :, :2] - positions[:, None, :]
    distance = np.linalg.norm(towards, axis=2)
    eyes = np.empty((*distance.shape, 3))
    forward = robot.camera_forward_m / np.maximum(distance, 1e-6)
    eyes[..., :2] = positions[:, None, :] + forward[..., None] * towards
    eyes[..., 2] = z + robot.camera_height_m
    elevation = np.arctan2(points[None, :, 2] - eyes[..., 2], distance - robot.camera_forward_m)
    half = 0.5 * robot.vertical_fov_rad
    in_view = (elevation >= robot.min_tilt_rad - half) & (elevation <= robot.max_tilt_rad + half)
    seen = np.zeros(distance.shape, np.bool_)
    targets = np.broadcast_to(points[None], eyes.shape)
    seen[in_view] = sight.is_clear(eyes[in_view], targets[in_view])
    return positions[seen.sum(axis=1) >= math.ceil(_LEAST_SEEN * len(points))]


def _near_positions(scene: Scene, grid: NavigationGrid, instance: int) -> NDArray[np.float64]:
    """Return free lattice cells within 1 m of an object's box, reachable from a start."""
    box = scene.instances[instance]
    reach = VIEWPOINT_DISTANCE_M
    i0, j0 = grid.cell_at(box.aabb_min[0] - reach, box.aabb_min[1] - reach)
    i1, j1 = grid.cell_at(box.aabb_max[0] + reach, box.aabb_max[1] + reach)
    step = max(1, round(_LATTICE_M / grid.cell_m))
    i0, j0 = max(i0, 0), max(j0, 0)
    i0, j0 = i0 + (-i0) % step, j0 + (-j0) % step
    window = grid.free[i0 : max(i1 + 1, 0) : step, j0 : max(j1 + 1, 0) : step]
    cells = np.argwhere(window) * step + np.array([i0, j0])
    points = grid.points_of(cells)
    dx = np.maximum(np.maximum(box.aabb_min[0] - points[:, 0], points[:, 0] - box.aabb_max[0]), 0)
    dy = np.maximum(np.maximum(box.aabb_min[1] - points[:, 1], points[:, 1] - box.aabb_max[1]), 0)
    return points[np.hypot(dx, dy) <= reach]


def _surface_points(scene: Scene, instance: int) -> NDArray[np.float64]:
    """Return points distributed over an object's triangles by area; deterministic."""
    triangles = scene.vertices[scene.faces[scene.face_instance == instance]].astype(np.float64)
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    rng = np.random.Generator(np.random.PCG64(0))
    share = (np.arange(_SAMPLES) + rng.random(_SAMPLES)) / _SAMPLES
    total = np.cumsum(area)
    if not total[-1] > 0.0:
        return triangles.mean(axis=1)[:_SAMPLES]
    row = np.minimum(np.searchsorted(total, share * total[-1]), len(area) - 1)
    u, v = rng.random((2, _SAMPLES, 1))
    fold = u + v > 1.0
    u, v = np.where(fold, 1.0 - u, u), np.where(fold, 1.0 - v, v)
    return a[row] + u * (b[row] - a[row]) + v * (c[row] - a[row])

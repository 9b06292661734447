"""Aligns the world of a hand-held camera with gravity and the floor, and puts a base below it."""

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from app.datasets.dataset import Dataset, DatasetError, read_depth
from ippon.camera import PinholeCamera
from ippon.geometry import Float64Array, base_pose, invert_transform, transform_points
from ippon.tracking.upright import UprightCheck

SAMPLED_FRAMES: Final = 12
EVERY_PIXEL: Final = 16
FLOOR_PERCENTILE: Final = 2.0

_View = tuple[NDArray[np.float32], Float64Array]
"""A depth image, metres, and T_up_camera."""


def align_to_floor(dataset: Dataset, floor_m: float | None = None) -> Float64Array:
    """Return T_map_world: z up, the floor at 0, the first camera above the origin.

    Args:
        dataset: The poses.
        floor_m: Height of the floor along up in the dataset's world; None estimates it.

    Raises:
        DatasetError: A depth image cannot be read, or the images show that up is down.
    """
    R = _rotation_to_z(np.array(dataset.up_world, np.float64))
    turned = np.eye(4)
    turned[:3, :3] = R
    every = max(1, len(dataset.frames) // SAMPLED_FRAMES)
    views = [
        (
            read_depth(frame.depth, dataset.depth_unit_m, dataset.camera),
            turned @ frame.T_world_camera,
        )
        for frame in dataset.frames[::every]
    ]
    _check_up(dataset, views)
    if floor_m is None:
        floor_m = _floor_height(dataset.camera, views)
    x, y, _ = (turned @ dataset.frames[0].T_world_camera)[:3, 3]
    turned[:3, 3] = (-x, -y, -floor_m)
    return turned


def base_below(T_map_camera: Float64Array) -> Float64Array:
    """Return T_map_base of a base on the floor below a camera, heading where it looks."""
    x, y, _ = T_map_camera[:3, 3]
    ahead = T_map_camera[:3, 2]
    if math.hypot(ahead[0], ahead[1]) < 1e-3:
        # The camera looks straight up or down: the upper edge of the image points ahead.
        ahead = -T_map_camera[:3, 1]
    return base_pose(float(x), float(y), 0.0, math.atan2(ahead[1], ahead[0]))


def camera_on_base(T_map_base: Float64Array, T_map_camera: Float64Array) -> Float64Array:
    """Return T_base_camera."""
    return invert_transform(T_map_base) @ T_map_camera


def _rotation_to_z(up: Float64Array) -> Float64Array:
    up = up / np.linalg.norm(up)
    across = np.cross(up, (0.0, 0.0, 1.0))
    sine, cosine = float(np.linalg.norm(across)), float(up[2])
    if sine < 1e-9:
        return np.eye(3) if cosine > 0.0 else np.diag([1.0, -1.0, -1.0])
    x, y, z = across / sine
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + sine * K + (1.0 - cosine) * (K @ K)


def _check_up(dataset: Dataset, views: Sequence[_View]) -> None:
    check = UprightCheck()
    for depth, T_up_camera in views:
        check.add_view(depth, dataset.camera, T_up_camera)
    if check.is_world_upside_down:
        raise DatasetError(
            f"{dataset.name}: its floor faces down by the depth of its images, so the world of its "
            "poses is upside down; in sequence.json, gravity_world is the direction in which "
            "things fall, [0, 0, -1] where the z axis points up"
        )


def _floor_height(camera: PinholeCamera, views: Sequence[_View]) -> float:
    """Return the height of the floor: a low percentile of the heights of the points."""
    v, u = np.mgrid[0 : camera.height : EVERY_PIXEL, 0 : camera.width : EVERY_PIXEL]
    heights: list[Float64Array] = []
    for image, T_up_camera in views:
        depth = image[v, u].astype(np.float64)
        seen = (depth > 0.3) & (depth < 5.0)
        z = depth[seen]
        rays = np.stack(
            [(u[seen] - camera.cx) / camera.fx, (v[seen] - camera.cy) / camera.fy], axis=1
        )
        points = np.column_stack([rays * z[:, None], z])
        heights.append(transform_points(T_up_camera, points)[:, 2])
    every_height = np.concatenate(heights)
    return float(np.percentile(every_height, FLOOR_PERCENTILE)) if len(every_height) else 0.0

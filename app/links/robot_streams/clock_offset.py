"""The offset between the clocks of camera and poses, from what the camera sees of a scene at rest.

Points of one depth image, carried into the next ones by the poses, must lie on their surfaces.
Where the poses are those of another moment they do not, if the robot turns at a rate that changes.
The offset is the one at which all images together fit best.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ippon.camera import PinholeCamera
from ippon.geometry import Float64Array, invert_transform

WIDEST_S: Final = 0.6
"""Clocks that are further apart are told by the delays of their messages."""
STEP_S: Final = 0.02
NEXT: Final = (1, 2)
"""Images that each image is compared with, counted from it."""
MOST_APART_S: Final = 1.0
LEAST_PAIRS: Final = 6
RESAMPLED: Final = 100
POINTS: Final = 1500
CUT_M: Final = 0.3
"""Distance from which a point counts as hidden or out of view; all of these count alike."""
LEAST_GAIN: Final = 0.1
"""Share by which the best offset must fit better than the others for there to be one."""
PoseAt = Callable[[int], Float64Array | None]
"""T_world_camera at a stamp of the poses' clock, None where it is not known."""
Stamped = tuple[int, NDArray[np.float32]]
Depths = Sequence[Stamped]


@dataclass(frozen=True, slots=True, kw_only=True)
class ClockOffset:
    """Estimate of the offset."""

    offset_s: float
    """To be added to the stamp of an image to get that of its pose."""
    error_s: float
    """Standard error, from the scatter between the pairs of images (bootstrap)."""
    pairs: int


def estimate_offset(depths: Depths, camera: PinholeCamera, pose_at: PoseAt) -> ClockOffset | None:
    """Return the offset; None where the robot has not turned to and fro, or none fits well.

    Args:
        depths: Stamps and depth images (H, W), metres, oldest first.
        camera: Intrinsics of the images.
        pose_at: Poses of the camera.
    """
    offsets = np.arange(-WIDEST_S, WIDEST_S + 0.5 * STEP_S, STEP_S)
    pose_of = cache(lambda i, k: pose_at(depths[i][0] + round(1e9 * float(offsets[k]))))
    rows: list[list[float]] = []
    for i, j in _pairs(depths):
        points = _points(depths[i][1], camera)
        poses = [(pose_of(i, k), pose_of(j, k)) for k in range(len(offsets))]
        rows.append([_misfit(points, depths[j][1], camera, *both) for both in poses])
    errors = np.array([row for row in rows if not np.isnan(row).any()])
    if len(errors) < LEAST_PAIRS:
        return None
    mean = errors.mean(0)
    best = int(np.argmin(mean))
    at_edge = best in (0, len(offsets) - 1)
    if at_edge or mean[best] > (1.0 - LEAST_GAIN) * float(np.median(mean)):
        return None
    rng = np.random.default_rng(0)
    again = [
        _lowest(offsets, errors[rng.integers(0, len(errors), len(errors))].mean(0))
        for _ in range(RESAMPLED)
    ]
    return ClockOffset(
        offset_s=_lowest(offsets, mean), error_s=float(np.std(again)), pairs=len(errors)
    )


def _pairs(depths: Depths) -> list[tuple[int, int]]:
    """Return each image with the ones that follow it."""
    return [
        (i, i + k)
        for k in NEXT
        for i in range(len(depths) - k)
        if depths[i + k][0] - depths[i][0] <= round(1e9 * MOST_APART_S)
    ]


def _points(depth: NDArray[np.float32], camera: PinholeCamera) -> Float64Array:
    """Return some points of an image in its camera's frame, (N, 3) metres."""
    v, u = np.nonzero(depth > 0.0)
    every = max(1, len(v) // POINTS)
    v, u = v[::every], u[::every]
    return camera.lift(u, v, depth[v, u].astype(np.float64))


def _misfit(
    points: Float64Array,
    depth: NDArray[np.float32],
    camera: PinholeCamera,
    T_world_first: Float64Array | None,
    T_world_second: Float64Array | None,
) -> float:
    """Return the mean distance, cut at `CUT_M`, of the first image's points from the second."""
    if T_world_first is None or T_world_second is None:
        return float("nan")
    T = invert_transform(T_world_second) @ T_world_first
    x, y, z = (points @ T[:3, :3].T + T[:3, 3]).T
    ahead = z > 0.1
    u = np.round(camera.fx * x[ahead] / z[ahead] + camera.cx).astype(int)
    v = np.round(camera.fy * y[ahead] / z[ahead] + camera.cy).astype(int)
    height, width = depth.shape
    inside = (u >= 0) & (u < width) & (v >= 0) & (v < height)
    seen = depth[v[inside], u[inside]]
    apart = np.abs(z[ahead][inside] - seen)[seen > 0.0]
    if len(apart) < max(1.0, 0.1 * len(points)):
        return float("nan")
    return float(np.mean(np.minimum(apart, CUT_M)))


def _lowest(offsets: NDArray[np.float64], errors: NDArray[np.float64]) -> float:
    """Return the offset of the least error, between the steps."""
    k = min(max(int(np.argmin(errors)), 1), len(errors) - 2)
    before, at, after = errors[k - 1 : k + 2]
    curvature = before - 2.0 * at + after
    shift = 0.0 if curvature <= 0.0 else float(np.clip(0.5 * (before - after) / curvature, -1, 1))
    return float(offsets[k] + STEP_S * shift)

"""Where an image of a detector recognises an object, as points on the surface."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from ippon.frame import Frame
from ippon.geometry import Float64Array, transform_points
from ippon.mission.snapshot import Find
from ippon.observation_model import ObservationModels

_MOST: Final = 64
"""Points that are kept of an image."""


def recognised_points(frame: Frame, label: str, models: ObservationModels) -> Float64Array:
    """Return the points of the surface at which a detector recognises the object.

    Args:
        frame: With a heatmap of kind `scores`.
        label: The object's label in it.
        models: Observation models of the networks.

    Returns:
        (N, 3) world, metres: those of the heatmap's pixels whose score speaks for the object.
    """
    heatmap, camera = frame.heatmap, frame.camera
    channel = None if heatmap is None else heatmap.channel_of(label)
    if heatmap is None or channel is None:
        return np.zeros((0, 3))
    scores = heatmap.probabilities[:, :, channel]
    speaks_for = models.of(heatmap).table_of(label).log_ratios("scores") > 0.0
    row, column = np.nonzero(speaks_for[scores])
    v = _pixels(row, scores.shape[0], camera.height)
    u = _pixels(column, scores.shape[1], camera.width)
    depth = frame.depth[v, u].astype(np.float64)
    known = np.isfinite(depth) & (depth > 0.0)
    u, v, depth = u[known], v[known], depth[known]
    return transform_points(frame.T_world_camera, camera.lift(u, v, depth))


def points_at(points_world: Float64Array, find: Find, margin_m: float) -> Float64Array:
    """Return the recognised points at a find.

    Args:
        points_world: (N, 3) from `recognised_points`, metres.
        find: A candidate.
        margin_m: Distance from the ball around its box within which points belong to it.

    Returns:
        (M, 2) world x and y, metres, an even sample of at most 64.
    """
    reach_m = 0.5 * float(np.linalg.norm(find.size_m)) + margin_m
    away = np.linalg.norm(points_world - np.array(find.position_world), axis=1)
    near = np.flatnonzero(away <= reach_m)
    if len(near) > _MOST:
        near = near[np.linspace(0, len(near) - 1, _MOST).astype(np.int64)]
    return points_world[near, :2]


def _pixels(cells: NDArray[np.intp], count: int, pixels: int) -> NDArray[np.int64]:
    """Return the image's pixels in the middle of cells of the heatmap, along one axis."""
    return np.floor((cells + 0.5) * pixels / count).astype(np.int64)

"""The best picture of a thing: large, whole, in the middle of the image, and not hidden."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ippon.frame import Frame
from ippon.geometry import Float64Array, invert_transform, transform_points
from ippon.memory.instance import Instance

BETTER: Final = 1.3
"""A picture replaces one whose score is this much lower."""
_REACH_M: Final = 6.0
_NEAREST_M: Final = 0.2
_LEAST_WHOLE: Final = 0.6
"""Share of a thing's box that the image must hold."""
_MARGIN: Final = 0.25
"""Of the box's longer side, on each side."""
_LEAST_PX: Final = 24
"""Shorter side of what a picture shows."""
_LEAST_SCORE: Final = 1e-3
_EDGE_M: Final = 0.05
"""Depth that lies this far outside a thing's box may still be the thing's."""
_SAMPLES: Final = 8
"""Pixels along each side of the image's box at which depth is looked at."""
_LEAST_SHOWN: Final = 0.15
"""Share of them that lie in the thing's box; what is thin fills little of it."""
_CORNERS: Final = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * 0.5


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BestView:
    """A picture of a thing."""

    instance_id: int
    score: float
    """Share of the image that the thing takes, less where it is cut off or off the middle."""
    color: NDArray[np.uint8]
    """(h, w, 3) RGB."""


def better_views(
    frame: Frame, instances: Iterable[Instance], at_most: int = 3
) -> tuple[BestView, ...]:
    """Return the pictures in a frame that are better than those there are, the best gains first.

    Args:
        frame: Colour, depth and pose.
        instances: Things, with the scores of their pictures.
        at_most: Number of pictures.
    """
    camera_at = frame.T_world_camera[:3, 3]
    here = [one for one in instances if not one.is_gone]
    if not here:
        return ()
    centres = np.array([one.position_world for one in here])
    near = np.flatnonzero(np.linalg.norm(centres - camera_at, axis=1) <= _REACH_M)
    T_camera_world = invert_transform(frame.T_world_camera)
    found: list[tuple[float, Instance, tuple[float, float, float, float]]] = []
    for k in near.tolist():
        one = here[k]
        box = _box_of(frame, T_camera_world, one)
        if box is None:
            continue
        score = _score(frame, box)
        if score >= max(_LEAST_SCORE, BETTER * one.view_score) and _is_visible(frame, one, box):
            found.append((score, one, box))
    found.sort(key=lambda view: view[1].view_score - view[0])
    return tuple(
        BestView(instance_id=one.instance_id, score=score, color=_crop(frame, box))
        for score, one, box in found[:at_most]
    )


def _box_of(
    frame: Frame, T_camera_world: Float64Array, one: Instance
) -> tuple[float, float, float, float] | None:
    """Return the pixel box (u0, v0, u1, v1) of a thing; None where it reaches behind the camera."""
    corners = np.array(one.position_world) + _CORNERS * np.array(one.size_m)
    points = transform_points(T_camera_world, corners)
    if points[:, 2].min() < _NEAREST_M:
        return None
    u, v = frame.camera.project(points)
    return float(u.min()), float(v.min()), float(u.max()), float(v.max())


def _score(frame: Frame, box: tuple[float, float, float, float]) -> float:
    """Return how good a picture is; 0 where the image cuts most of the thing off."""
    u0, v0, u1, v1 = box
    width, height = frame.camera.width, frame.camera.height
    wide = min(u1, width) - max(u0, 0.0)
    high = min(v1, height) - max(v0, 0.0)
    if wide <= 0.0 or high <= 0.0:
        return 0.0
    whole = wide * high / max((u1 - u0) * (v1 - v0), 1e-9)
    off = max(abs(0.5 * (u0 + u1) / width - 0.5), abs(0.5 * (v0 + v1) / height - 0.5))
    return wide * high / (width * height) * (1.0 - off) * whole if whole >= _LEAST_WHOLE else 0.0


def _is_visible(frame: Frame, one: Instance, box: tuple[float, float, float, float]) -> bool:
    """Return whether depth shows enough of the thing's box, and not what is before or behind it."""
    width, height = frame.camera.width, frame.camera.height
    shares = (np.arange(_SAMPLES) + 0.5) / _SAMPLES
    u0, v0 = max(box[0], 0.0), max(box[1], 0.0)
    u, v = np.meshgrid(
        u0 + shares * (min(box[2], width) - u0), v0 + shares * (min(box[3], height) - v0)
    )
    u, v = u.ravel(), v.ravel()
    depth = frame.depth[v.astype(np.intp), u.astype(np.intp)].astype(np.float64)
    seen = transform_points(frame.T_world_camera, frame.camera.lift(u, v, depth))
    off = seen - np.array(one.position_world)
    inside = (np.abs(off) <= 0.5 * np.array(one.size_m) + _EDGE_M).all(axis=1) & (depth > 0.0)
    return float(inside.mean()) >= _LEAST_SHOWN


def _crop(frame: Frame, box: tuple[float, float, float, float]) -> NDArray[np.uint8]:
    u0, v0, u1, v1 = box
    margin = max(_MARGIN * max(u1 - u0, v1 - v0), 0.5 * (_LEAST_PX - min(u1 - u0, v1 - v0)))
    left, top = max(0, int(u0 - margin)), max(0, int(v0 - margin))
    right, bottom = int(u1 + margin) + 1, int(v1 + margin) + 1
    return np.ascontiguousarray(frame.color[top:bottom, left:right])

"""Which of the candidates a search has ended at, and where it is."""

import dataclasses
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from ippon.frame import Frame
from ippon.geometry import Float64Array
from ippon.mission.snapshot import Find

SUCCESS_M = 1.0
"""An object this near, over the floor, is reached: the metre of the task."""
ARRIVED_M = SUCCESS_M + 0.1
"""What a robot that has arrived at a terminating viewpoint sees within the metre begins this near:
it stops within its tolerance of the viewpoint."""
FIND_WITHIN_M = 2.5
"""A find lies at most this far from where the search ended."""
AROUND_M = 0.2
"""Ruled out beyond what was seen of a rejected find, and closer than this to it lies its rest."""
REST_SHARE = 0.25
"""Of a large find the rest may lie farther: within this share of the radius that is ruled out."""
LOOKED_AT_RADIUS_M = 0.75
"""Ruled out round where the robot looks, when a find without voxels is rejected."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Ball:
    """A place that is ruled out."""

    centre_world: Float64Array
    radius_m: float

    def touches(self, find: Find) -> bool:
        """Tell whether a find begins where this ends: then it is more of the same thing."""
        gap_m = _gap_m(self.centre_world, find) - self.radius_m
        return gap_m <= max(AROUND_M, REST_SHARE * self.radius_m)


def ball_round(find: Find) -> Ball:
    """Return what rejecting a find rules out."""
    return Ball(
        centre_world=np.array(find.position_world),
        radius_m=0.5 * math.hypot(*find.size_m) + AROUND_M,
    )


def nearest_find(
    candidates: Iterable[Find], T_world_base: Float64Array, within_m: float = FIND_WITHIN_M
) -> Find | None:
    """Return the largest candidate near the robot, those in view first; None where none is near."""
    near = [f for f in candidates if distance_m(T_world_base, f) < within_m]
    in_view = [f for f in near if f.box_px is not None] or near
    return max(in_view, key=lambda f: f.voxels, default=None)


def reached_find(candidates: Iterable[Find], T_world_base: Float64Array) -> Find | None:
    """Return the candidate that a terminating viewpoint has led to.

    A larger one may stand behind what is in reach, and say nothing of it: a chair behind a stool.

    Args:
        candidates: What looks like the object.
        T_world_base: Where the robot stands, at the viewpoint.

    Returns:
        The largest in view and in reach; None where there is none.
    """
    reached = (
        find
        for find in candidates
        if find.box_px is not None and _gap_m(T_world_base[:2, 3], find) <= ARRIVED_M
    )
    return max(reached, key=lambda find: find.voxels, default=None)


def find_from(candidates: Iterable[Find], T_world_base: Float64Array, away_m: float) -> Find | None:
    """Return the candidate that a search ends at which no way leads closer to.

    Args:
        candidates: What looks like the object.
        T_world_base: Where the robot stands, as near to it as it can.
        away_m: Metres over the floor from there to the object.

    Returns:
        The find, out of reach where it is farther than `SUCCESS_M`; None where none is that near.
    """
    find = nearest_find(candidates, T_world_base, max(FIND_WITHIN_M, away_m + 1.0))
    if find is None or away_m <= SUCCESS_M:
        return find
    return dataclasses.replace(find, out_of_reach_m=away_m)


def distance_m(T_world_base: Float64Array, find: Find) -> float:
    """Return how far a find is from the base, over the floor."""
    x, y, _ = find.position_world
    return math.hypot(x - T_world_base[0, 3], y - T_world_base[1, 3])


def _gap_m(at: Float64Array, find: Find) -> float:
    """Return how far a find's nearest side is from a point (3,), or, over the floor, (2,)."""
    axes = len(at)
    outside = np.abs(at - find.position_world[:axes]) - 0.5 * np.array(find.size_m[:axes])
    return float(np.linalg.norm(np.maximum(outside, 0.0)))


def looked_at(frame: Frame) -> Float64Array:
    """Return the point (3,) in the world that is in the middle of the image, metres."""
    rows, columns = frame.depth.shape
    middle = frame.depth[rows // 3 : rows - rows // 3, columns // 3 : columns - columns // 3]
    seen = middle[np.isfinite(middle) & (middle > 0.0)]
    away = min(float(np.median(seen)), FIND_WITHIN_M) if seen.size else 0.5 * FIND_WITHIN_M
    return frame.T_world_camera[:3, 3] + away * frame.T_world_camera[:3, 2]


def out_of_reach_text(display: str, away_m: float) -> str:
    """Say that an object was found that no way leads close to."""
    return f"found {display}, out of reach: {away_m:.1f} m from the nearest place I can stand"


def exhausted_text(display: str, candidates: Sequence[Find], *, full: bool = False) -> str:
    """Say why a search ended without a find.

    Args:
        display: The object, as the operator reads it.
        candidates: What looks like it, most voxels first.
        full: There was no place for viewpoints farther away.
    """
    why = "everything reachable was seen"
    if full:
        why = "no viewpoint is left, and no place for more (planner.max_nodes)"
    text = f"{display} not found: {why}"
    if not candidates:
        return text
    x, y, _ = candidates[0].position_world
    return f"{text}; no way leads close to what looks most like it, at ({x:.1f}, {y:.1f}) m"

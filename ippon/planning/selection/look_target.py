"""Standing at a viewpoint to look at one point, rather than at what promises the most."""

import math
from dataclasses import dataclass
from typing import Final

from ippon.geometry import Float64Array, wrap_angle, yaw_of

SIGHT_TRIES: Final = 12
"""Viewpoints whose line of sight is checked in a step at most."""
STAY_S: Final = 1.0
"""Another viewpoint must be this much better."""
_THERE_M: Final = 0.25
_FACING_RAD: Final = 0.35
_SAME_M: Final = 0.5
"""What was looked at moved less than this, over the floor: it is the same thing."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Look:
    """A viewpoint to go to, and where to look from it."""

    node: int
    yaw_rad: float
    tilt_rad: float
    away_m: float | None = None
    """The search may end there: metres over the floor to the object, as near as a way leads. None
    while a way round is tried."""


def look_at(
    node: int,
    xy: Float64Array,
    point_world: Float64Array,
    eye_z_m: float,
    away_m: float | None = None,
) -> Look:
    """Look from viewpoint `node` at `xy` (2,), the camera at height `eye_z_m`, at a point (3,)."""
    yaw, tilt = towards(xy, point_world, eye_z_m)
    return Look(node=node, yaw_rad=yaw, tilt_rad=tilt, away_m=away_m)


def towards(xy: Float64Array, point_world: Float64Array, eye_z_m: float) -> tuple[float, float]:
    """Return yaw and tilt from a camera over (2,), at height `eye_z_m`, to a point (3,)."""
    dx, dy = point_world[:2] - xy
    return math.atan2(dy, dx), math.atan2(point_world[2] - eye_z_m, max(math.hypot(dx, dy), 0.1))


def stands_facing(T_world_base: Float64Array, xy: Float64Array, yaw_rad: float) -> bool:
    """Tell whether the robot stands at (2,) and looks that way."""
    there = math.dist(xy, T_world_base[:2, 3]) < _THERE_M
    return there and abs(wrap_angle(yaw_rad - yaw_of(T_world_base))) < _FACING_RAD


def is_same(one: Float64Array, other: Float64Array) -> bool:
    """Tell whether two centres (3,) are those of one thing that is seen better by and by."""
    return math.dist(one[:2], other[:2]) <= _SAME_M

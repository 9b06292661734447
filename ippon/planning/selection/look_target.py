"""A viewpoint from which the robot looks at one point, instead of in the direction of its gain."""

import math
from dataclasses import dataclass
from typing import Final

from ippon.geometry import Float64Array, wrap_angle, yaw_of

_STOREY_M: Final = 2.0
"""Difference in height from which things lie on different floors of a building."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LookConfig:
    """How a viewpoint with a line of sight to a point is chosen and reached."""

    max_viewpoints: int = 12
    """Viewpoints whose line of sight is checked in a step at most; more finds one in narrower
    places and takes longer."""
    sight_points: int = 6
    """Voxels of a cluster that lines of sight are checked to; more finds clusters that are mostly
    hidden."""
    detour_factor: float = 1.5
    """Assumed length of the path from the viewpoint to the object, in straight lines between them;
    more prefers viewpoints near the object to viewpoints near the robot."""
    keep_s: float = 1.0
    """Travel time by which another viewpoint must be better; more changes it less often."""
    reached_m: float = 0.25
    """Distance from the viewpoint within which the robot has reached it; more stops earlier."""
    facing_rad: float = 0.35
    """Deviation from the heading up to which the robot faces the point; more turns less."""
    same_cluster_m: float = 0.5
    """Distance over the floor up to which two centres belong to the same object, more of which is
    seen by and by; more merges neighbouring objects."""

    def __post_init__(self) -> None:
        """Reject counts and distances without meaning."""
        if self.max_viewpoints < 1 or self.sight_points < 1:
            raise ValueError(
                "max_viewpoints and sight_points must be at least 1; got "
                f"{self.max_viewpoints}, {self.sight_points}"
            )
        if min(self.reached_m, self.facing_rad) <= 0.0:
            raise ValueError(
                f"reached_m and facing_rad must be above 0; got {self.reached_m}, {self.facing_rad}"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class LookTarget:
    """A viewpoint to go to, and where to look from it."""

    node: int
    yaw_rad: float
    tilt_rad: float
    away_m: float | None = None
    """Where the search may end with an object out of reach: metres over the floor from the
    viewpoint to the object. None while a closer viewpoint may exist."""


def look_at(
    node: int,
    xy: Float64Array,
    point_world: Float64Array,
    camera_z_m: float,
    away_m: float | None = None,
) -> LookTarget:
    """Return viewpoint `node` at `xy` (2,) with the camera directed at a (3,) point."""
    yaw, tilt = yaw_tilt_to(xy, point_world, camera_z_m)
    return LookTarget(node=node, yaw_rad=yaw, tilt_rad=tilt, away_m=away_m)


def yaw_tilt_to(
    xy: Float64Array, point_world: Float64Array, camera_z_m: float
) -> tuple[float, float]:
    """Return yaw and tilt from a camera over (2,) at a height to a (3,) point, radians."""
    dx, dy = point_world[:2] - xy
    yaw = math.atan2(dy, dx)
    return yaw, math.atan2(point_world[2] - camera_z_m, max(math.hypot(dx, dy), 0.1))


def stands_facing(
    config: LookConfig, T_world_base: Float64Array, xy: Float64Array, yaw_rad: float
) -> bool:
    """Return whether the robot stands at (2,) with this heading."""
    reached = math.dist(xy, T_world_base[:2, 3]) < config.reached_m
    return reached and abs(wrap_angle(yaw_rad - yaw_of(T_world_base))) < config.facing_rad


def is_same_cluster(config: LookConfig, one: Float64Array, other: Float64Array) -> bool:
    """Return whether two (3,) centres may belong to clusters of the same object."""
    same_storey = abs(one[2] - other[2]) < _STOREY_M
    return bool(same_storey and math.dist(one[:2], other[:2]) <= config.same_cluster_m)

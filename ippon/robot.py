"""Robot profile: body, motion limits and camera mount."""

import math
from dataclasses import dataclass, fields
from functools import lru_cache
from typing import Final

import numpy as np

from ippon.geometry import R_BASE_CAMERA_LEVEL, Float64Array, make_transform, rotation_y

LEAST_STEP_M: Final = 0.01
"""Least value of `max_step_m`: unevenness of floors and accuracy of the map."""
MOST_M: Final = 30.0
MOST_SPHERES: Final = 500
"""Limit, because every sphere is checked for every command."""
_ROUND_SHARE: Final = 0.9
"""Ratio of width to circumscribed circle from which a body counts as round."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CollisionSphere:
    """A sphere of the robot's body in the base frame, whose origin is on the floor."""

    x_m: float
    y_m: float
    z_m: float
    radius_m: float


@lru_cache(maxsize=16)
def _outermost(spheres: tuple[CollisionSphere, ...]) -> tuple[tuple[float, float, float], ...]:
    """Return the discs (x, y, radius) of spheres from above that no other disc contains.

    Cached: a body of 200 spheres takes 13 ms, and the discs are used several times per step.
    """
    discs = {(s.x_m, s.y_m, s.radius_m) for s in spheres}
    return tuple(sorted(d for d in discs if not any(_holds(e, d) for e in discs - {d})))


def _holds(outer: tuple[float, float, float], inner: tuple[float, float, float]) -> bool:
    """Tell whether a disc (x, y, radius) contains another one."""
    return math.dist(outer[:2], inner[:2]) + inner[2] <= outer[2]


def disc_centres(
    discs: tuple[tuple[float, float, float], ...], poses: Float64Array
) -> Float64Array:
    """Return the world positions of discs of the body.

    Args:
        discs: (x, y, radius) in the base frame, metres, as in `RobotProfile.outline`.
        poses: (N, 3) world x, y and yaw of the base.

    Returns:
        (N, K, 2) world x and y of each disc's centre at each pose, metres.
    """
    dx, dy, _ = np.array(discs, dtype=np.float64).T
    c, s = np.cos(poses[:, 2:]), np.sin(poses[:, 2:])
    x = poses[:, :1] + c * dx - s * dy
    y = poses[:, 1:2] + s * dx + c * dy
    return np.stack([x, y], axis=2)


def upright_body(
    radius_m: float, height_m: float, clearance_m: float
) -> tuple[CollisionSphere, ...]:
    """Fill an upright cylinder with spheres.

    Args:
        radius_m: Radius of the cylinder.
        height_m: Its top above the floor.
        clearance_m: Height above the floor that the body steps or rolls over.
    """
    if height_m - clearance_m < 2.0 * radius_m:
        return _flat_body(radius_m, height_m, clearance_m)
    lowest = clearance_m + radius_m
    highest = height_m - radius_m
    count = max(1, math.ceil((highest - lowest) / radius_m) + 1)
    return tuple(
        CollisionSphere(x_m=0.0, y_m=0.0, z_m=float(z), radius_m=radius_m)
        for z in np.linspace(lowest, highest, count)
    )


def _flat_body(radius_m: float, height_m: float, clearance_m: float) -> tuple[CollisionSphere, ...]:
    """Fill a cylinder that is wider than high with spheres of its height, inside and at its rim."""
    ball_m = 0.5 * (height_m - clearance_m)
    ring_m = radius_m - ball_m
    count = math.ceil(2.0 * math.pi * ring_m / ball_m)
    turns = [2.0 * math.pi * k / count for k in range(count)]
    places = [(0.0, 0.0), *((ring_m * math.cos(a), ring_m * math.sin(a)) for a in turns)]
    return tuple(
        CollisionSphere(x_m=x, y_m=y, z_m=clearance_m + ball_m, radius_m=ball_m) for x, y in places
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotProfile:
    """Body, limits and camera mount of a robot. Metres and radians."""

    name: str
    spheres: tuple[CollisionSphere, ...]
    """Spheres that enclose the body; all stay free of obstacles."""
    max_linear_m_s: float
    max_yaw_rate_rad_s: float
    max_tilt_rate_rad_s: float
    max_linear_acceleration_m_s2: float = 0.8
    max_yaw_acceleration_rad_s2: float = 2.0
    min_tilt_rad: float = -1.2
    """Lowest camera tilt (negative is down); equal to `max_tilt_rad` for a fixed camera."""
    max_tilt_rad: float = 0.43
    camera_height_m: float = 1.2
    """Height of the camera's tilt axis above the floor."""
    camera_forward_m: float = 0.0
    """Distance of the tilt axis in front of the base's centre."""
    horizontal_fov_rad: float = math.radians(74.0)
    image_aspect: float = 1.6
    """Width over height of the camera image."""
    min_depth_m: float = 0.3
    max_depth_m: float = 5.0
    max_step_m: float = 0.08
    """Highest step, up or down, that the base drives over."""
    can_reverse: bool = True
    takes_velocities: bool = True
    """The base follows velocities."""
    takes_goals: bool = False
    """The robot navigates by itself: it is sent goals, and velocities only by hand."""
    tracks_pose: bool = False
    """The camera knows no pose: it is tracked by its images."""

    def __post_init__(self) -> None:
        """Reject invalid bodies and limits."""
        if not self.spheres or any(s.radius_m <= 0.0 for s in self.spheres):
            raise ValueError("a robot needs at least one collision sphere of positive radius")
        if len(self.spheres) > MOST_SPHERES:
            raise ValueError(
                f"a body is at most {MOST_SPHERES} spheres; this one would need "
                f"{len(self.spheres)}: it is far wider than high, or far higher than wide"
            )
        numbers = [getattr(self, field.name) for field in fields(self) if field.type is float]
        if not all(math.isfinite(number) for number in (*numbers, *self._lengths())):
            raise ValueError("every length, angle and speed of a robot is a finite number")
        positive = (
            "max_linear_m_s", "max_yaw_rate_rad_s", "max_tilt_rate_rad_s", "camera_height_m",
            "max_linear_acceleration_m_s2", "max_yaw_acceleration_rad_s2", "image_aspect",
        )  # fmt: skip
        for name in positive:
            if not getattr(self, name) > 0.0:
                raise ValueError(f"{name} must be positive; got {getattr(self, name):g}")
        if not -0.5 * math.pi <= self.min_tilt_rad <= self.max_tilt_rad <= 0.5 * math.pi:
            raise ValueError(
                "the camera tilts from min_tilt_rad to max_tilt_rad, both from -90 to 90 degrees; "
                f"got {math.degrees(self.min_tilt_rad):.4g} and "
                f"{math.degrees(self.max_tilt_rad):.4g} degrees"
            )
        if not 0.0 < self.horizontal_fov_rad < math.pi:
            raise ValueError(
                "a camera sees between 0 and 180 degrees; got "
                f"{math.degrees(self.horizontal_fov_rad):.4g}"
            )
        if not 0.0 < self.min_depth_m < self.max_depth_m:
            raise ValueError(
                "min_depth_m must lie between 0 and max_depth_m; got "
                f"{self.min_depth_m:g} and {self.max_depth_m:g}"
            )
        if not LEAST_STEP_M <= self.max_step_m <= 1.0:
            raise ValueError(
                f"max_step_m lies in {LEAST_STEP_M:g} to 1, since maps are accurate to about 1 cm; "
                f"got {self.max_step_m:g}"
            )
        if not all(-MOST_M <= x <= MOST_M for x in self._lengths()):
            raise ValueError(f"lengths are metres, at most {MOST_M:g}; is one in millimetres?")

    def _lengths(self) -> list[float]:
        body = [x for s in self.spheres for x in (s.x_m, s.y_m, s.z_m, s.radius_m)]
        return [*body, self.camera_height_m, self.camera_forward_m, self.max_depth_m]

    @property
    def radius_m(self) -> float:
        """Radius of the circle around the base's centre that contains every sphere."""
        return max(math.hypot(s.x_m, s.y_m) + s.radius_m for s in self.spheres)

    @property
    def half_width_m(self) -> float:
        """Largest lateral extent of the body from the line that the base's centre drives on."""
        return max(abs(s.y_m) + s.radius_m for s in self.spheres)

    @property
    def is_carried(self) -> bool:
        """Whether a person carries the camera: nothing takes commands."""
        return not (self.takes_velocities or self.takes_goals)

    @property
    def follows_goals(self) -> bool:
        """Whether goals lead it, not velocities: it navigates by itself, or is carried."""
        return self.takes_goals or self.is_carried

    @property
    def is_round(self) -> bool:
        """Whether the body can turn anywhere, so that its heading is irrelevant to clearance."""
        return self.half_width_m > _ROUND_SHARE * self.radius_m

    @property
    def inscribed_radius_m(self) -> float:
        """Radius of the circle that fits wherever the body can drive straight."""
        return self.radius_m if self.is_round else self.half_width_m

    @property
    def outline(self) -> tuple[tuple[float, float, float], ...]:
        """Discs that cover the body seen from above: x, y in the base frame and radius, metres.

        One circle for a body that is round or nearly so: its heading does not matter then.
        """
        return ((0.0, 0.0, self.radius_m),) if self.is_round else _outermost(self.spheres)

    @property
    def height_m(self) -> float:
        """Height of the body's top above the floor."""
        return max(s.z_m + s.radius_m for s in self.spheres)

    @property
    def can_tilt(self) -> bool:
        """Whether the camera tilts."""
        return self.min_tilt_rad < self.max_tilt_rad

    @property
    def vertical_fov_rad(self) -> float:
        """Vertical field of view of the camera."""
        return 2.0 * math.atan(math.tan(0.5 * self.horizontal_fov_rad) / self.image_aspect)

    @property
    def floor_in_view_m(self) -> float:
        """Distance from the base's centre to the nearest floor that the camera sees, metres.

        0 if it is under the camera; infinite if the camera cannot be tilted low enough, or the
        floor is out of range.
        """
        lowest = self.min_tilt_rad - 0.5 * self.vertical_fov_rad
        steepest = min(-lowest, 0.5 * math.pi)
        if lowest >= 0.0 or self.camera_height_m / math.sin(steepest) > self.max_depth_m:
            return math.inf
        ahead = 0.0
        if lowest > -0.5 * math.pi:
            ahead = self.camera_height_m / math.tan(-lowest)
        # Depth is measured along the optical axis, and not below `min_depth_m`.
        down = -self.min_tilt_rad
        too_near_m = self.min_depth_m - self.camera_height_m * math.sin(down)
        if math.cos(down) > 1e-6:
            ahead = max(ahead, too_near_m / math.cos(down))
        return max(0.0, self.camera_forward_m + ahead)

    def within_tilt(self, tilt_rad: float) -> float:
        """Return a tilt clamped to the camera's range."""
        return min(max(tilt_rad, self.min_tilt_rad), self.max_tilt_rad)

    def T_base_camera(self, tilt_rad: float) -> Float64Array:  # noqa: N802
        """Return the (4, 4) pose of the camera in the base frame for a tilt (positive up)."""
        return make_transform(
            rotation_y(-tilt_rad) @ R_BASE_CAMERA_LEVEL,
            (self.camera_forward_m, 0.0, self.camera_height_m),
        )


ZED = RobotProfile(
    name="zed",
    spheres=upright_body(0.25, 1.2, 0.06),
    max_linear_m_s=0.8,
    max_yaw_rate_rad_s=1.2,
    max_tilt_rate_rad_s=1.2,
)
"""The robot of the paper: a ZED X at 1.2 m on a base with walking speed."""

HABITAT = RobotProfile(
    name="habitat",
    spheres=upright_body(0.17, 1.41, 0.1),
    max_linear_m_s=0.3,
    max_yaw_rate_rad_s=0.45,
    max_tilt_rate_rad_s=0.45,
    min_tilt_rad=-1.57,
    max_tilt_rad=0.43,
    camera_height_m=1.31,
    horizontal_fov_rad=math.radians(42.0),
    image_aspect=0.75,
    min_depth_m=0.5,
    max_step_m=0.1,
    can_reverse=False,
)
"""The Stretch of the Habitat ObjectNav Challenge 2023."""

"""How close the robot's body may come to things, and how fast it drives beside them."""

from typing import Final, NamedTuple

import numpy as np
from numba import njit

from ippon.geometry import Float64Array
from ippon.robot import RobotProfile

NO_DISCS: Final[Float64Array] = np.zeros((0, 4))
"""Discs of a body that is a circle, or so nearly one that its heading does not matter."""


class BodyLimits(NamedTuple):
    """How close the body may come to things, and how that slows it down.

    A long body turns only where the circle that holds it has room, but drives straight ahead
    wherever its discs do: through doors that are narrower than it is long.
    """

    radius: float
    """Radius of the circle that holds the body, metres."""
    unseen_radius: float
    """Unseen floor must be this far from the centre, metres; below the radius, since the
    cells along a wall's foot often stay unseen."""
    slow_clearance: float
    """Free space beside the body below which the robot slows down, metres."""
    slow_fraction: float
    """Fraction of the top speed that is left when something all but touches."""
    speed: float
    """Top speed, metres a second."""
    half_width: float = 0.0
    """Half of what a long body needs to either side, metres; of a round one `radius` says it."""
    unseen_half_width: float = 0.0
    """Of a long body, what `unseen_radius` is of the circle."""
    discs: Float64Array = NO_DISCS
    """(K, 4) a long body from above, driven either way: x and y before and beside the base's
    centre, radius, and how far from there unseen floor must be, metres."""


def body_limits_of(
    robot: RobotProfile, *, unseen_overlap_m: float, slow_clearance_m: float, slow_fraction: float
) -> BodyLimits:
    """Return how close a robot's body may come to things.

    Args:
        robot: Its collision spheres and top speed.
        unseen_overlap_m: How far each disc of the body may reach over unseen floor, metres, up to
            half its radius.
        slow_clearance_m: See `BodyLimits.slow_clearance`.
        slow_fraction: See `BodyLimits.slow_fraction`.
    """

    def to_unseen(radius: float) -> float:
        return max(0.5 * radius, radius - unseen_overlap_m)

    limits = BodyLimits(
        radius=robot.radius_m,
        unseen_radius=to_unseen(robot.radius_m),
        slow_clearance=slow_clearance_m,
        slow_fraction=slow_fraction,
        speed=robot.max_linear_m_s,
    )
    if robot.is_round:
        return limits
    # Driven either way: an edge of the roadmap is for both directions.
    discs = sorted({(k * x, k * y, r, to_unseen(r)) for x, y, r in robot.outline for k in (1, -1)})
    return limits._replace(
        half_width=robot.half_width_m,
        unseen_half_width=to_unseen(robot.half_width_m),
        discs=np.array(discs, dtype=np.float64),
    )


@njit(cache=True, nogil=True)
def inscribed_radius(limits: BodyLimits) -> float:
    """Return the radius of the circle that fits wherever the body can drive straight ahead."""
    return limits.radius if limits.discs.shape[0] == 0 else limits.half_width


@njit(cache=True, nogil=True)
def inscribed_unseen_radius(limits: BodyLimits) -> float:
    """Return how far from the centre of that circle unseen floor must be."""
    return limits.unseen_radius if limits.discs.shape[0] == 0 else limits.unseen_half_width


@njit(cache=True, nogil=True)
def speed_at(limits: BodyLimits, beside: float) -> float:
    """Return the speed at which the robot drives with `beside` metres of room beside its body."""
    share = min(1.0, max(0.0, beside / limits.slow_clearance))
    return limits.speed * (limits.slow_fraction + (1.0 - limits.slow_fraction) * share)

"""The footprint of the body, the clearance that it needs, and its speed near obstacles."""

from typing import Final, NamedTuple

import numpy as np

from ippon.compiling import njit
from ippon.geometry import Float64Array
from ippon.robot import RobotProfile

NO_DISCS: Final[Float64Array] = np.zeros((0, 4))
"""The discs of a round body, whose heading does not matter."""


class BodyLimits(NamedTuple):
    """Footprint of the body, the clearance that it needs, and its speed near obstacles.

    A long body turns only where its circumscribed circle is free, but drives straight ahead
    wherever its discs are: through doors that are narrower than it is long.
    """

    radius: float
    """Radius of the circumscribed circle, metres."""
    unseen_radius: float
    """Least distance from the centre to unseen floor, metres; less than the radius, since cells at
    the foot of a wall often remain unseen."""
    slow_clearance: float
    """Free space beside the body below which the robot slows down, metres."""
    slow_fraction: float
    """Fraction of the top speed that remains when an obstacle almost touches the body."""
    speed: float
    """Top speed, metres per second."""
    half_width: float = 0.0
    """Half the width of a long body, metres; unused for a round one."""
    unseen_half_width: float = 0.0
    """Least distance from the axis of a long body to unseen floor, metres."""
    discs: Float64Array = NO_DISCS
    """(K, 4) discs of a long body that drives in both directions: x and y in the base frame,
    radius, and least distance from the disc's centre to unseen floor, metres."""


def body_limits_of(
    robot: RobotProfile, *, unseen_overlap_m: float, slow_clearance_m: float, slow_fraction: float
) -> BodyLimits:
    """Return the footprint and clearances of a robot.

    Args:
        robot: Its collision spheres and top speed.
        unseen_overlap_m: How far each disc may reach over unseen floor, metres; at most half its
            radius.
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
    # Mirrored, since an edge of the roadmap is driven in both directions.
    discs = sorted({(k * x, k * y, r, to_unseen(r)) for x, y, r in robot.outline for k in (1, -1)})
    return limits._replace(
        half_width=robot.half_width_m,
        unseen_half_width=to_unseen(robot.half_width_m),
        discs=np.array(discs, dtype=np.float64),
    )


@njit(cache=True, nogil=True)
def inscribed_radius(limits: BodyLimits) -> float:
    """Return the radius of the largest circle that fits wherever the body drives straight ahead."""
    return limits.radius if limits.discs.shape[0] == 0 else limits.half_width


@njit(cache=True, nogil=True)
def inscribed_unseen_radius(limits: BodyLimits) -> float:
    """Return the least distance from the centre of that circle to unseen floor."""
    return limits.unseen_radius if limits.discs.shape[0] == 0 else limits.unseen_half_width


@njit(cache=True, nogil=True)
def speed_at(limits: BodyLimits, beside: float) -> float:
    """Return the speed with `beside` metres of free space beside the body."""
    share = min(1.0, max(0.0, beside / limits.slow_clearance))
    return limits.speed * (limits.slow_fraction + (1.0 - limits.slow_fraction) * share)

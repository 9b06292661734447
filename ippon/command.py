"""What the mission asks of the robot for the next moment."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Command:
    """Velocities in the base frame and a camera tilt to move to."""

    linear_m_s: float = 0.0
    """Forward speed; negative drives backwards."""
    yaw_rate_rad_s: float = 0.0
    """Turn rate, counter-clockwise from above."""
    tilt_rad: float = 0.0
    """Camera tilt to reach, positive up; the robot moves there at its own limited rate."""

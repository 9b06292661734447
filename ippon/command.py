"""Commands of the mission to the robot."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Command:
    """Velocities in the base frame and a target tilt of the camera."""

    linear_m_s: float = 0.0
    """Forward speed; negative drives backwards."""
    yaw_rate_rad_s: float = 0.0
    """Turn rate, counter-clockwise from above."""
    tilt_rad: float = 0.0
    """Target tilt of the camera, positive up; the robot's tilt rate is limited."""

"""Drift of odometry with motion."""

import math
from dataclasses import dataclass

import numpy as np

from ippon.geometry import Float64Array, base_pose, invert_transform, wrap_angle, yaw_of


@dataclass(frozen=True, slots=True, kw_only=True)
class DriftConfig:
    """Growth of the pose error with motion; zeros report the true pose."""

    position_per_sqrt_m: float = 0.0
    """Standard deviation of the position error, metres, after one metre driven."""
    yaw_per_sqrt_m: float = 0.0
    """Standard deviation of the heading error, radians, after one metre driven."""
    yaw_per_sqrt_rad: float = 0.0
    """Standard deviation of the heading error, radians, after one radian turned."""

    def __post_init__(self) -> None:
        """Reject negative growth."""
        values = (self.position_per_sqrt_m, self.yaw_per_sqrt_m, self.yaw_per_sqrt_rad)
        if not all(math.isfinite(v) and v >= 0.0 for v in values):
            raise ValueError(f"drift must be finite and at least 0; got {values}")


class OdometryDrift:
    """Pose estimate that drifts from the true pose like dead reckoning."""

    def __init__(self, T_world_base: Float64Array, config: DriftConfig, seed: int) -> None:
        self.config = config
        self.T_world_base = T_world_base.copy()
        """(4, 4) estimated pose."""
        self._true = T_world_base.copy()
        self._rng = np.random.Generator(np.random.PCG64([seed, 0xD21F7]))

    def follow(self, T_world_base: Float64Array) -> None:
        """Update the estimate by the next true pose."""
        motion = invert_transform(self._true) @ T_world_base
        self._true = T_world_base.copy()
        if self.config == DriftConfig():
            self.T_world_base = T_world_base.copy()
            return
        distance = math.hypot(motion[0, 3], motion[1, 3])
        turn = abs(wrap_angle(yaw_of(motion)))
        position_sigma = self.config.position_per_sqrt_m * math.sqrt(distance)
        yaw_variance = self.config.yaw_per_sqrt_m**2 * distance
        yaw_variance += self.config.yaw_per_sqrt_rad**2 * turn
        dx, dy, dyaw = self._rng.standard_normal(3)
        error = base_pose(
            position_sigma * dx, position_sigma * dy, 0.0, math.sqrt(yaw_variance) * dyaw
        )
        self.T_world_base = self.T_world_base @ motion @ error

"""The camera sweeps up and down while the robot travels, to see as much as possible."""

import math
from dataclasses import dataclass

from ippon.robot import RobotProfile


@dataclass(frozen=True, slots=True, kw_only=True)
class TravelPitchConfig:
    """The sweep of the camera while driving (Sec. Traversability; ablation "w/o Travel Pitch")."""

    sweep: bool = True
    low_rad: float = -0.42
    """Lowest tilt of the sweep; lower sees the floor right before the robot, and less far."""
    high_rad: float = -0.18
    """Highest tilt of the sweep; higher sees the tops of shelves, and nothing that is near."""
    period_s: float = 4.0
    """A shorter period shows more and blurs more."""
    level_rad: float = -0.3
    """Tilt without a sweep."""


class TravelPitch:
    """A sine over robot time, inside the tilt limits and rate of the robot."""

    def __init__(self, config: TravelPitchConfig, robot: RobotProfile) -> None:
        low = max(config.low_rad, robot.min_tilt_rad)
        high = min(config.high_rad, robot.max_tilt_rad)
        self._sweep = config.sweep and high > low
        self._level = robot.within_tilt(config.level_rad)
        self._middle = 0.5 * (low + high)
        self._amplitude = 0.5 * (high - low)
        # The steepest part of the sine must not ask for more than the servo can do.
        fastest = 2.0 * math.pi * self._amplitude / (0.9 * robot.max_tilt_rate_rad_s)
        self._period_s = max(config.period_s, fastest)

    def tilt(self, elapsed_s: float) -> float:
        """Return the tilt to aim for, `elapsed_s` seconds of robot time into the search."""
        if not self._sweep:
            return self._level
        phase = 2.0 * math.pi * elapsed_s / self._period_s
        return self._middle + self._amplitude * math.sin(phase)

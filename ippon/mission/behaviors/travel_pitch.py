"""The sweep of the camera while the robot drives, to see floor and objects in turn."""

import math

from ippon.mission.behaviors.config import TravelPitchConfig
from ippon.robot import RobotProfile


class TravelPitch:
    """The tilt as a sine of robot time, within the tilt limits and tilt rate of the robot."""

    def __init__(self, config: TravelPitchConfig, robot: RobotProfile) -> None:
        low = max(config.low_rad, robot.min_tilt_rad)
        high = min(config.high_rad, robot.max_tilt_rad)
        self._sweep = config.sweep and high > low
        self._level = robot.within_tilt(config.level_rad)
        self._middle = 0.5 * (low + high)
        self._amplitude = 0.5 * (high - low)
        # The steepest part of the sine must stay below the tilt rate.
        fastest = 2.0 * math.pi * self._amplitude / (0.9 * robot.max_tilt_rate_rad_s)
        self._period_s = max(config.period_s, fastest)

    def tilt(self, elapsed_s: float) -> float:
        """Return the tilt at `elapsed_s` seconds of robot time since the search began."""
        if not self._sweep:
            return self._level
        phase = 2.0 * math.pi * elapsed_s / self._period_s
        return self._middle + self._amplitude * math.sin(phase)

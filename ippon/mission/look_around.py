"""The first moments: look down to see the floor, then turn once round (Sec. Traversability)."""

import math
from dataclasses import dataclass

import numpy as np

from ippon.command import Command
from ippon.geometry import wrap_angle
from ippon.robot import RobotProfile


@dataclass(frozen=True, slots=True, kw_only=True)
class LookAroundConfig:
    """How the robot takes in its surroundings before it moves."""

    down_tilt_rad: float = -0.9
    """Tilt at which the floor before the robot comes into view; lower sees closer floor."""
    turn_tilt_rad: float = -0.25
    """Tilt while turning; lower sees more floor and less wall."""
    turn: bool = True
    """Turn once round after looking down; off in the ablation "w/o Initial Yaw"."""
    tilt_tolerance_rad: float = 0.05


class LookAround:
    """Looks down, then turns by a full circle less what one image shows."""

    def __init__(self, config: LookAroundConfig, robot: RobotProfile) -> None:
        self._config = config
        self._robot = robot
        self._down_tilt = float(
            np.clip(config.down_tilt_rad, robot.min_tilt_rad, robot.max_tilt_rad)
        )
        self._looked_down = False
        self._turned_rad = 0.0
        self._last_yaw: float | None = None
        overlap = 0.25 * robot.horizontal_fov_rad
        self._circle_rad = (
            2.0 * math.pi - robot.horizontal_fov_rad + overlap if config.turn else 0.0
        )

    @property
    def done(self) -> bool:
        """Everything that can be seen by turning on the spot was seen."""
        return self._looked_down and self._turned_rad >= self._circle_rad

    @property
    def progress(self) -> float:
        """0 at the start, 1 when done."""
        if not self._looked_down:
            return 0.0
        return 1.0 if self.done else self._turned_rad / self._circle_rad

    def skip(self) -> None:
        """Count as done: there is something better to do."""
        self._looked_down = True
        self._turned_rad = self._circle_rad

    def step(self, yaw_rad: float, tilt_rad: float) -> Command:
        """Return the next command for the robot's present heading and tilt."""
        if not self._looked_down:
            if abs(tilt_rad - self._down_tilt) > self._config.tilt_tolerance_rad:
                return Command(tilt_rad=self._down_tilt)
            self._looked_down = True
        if self._last_yaw is not None:
            self._turned_rad += max(0.0, wrap_angle(yaw_rad - self._last_yaw))
        self._last_yaw = yaw_rad
        if self.done:
            return Command(tilt_rad=self._config.turn_tilt_rad)
        return Command(
            yaw_rate_rad_s=self._robot.max_yaw_rate_rad_s, tilt_rad=self._config.turn_tilt_rad
        )

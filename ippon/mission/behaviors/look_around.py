"""The first moments: look down, turn once round, and back over the floor (Sec. Traversability)."""

import math
from dataclasses import dataclass
from typing import Final

from ippon.command import Command
from ippon.geometry import wrap_angle
from ippon.robot import RobotProfile

_WAITS_STEPS: Final = 5
"""What is better to do may be gone for a moment only: so many steps are waited for it."""
STILL_THERE_M: Final = 0.5
"""A robot that has gone no farther has much the same around it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LookAroundConfig:
    """How the robot takes in its surroundings before it goes in search of an object."""

    down_tilt_rad: float = -0.9
    """Tilt at which the floor before the robot comes into view; lower sees closer floor."""
    turn_tilt_rad: float = -0.25
    """Tilt while turning; lower sees more floor and less wall."""
    turn: bool = True
    """Turn once round after looking down; off in the ablation "w/o Initial Yaw"."""
    floor_tilt_rad: float | None = -0.75
    """Tilt while turning back: the floor close by, on which the first metres are planned. None does
    not turn back, and saves the time."""
    tilt_tolerance_rad: float = 0.05


class LookAround:
    """Looks down, turns by a full circle less what one image shows, and back over the floor."""

    def __init__(self, config: LookAroundConfig, robot: RobotProfile) -> None:
        self._config = config
        self._robot = robot
        self._down_tilt = robot.within_tilt(config.down_tilt_rad)
        self._turn_tilt = robot.within_tilt(config.turn_tilt_rad)
        self._looked_down = False
        self._turned_rad = 0.0
        self._waits = 0
        self._last_yaw: float | None = None
        overlap = 0.25 * robot.horizontal_fov_rad
        self._circle_rad = 2.0 * math.pi - robot.horizontal_fov_rad + overlap
        # A fixed camera would see the same again.
        self._floor_tilt = config.floor_tilt_rad if robot.can_tilt else None
        turns = 0 if not config.turn else 1 if self._floor_tilt is None else 2
        self._all_rad = turns * self._circle_rad

    @property
    def done(self) -> bool:
        """Everything that can be seen by turning on the spot was seen."""
        return self._looked_down and self._turned_rad >= self._all_rad

    @property
    def progress(self) -> float:
        """0 at the start, 1 when done."""
        if not self._looked_down:
            return 0.0
        return 1.0 if self.done else self._turned_rad / self._all_rad

    def skip(self) -> None:
        """Count as done: there is something better to do."""
        self._looked_down = True
        self._turned_rad = self._all_rad

    def interrupt(self, gone_m: float) -> None:
        """Let something better to do come first.

        The rest is made up for if that comes to nothing close by, from whatever heading the robot
        has then.

        Args:
            gone_m: How far the robot has driven since the search began.
        """
        self._last_yaw = None
        self._waits = _WAITS_STEPS
        if gone_m > STILL_THERE_M:
            self.skip()

    def waits(self) -> bool:
        """Tell whether to hold still for what interrupted it, which is gone at this step."""
        self._waits = max(0, self._waits - 1)
        return self._waits > 0

    def step(self, yaw_rad: float, tilt_rad: float) -> Command:
        """Return the next command for the robot's present heading and tilt."""
        if not self._looked_down:
            if not self._is_at(self._down_tilt, tilt_rad):
                return Command(tilt_rad=self._down_tilt)
            self._looked_down = True
        floor_tilt = self._floor_tilt
        back = floor_tilt is not None and self._turned_rad >= self._circle_rad
        direction = -1.0 if back else 1.0
        if self._last_yaw is not None:
            self._turned_rad += max(0.0, direction * wrap_angle(yaw_rad - self._last_yaw))
        self._last_yaw = yaw_rad
        if self.done:
            return Command(tilt_rad=self._turn_tilt)
        if floor_tilt is None or self._turned_rad < self._circle_rad:
            return self._turn(1.0, self._turn_tilt)
        tilt = self._robot.within_tilt(floor_tilt)
        begins = self._turned_rad < self._circle_rad + 0.25 * self._robot.horizontal_fov_rad
        if begins and not self._is_at(tilt, tilt_rad):
            return Command(tilt_rad=tilt)
        return self._turn(-1.0, tilt)

    def _turn(self, direction: float, tilt_rad: float) -> Command:
        rate = direction * self._robot.max_yaw_rate_rad_s
        return Command(yaw_rate_rad_s=rate, tilt_rad=tilt_rad)

    def _is_at(self, tilt_rad: float, now_rad: float) -> bool:
        return abs(now_rad - tilt_rad) <= self._config.tilt_tolerance_rad

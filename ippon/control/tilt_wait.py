"""How long a camera's tilt is awaited."""

from typing import Final

from ippon.command import COMMAND_S
from ippon.robot import RobotProfile

_LEAST_S: Final = 3.0
_RANGES: Final = 2.0
"""How often the camera could move through its whole range in the time beyond that."""


class TiltWait:
    """Whether a camera has its tilt, or does not take it.

    A mount that sticks, or whose tilt is measured with an offset, would be awaited without end.
    """

    def __init__(self, robot: RobotProfile) -> None:
        """Begin to wait; the robot's range and rate bound the time."""
        range_rad = robot.max_tilt_rad - robot.min_tilt_rad
        self._most_s = _LEAST_S + _RANGES * range_rad / robot.max_tilt_rate_rad_s
        self._waited_s = 0.0

    def restart(self) -> None:
        """Wait as long as at first."""
        self._waited_s = 0.0

    @property
    def given_up(self) -> bool:
        """The tilt was awaited for longer than any of the robot's takes."""
        return self._waited_s > self._most_s

    def is_over(self, off_rad: float, tolerance_rad: float, dt_s: float) -> bool:
        """Return whether to go on, with the tilt or without it.

        Args:
            off_rad: How far the tilt is from the wanted one.
            tolerance_rad: How far it may be.
            dt_s: Seconds since the last call.
        """
        if abs(off_rad) <= tolerance_rad:
            self._waited_s = 0.0
            return True
        # While frames are missing nobody knows the tilt.
        self._waited_s += min(dt_s, COMMAND_S)
        return self.given_up

"""What the robot touches: the operator's hand does not push it, and may back away from it."""

import math

from ippon.control.drive_mode import STILL


class Touch:
    """Keeps the direction in which the robot drove when it came to touch something."""

    def __init__(self) -> None:
        self._way = 1.0
        """Direction of the last motion: 1 forwards, -1 backwards."""
        self._way_since = -math.inf
        self._blocked_way = 0.0
        """Direction in which the robot touches something; 0 while it does not."""

    def drove(self, linear_m_s: float, now: float) -> None:
        """Note a command that was given."""
        if linear_m_s * self._way < -STILL:
            self._way, self._way_since = -self._way, now

    def saw(self, pictured_at: float, *, contact: bool) -> None:
        """Note whether the robot touched something when an image was taken."""
        if not contact:
            self._blocked_way = 0.0
        elif self._blocked_way == 0.0:
            turned_round = self._way_since > pictured_at
            self._blocked_way = -self._way if turned_round else self._way

    def blocks(self, linear_m_s: float) -> bool:
        """Return whether a command drives on into what the robot touches."""
        return linear_m_s * self._blocked_way > 0.0

"""Whether the robot could start a search at once, and why not."""

import time
from typing import Final

from app.messages.control import Obstacle
from app.messages.status import MissionState, Status
from app.nodes.navigator.state.goal_queue import GoalQueue

_NO_DATA: Final = ("lost", "ended")


class Availability:
    """Combines goals and status; safe from any thread."""

    def __init__(self, goals: GoalQueue) -> None:
        self._goals = goals
        self.status: Status | None = None
        """The latest status; the navigator sets it."""
        self._hold_until = 0.0

    def hold(self, for_s: float) -> None:
        """Announce a find for some seconds from now on before waiting goals start."""
        self._hold_until = time.monotonic() + for_s

    @property
    def holds(self) -> bool:
        """A find is being announced."""
        return time.monotonic() < self._hold_until

    def obstacle(self, state: MissionState) -> tuple[Obstacle, str]:
        """Return why no search could start now, and the detail; empty where one could.

        Args:
            state: State of the mission.
        """
        status = self.status
        if status is None or status.frames == 0:
            return "starting", "" if status is None else status.why
        if status.state in _NO_DATA:
            return "lost", status.why
        if state in ("stopped", "paused", "manual"):
            return state, ""
        goals = self._goals.unfinished()
        if goals:
            return "searching", goals[0].goal.display
        if self._goals.announced() is not None and self.holds:
            return "found", ""
        return "", ""

"""Whether the robot could start a search at once, and why not."""

import time
from typing import Final

from app.messages.control import Obstacle
from app.messages.status import MissionState, Status
from app.nodes.navigator.state.goal_queue import GoalQueue

_OF_STATE: Final[dict[MissionState, Obstacle]] = {
    "stopped": "stopped",
    "paused": "paused",
    "manual": "manual",
}
_NO_DATA: Final = ("lost", "ended")


class Availability:
    """Combines goals and status; safe from any thread."""

    def __init__(self, goals: GoalQueue) -> None:
        self._goals = goals
        self.status: Status | None = None
        """The latest status; the navigator sets it."""
        self.hold_until = 0.0
        """Monotonic time until which a find is announced before waiting goals start; the navigator
        sets it."""

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
        if state in _OF_STATE:
            return _OF_STATE[state], ""
        goals = self._goals.unfinished()
        if goals:
            return "searching", goals[0].goal.display
        if self._goals.announced() is not None and time.monotonic() < self.hold_until:
            return "found", ""
        return "", ""

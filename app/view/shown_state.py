"""The state of the robot as people read it, which tells more than the navigator's."""

from typing import Final, Literal

from app.messages.status import MissionState, Status, awaited_find

ShownState = MissionState | Literal["confirmed"]

JUDGED: Final[ShownState] = "confirmed"


def shown_state(status: Status) -> ShownState:
    """Return the state of a status; a find that was confirmed is told from one that waits."""
    if status.state == "found" and awaited_find(status) is None and _is_confirmed(status):
        return JUDGED
    return status.state


def _is_confirmed(status: Status) -> bool:
    return status.goal is not None and status.goal.confirmed

"""The state of the robot as people read it, which tells more than the navigator's."""

from typing import Literal

from app.messages.status import MissionState, Status, awaited_find

ShownState = MissionState | Literal["confirmed", "perhaps", "going", "ready"]


def shown_state(status: Status) -> ShownState:
    """Return the state of a status.

    Of finds, what was confirmed is told from what waits, and what is doubtful from what is not. A
    robot that drives to a point is not driven by hand. One that has images and no goal is ready.
    """
    if status.state == "starting" and status.frames and status.goal is None:
        return "ready" if not status.queue else "starting"
    if status.state == "manual" and status.drive.waypoint is not None:
        return "going"
    if status.state != "found":
        return status.state
    find = awaited_find(status)
    if find is not None:
        return "perhaps" if find.perhaps else "found"
    return "confirmed" if status.goal is not None and status.goal.confirmed else "found"

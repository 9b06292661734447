"""Goals of an earlier run are queued again; the robot waits, or goes on after a crash."""

from collections.abc import Callable

from app.nodes.navigator.services.request_services import RequestServices
from app.nodes.navigator.state.goal_queue import GoalQueue
from app.nodes.navigator.state.persistence import RunState, SavedState
from ippon.control.drive_mode import DriveMode
from ippon.mission.mission import Mission


def run_state(services: RequestServices, mission: Mission) -> RunState:
    """Return what the next run must know if this one is killed."""
    drive = services.mux.status()
    held = mission.operator.held is not None
    return RunState(held=held, mode=drive.mode, speed_limit=drive.speed_limit)


def restore_goals(
    saved: SavedState | None,
    services: RequestServices,
    goals: GoalQueue,
    mission: Mission,
    report_event: Callable[[str, str], None],
    *,
    resume: bool,
) -> None:
    """Queue the goals of an earlier navigator.

    Args:
        saved: What it left behind; None for nothing.
        services: Take the goals.
        goals: Get what was found before.
        mission: Is stopped unless it may go on.
        report_event: Tells the operator.
        resume: Go on if the last run was killed in mid-search.
    """
    if saved is None or not saved.requests:
        return
    interrupted = saved.interrupted if resume else None
    goes_on = interrupted is not None and interrupted.may_go_on
    if goes_on and interrupted is not None:
        services.mux.set_mode(DriveMode.AUTO, interrupted.speed_limit)
    else:
        mission.operator.stop()
    for request in saved.requests:
        accepted = services.goals.search(request)
        services.guidance.restore(accepted.goal_id, request.levels)
        counted, rejected = (
            [one.find() for one in kept] for kept in (request.counted, request.rejected)
        )
        goals.note_finds(accepted.goal_id, counted, rejected)
    if goes_on:
        report_event("resumed", "the last run was killed: the search goes on")
    else:
        report_event(
            "stopped", "the goals of the last run are restored: press Resume to let the robot move"
        )

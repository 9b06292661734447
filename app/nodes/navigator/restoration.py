"""What an earlier run leaves: its goals, and after a crash its Stop and its speed limit.

The robot waits, or goes on after a crash.
"""

from collections.abc import Callable

import msgspec

from app.links.network.requests import RequestRefusedError
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
    if saved is None:
        return
    interrupted = saved.interrupted
    if interrupted is not None:
        services.mux.set_mode(DriveMode.AUTO, interrupted.speed_limit)
        mission.operator.limit_speed(interrupted.speed_limit)
    if not saved.requests:
        if interrupted is not None and interrupted.held:
            mission.operator.stop()
        return
    goes_on = resume and interrupted is not None and interrupted.may_go_on
    if not goes_on:
        mission.operator.stop()
    first: dict[int, int] = {}
    """Number now of the first goal of each tour, by its place in the file."""
    for place, kept in enumerate(saved.requests, 1):
        tour = kept.joins or place
        request = msgspec.structs.replace(kept, joins=first.get(tour))
        try:
            accepted = services.goals.search(request, restores=True)
        except RequestRefusedError as error:
            report_event("error", f"the search for {request.object} is not restored: {error}")
            continue
        first.setdefault(tour, accepted.goal_id)
        services.guidance.restore(accepted.goal_id, request.levels)
        counted, rejected = (
            [one.find() for one in finds] for finds in (request.counted, request.rejected)
        )
        goals.note_finds(accepted.goal_id, counted, rejected)
    if goes_on:
        report_event("resumed", "the last run was killed: the search goes on")
    else:
        report_event(
            "stopped", "the goals of the last run are restored: press Resume to let the robot move"
        )

"""Searches of a session as a table of its report."""

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

from app.messages.status import GoalStatus, Status
from app.recording.session_goals import NavigatorRun, SessionSearch, outcome_of, runs_of
from app.recording.timeline import SessionTimeline
from app.view.words import Words


@dataclass(frozen=True, slots=True, kw_only=True)
class Effort:
    """What a search took in one run of the navigator."""

    seconds: float
    path_length_m: float
    tour: tuple[int, int]
    """Place of the run, and lowest number of the goals of its tour; its own number without one."""


def search_table(timeline: SessionTimeline, searches: Sequence[SessionSearch], say: Words) -> str:
    """Return a table of the searches if there are several."""
    if len(searches) < 2:
        return ""
    rows: list[str] = []
    runs = runs_of(timeline)
    for search in searches:
        goal = search.goal
        seconds, way = total_effort(efforts_of(runs, [search]))
        rows.append(
            table_row(
                escape(say.goal(goal)),
                escape(goal.context),
                escape(_result(goal, say)),
                escape(places_text(goal, say)),
                f"{say.number(seconds, 1)} s",
                f"{say.number(way, 1)} m",
            )
        )
    names = ("object", "context", "outcome", "place", "time", "path")
    return f"<h2>{escape(say('report.searched'))}</h2>{table(names, rows, say)}"


def outcome_text(goal: GoalStatus, say: Words) -> str:
    """Return the outcome of a goal."""
    return say(f"outcome.{outcome_of(goal)}")


def places_of(goal: GoalStatus) -> list[tuple[str, tuple[float, float, float]]]:
    """Return room and position of each find of a goal, metres in the world."""
    places = [(one.room, one.position_world) for one in goal.counted]
    if goal.position_world is not None:
        places.append((goal.room, goal.position_world))
    return places


def places_text(goal: GoalStatus, say: Words) -> str:
    """Return where a goal was found, room and position of each find; empty for no find."""
    texts: list[str] = []
    for room, position in places_of(goal):
        x, y, z = (say.number(value, 1) for value in position)
        where = say("panel.places.where", x=x, y=y, z=z)
        texts.append(f"{say.room(room)}, {where}" if room else where)
    return "; ".join(texts)


def _result(goal: GoalStatus, say: Words) -> str:
    """Return the outcome of a goal with its count and what the operator said of the find."""
    outcome = outcome_text(goal, say)
    if is_found(goal):
        outcome = say("goals.confirmed" if goal.confirmed else "goals.unconfirmed", outcome=outcome)
    if goal.count == 1:
        return outcome
    found = len(goal.counted) + is_found(goal)
    kind = "all" if goal.count == "all" else "some"
    return f"{outcome}, {say(f'goals.count.{kind}', found=found, count=goal.count)}"


def is_found(goal: GoalStatus) -> bool:
    """Tell whether a goal was found, be it out of reach."""
    return goal.outcome in {"found", "out_of_reach"}


def table_row(*cells: str) -> str:
    """Return a row of cells, each HTML."""
    return "<tr>" + "".join(f"<td>{cell}</td>" for cell in cells) + "</tr>"


def table(names: Sequence[str], rows: Sequence[str], say: Words) -> str:
    """Return a table; its head has the words of `report.NAME`."""
    head = "".join(f"<th>{escape(say(f'report.{name}'))}</th>" for name in names)
    return f"<table><tr>{head}</tr>{''.join(rows)}</table>"


def efforts_of(runs: Sequence[NavigatorRun], searches: Sequence[SessionSearch]) -> list[Effort]:
    """Return duration and path length of searches in each run, up to their end.

    In a tour they are those since the tour began: all of its goals are searched for at once.
    """
    parts = [part for search in searches for part in search.parts]
    return [_effort_of(runs[place], place, goal_id) for place, goal_id in parts]


def _effort_of(run: NavigatorRun, place: int, goal_id: int) -> Effort:
    during = [
        (status, goal)
        for status in run.statuses
        if (goal := _searched(status, goal_id)) is not None
    ]
    # The clock of a search continues while its find waits for an answer, and that of a tour while
    # its other goals are searched for.
    active = [status for status, goal in during if goal.outcome == "active"]
    active = active or [status for status, _ in during[:1]]
    tour = [goal.goal_id for status in active for goal in status.tour]
    way = active if tour else [status for status, _ in during]
    return Effort(
        seconds=max((status.elapsed_s for status in active), default=0.0),
        path_length_m=max((status.path_length_m for status in way), default=0.0),
        tour=(place, min(tour, default=goal_id)),
    )


def total_effort(efforts: Sequence[Effort]) -> tuple[float, float]:
    """Return seconds and metres of all searches; those of one tour count once."""
    tours: dict[tuple[int, int], list[Effort]] = {}
    for one in efforts:
        tours.setdefault(one.tour, []).append(one)
    return (
        sum(max(one.seconds for one in tour) for tour in tours.values()),
        sum(max(one.path_length_m for one in tour) for tour in tours.values()),
    )


def _searched(status: Status, goal_id: int) -> GoalStatus | None:
    """Return a goal while it is searched for, alone or in a tour."""
    goals = (status.goal, *status.tour)
    return next((goal for goal in goals if goal is not None and goal.goal_id == goal_id), None)

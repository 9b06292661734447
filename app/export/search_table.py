"""Searches of a session as a table of its report."""

from collections.abc import Sequence
from html import escape

from app.export.session_data import SessionData
from app.messages.status import GoalStatus
from app.recording.session_goals import outcome_of
from app.view.words import Words


def search_table(session: SessionData, goals: Sequence[GoalStatus], say: Words) -> str:
    """Return a table of the searches if there are several."""
    if len(goals) < 2:
        return ""
    rows: list[str] = []
    for goal in goals:
        seconds, way = effort_of(session, goal.goal_id)
        rows.append(
            table_row(
                escape(say.goal(goal)),
                escape(goal.context),
                escape(_result(goal, say)),
                f"{say.number(seconds, 1)} s",
                f"{say.number(way, 1)} m",
            )
        )
    names = ("object", "context", "outcome", "time", "path")
    return f"<h2>{escape(say('report.searched'))}</h2>{table(names, rows, say)}"


def outcome_text(goal: GoalStatus, say: Words) -> str:
    """Return the outcome of a goal."""
    return say(f"outcome.{outcome_of(goal)}")


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


def effort_of(session: SessionData, goal_id: int) -> tuple[float, float]:
    """Return duration in seconds and path length in metres of one search, up to its end."""
    during = [
        s.status
        for s in session.timeline.statuses
        if s.status.goal is not None and s.status.goal.goal_id == goal_id
    ]
    # The clock of a search continues while its find waits for an answer.
    active = [s for s in during if s.goal is not None and s.goal.outcome == "active"] or during[:1]
    seconds = max((status.elapsed_s for status in active), default=0.0)
    return seconds, max((status.path_length_m for status in during), default=0.0)

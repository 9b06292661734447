"""Goals of a session and their outcomes, as lists and reports name them."""

import itertools
from dataclasses import dataclass
from typing import Literal

import msgspec

from app.messages.status import GoalStatus, Status, name_of
from app.recording.timeline import SessionTimeline

SessionOutcome = Literal["found", "out_of_reach", "exhausted", "cancelled", "unfinished"]
"""Outcome of a goal when its session ended; `unfinished` where the search went on or waited."""


class SessionGoal(msgspec.Struct, frozen=True, kw_only=True):
    """One goal of a session."""

    object: str
    """As the requester named it."""
    context: str = ""
    outcome: SessionOutcome


@dataclass(frozen=True, slots=True, kw_only=True)
class NavigatorRun:
    """Statuses of one run of the navigator, which may be started again during a session."""

    statuses: list[Status]
    """Those of the timeline."""
    last: Status
    """Its last one, whole."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SessionSearch:
    """The search for a goal, in one run of the navigator or taken up again by the next ones."""

    goal: GoalStatus
    """As it was last."""
    parts: tuple[tuple[int, int], ...]
    """Place of each run among `runs_of`, and the number of the goal in it."""


def runs_of(timeline: SessionTimeline) -> list[NavigatorRun]:
    """Return the runs of the navigator; none before its first status."""
    if timeline.last is None:
        return []
    ends = [0, *(one.n_statuses for one in timeline.ended), len(timeline.statuses)]
    lasts = [*(one.last for one in timeline.ended), timeline.last]
    return [
        NavigatorRun(statuses=[one.status for one in timeline.statuses[start:end]], last=last)
        for (start, end), last in zip(itertools.pairwise(ends), lasts, strict=True)
    ]


def searches_of(timeline: SessionTimeline) -> list[SessionSearch]:
    """Return the searches of a session, in the order in which they ended.

    One that was not over when the navigator was started again, and that this took up, is one.
    """
    searches: list[SessionSearch] = []
    open_before: dict[int, SessionSearch] = {}
    """By the number that the present run gives them."""
    for place, run in enumerate(runs_of(timeline)):
        known = dict(open_before)
        for goal in _goals_of(run):
            parts, earlier = ((place, goal.goal_id),), open_before.get(goal.goal_id)
            if earlier is not None and _asks_the_same(earlier.goal, goal):
                searches.remove(earlier)
                parts = (*earlier.parts, *parts)
            known[goal.goal_id] = SessionSearch(goal=goal, parts=parts)
            searches.append(known[goal.goal_id])
        # A navigator restores the unfinished goals of its last run, numbered from 1.
        open_before = {
            number: known[goal.goal_id]
            for number, goal in enumerate(_unfinished(run.last), 1)
            if goal.goal_id in known
        }
    return searches


def goals_of(timeline: SessionTimeline) -> list[GoalStatus]:
    """Return the goals that a session searched for, in the order in which they ended."""
    return [one.goal for one in searches_of(timeline)]


def _goals_of(run: NavigatorRun) -> list[GoalStatus]:
    """Return the goals that a run searched for.

    The navigator's history begins with goals of before the recording: they are left out.
    """
    last = run.last
    seen = {
        goal.goal_id
        for status in run.statuses
        for goal in (status.goal, *status.tour)
        if goal is not None
    }
    before = itertools.takewhile(lambda goal: goal.goal_id not in seen, last.history)
    ended = last.history[len(list(before)) :]
    over = {goal.goal_id for goal in ended}
    return [*ended, *(goal for goal in _present(last) if goal.goal_id not in over)]


def _present(status: Status) -> list[GoalStatus]:
    # The present goal may be one of its tour.
    return status.tour or ([status.goal] if status.goal is not None else [])


def _unfinished(status: Status) -> list[GoalStatus]:
    present = [goal for goal in _present(status) if goal.outcome in ("active", "queued")]
    return [*present, *status.queue]


def _asks_the_same(goal: GoalStatus, other: GoalStatus) -> bool:
    return all(
        getattr(goal, name) == getattr(other, name)
        for name in ("object", "display", "context", "count")
    )


def session_goal(goal: GoalStatus) -> SessionGoal:
    """Return a goal as lists and reports name it."""
    return SessionGoal(object=name_of(goal), context=goal.context, outcome=outcome_of(goal))


def outcome_of(goal: GoalStatus) -> SessionOutcome:
    """Return the outcome of a goal when its session ended."""
    if goal.outcome == "active" or goal.outcome == "queued":  # noqa: PLR1714 - narrows the type
        return "unfinished"
    return goal.outcome

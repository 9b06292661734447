"""Goals of a session and their outcomes, as lists and reports name them."""

import itertools
from typing import Literal

import msgspec

from app.messages.status import GoalStatus, name_of
from app.recording.timeline import SessionTimeline

SessionOutcome = Literal["found", "out_of_reach", "exhausted", "cancelled", "unfinished"]
"""Outcome of a goal when its session ended; `unfinished` where the search went on or waited."""


class SessionGoal(msgspec.Struct, frozen=True, kw_only=True):
    """One goal of a session."""

    object: str
    """As the requester named it."""
    context: str = ""
    outcome: SessionOutcome


def goals_of(timeline: SessionTimeline) -> list[GoalStatus]:
    """Return the goals that a session searched for, in the order in which they ended.

    The navigator's history begins with goals of before the recording: they are left out.
    """
    last = timeline.last
    if last is None:
        return []
    seen = {
        goal.goal_id
        for timed in timeline.statuses
        for goal in (timed.status.goal, *timed.status.tour)
        if goal is not None
    }
    before = itertools.takewhile(lambda goal: goal.goal_id not in seen, last.history)
    ended = last.history[len(list(before)) :]
    # The present goal may be one of its tour.
    present = last.tour or ([last.goal] if last.goal is not None else [])
    over = {goal.goal_id for goal in ended}
    return [*ended, *(goal for goal in present if goal.goal_id not in over)]


def session_goal(goal: GoalStatus) -> SessionGoal:
    """Return a goal as lists and reports name it."""
    return SessionGoal(object=name_of(goal), context=goal.context, outcome=outcome_of(goal))


def outcome_of(goal: GoalStatus) -> SessionOutcome:
    """Return the outcome of a goal when its session ended."""
    if goal.outcome == "active" or goal.outcome == "queued":  # noqa: PLR1714 - narrows the type
        return "unfinished"
    return goal.outcome

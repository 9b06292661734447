"""A goal with its levels, its place in the queue, and how its search ended."""

import dataclasses
from collections.abc import Iterable, Mapping
from typing import Final, Literal, NamedTuple

from app.links.language_model.interface import LevelsAnswer
from app.messages.status import CountedFind, GoalOutcome, GoalStatus
from ippon.guidance.language.naming import ResolvedObject
from ippon.guidance.levels import Guidance, LabelLevel
from ippon.mission.goal import Goal
from ippon.mission.snapshot import Find

Outcome = Literal["found", "out_of_reach", "exhausted", "cancelled"]
FOUND: Final = ("found", "out_of_reach")


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class PlannedSearch:
    """A goal and its current levels."""

    goal: Goal
    resolved: ResolvedObject
    scenario: str = ""
    guidance: Guidance
    elapsed_ms: float
    """Time that the levels took."""
    edits: tuple[LabelLevel, ...] = ()
    """Levels that the operator set; they override every answer."""
    questions: int = 0
    """Number of questions to a language model; answers to earlier ones are discarded."""
    asking: str = ""
    """Language model whose answer is pending."""
    failed: str = ""
    """Why the language model gave no answer."""
    from_cache: bool = False
    prompt: str = ""
    """The exact question to the language model."""
    reply: str = ""
    """Its exact answer."""
    asked_at: float = 0.0
    """Monotonic time of the request."""
    waited: bool = False
    """Whether the goal was queued behind others."""
    tour: int = 0
    """Number of the first goal of its tour; its own number outside of tours."""
    confirmed: bool = False
    """The operator confirmed its find."""
    rejected: tuple[Find, ...] = ()
    """Its finds that the operator rejected."""
    counted: tuple[Find, ...] = ()
    """Those that were found before the present find, where several are wanted."""
    if_idle: bool = False
    """Not queued where anything is searched for or waits."""
    copy_of: str = ""
    """What it repeats: "goal 3" or "saved search 2"; empty for a new one."""


class Place(NamedTuple):
    """The place of a new goal."""

    goal_id: int
    position: int
    """Number of goals before it."""
    joined: int | None = None
    """Number of the first goal of the tour that it belongs to; None outside of tours."""
    note: str = ""
    """Why it is not in the tour that was asked for, or not queued."""
    is_new: bool = True
    """Whether it was queued; a copy that waits already is not."""


class End(NamedTuple):
    """How the search for a goal ended."""

    outcome: Outcome
    position_world: tuple[float, float, float] | None
    """Where the find is, metres."""
    took_s: float
    """Robot time that the search took."""
    number: int = 0
    """Number of the find; 0 for none."""

    @classmethod
    def of(cls, outcome: Outcome, find: Find | None, took_s: float) -> "End":
        """Return the end of a search with or without a find."""
        if find is None:
            return cls(outcome, None, took_s)
        return cls(outcome, find.position_world, took_s, find.number)


class EndedGoal(NamedTuple):
    """A finished goal, with what is needed to search for it again."""

    search: PlannedSearch
    status: GoalStatus


def answered(answer: LevelsAnswer, search: PlannedSearch) -> PlannedSearch:
    """Return a search with the answer of a language model; levels that the operator set stay."""
    guidance, prompt, reply = answer.guidance.changed(search.edits), answer.prompt, answer.reply
    if answer.failed:
        # The levels that the search has stay: unlike the answer, they know the names of rooms.
        note = answer.guidance.notes[0]
        if search.guidance.provider != answer.guidance.provider:
            note = f"{search.guidance.provider}: {answer.failed}; its levels from before stay"
            prompt, reply = search.prompt, search.reply
        notes = tuple(dict.fromkeys((note, *search.guidance.notes)))
        guidance = dataclasses.replace(search.guidance, notes=notes)
    return dataclasses.replace(
        search,
        guidance=guidance,
        elapsed_ms=answer.elapsed_ms,
        asking="",
        failed=answer.failed,
        from_cache=answer.from_cache,
        prompt=prompt,
        reply=reply,
    )


def judged(
    active: Iterable[PlannedSearch], ends: Mapping[int, End], goal_id: int | None, number: int
) -> tuple[int, bool] | None:
    """Return the goal of a find, and whether it ended the search; None if there is no such find.

    Args:
        active: The active goals.
        ends: Their ends, by number of the goal.
        goal_id: Number of the goal; None for any.
        number: Number of the find.
    """
    for one in active:
        known = one.goal.goal_id
        if goal_id not in (None, known):
            continue
        if known in ends and ends[known].number == number:
            return known, True
        if any(find.number == number for find in one.counted):
            return known, False
    return None


def goal_status(
    search: PlannedSearch, running: GoalOutcome, end: End | None, *, in_tour: bool
) -> GoalStatus:
    """Return a goal as the status reports it.

    Args:
        search: The goal.
        running: Outcome of a goal that has not ended.
        end: How it ended; None if it has not.
        in_tour: Whether it is searched for together with others.
    """
    goal = search.goal
    return GoalStatus(
        goal_id=goal.goal_id,
        object=goal.object,
        context=goal.context,
        outcome=running if end is None else end.outcome,
        position_world=None if end is None else end.position_world,
        find=None if end is None else end.number or None,
        display="" if goal.display.replace(" ", "_") == goal.object else goal.display,
        tour=search.tour if in_tour else None,
        confirmed=search.confirmed,
        rejected=len(search.rejected),
        took_s=None if end is None else round(end.took_s, 1),
        count=goal.count,
        counted=[
            CountedFind(
                number=find.number, position_world=find.position_world, confirmed=find.confirmed
            )
            for find in search.counted
        ],
    )

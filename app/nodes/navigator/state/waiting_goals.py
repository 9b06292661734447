"""Waiting goals: their order, their contents, and the tours that they belong to."""

import dataclasses
from collections.abc import Sequence

from app.nodes.navigator.state.planned_search import PlannedSearch
from ippon.mapping.goal_layers.goal_arrays import MAX_GOALS
from ippon.vocabulary import in_words


def moved(
    waiting: Sequence[PlannedSearch], goal_id: int, before: int
) -> tuple[list[PlannedSearch], int | None]:
    """Move a goal, with its tour, before another goal and its tour.

    Returns:
        The goals in their new order, and which of the two numbers is none of theirs.
    """
    tour_of = {one.goal.goal_id: one.tour for one in waiting}
    missing = next((one for one in (goal_id, before) if one not in tour_of), None)
    if missing is not None or tour_of[goal_id] == tour_of[before]:
        return list(waiting), missing
    chosen = [one for one in waiting if one.tour == tour_of[goal_id]]
    others = [one for one in waiting if one.tour != tour_of[goal_id]]
    place = [one.tour for one in others].index(tour_of[before])
    return [*others[:place], *chosen, *others[place:]], None


def edited(
    waiting: Sequence[PlannedSearch], goal_id: int, search: PlannedSearch
) -> tuple[list[PlannedSearch], bool]:
    """Replace what a goal searches for; it keeps its number, its place and its tour.

    Returns:
        The goals, and whether one of them has the number.

    Raises:
        ValueError: Another goal of its tour is the same object.
    """
    old = next((one for one in waiting if one.goal.goal_id == goal_id), None)
    if old is None:
        return list(waiting), False
    name = search.goal.object
    if any(one.tour == old.tour and one is not old and one.goal.object == name for one in waiting):
        raise ValueError(f"{name.replace('_', ' ')} is in the tour of goal {goal_id} already")
    new = dataclasses.replace(
        search,
        goal=dataclasses.replace(search.goal, goal_id=goal_id),
        tour=old.tour,
        waited=old.waited,
        questions=old.questions,
    )
    return [new if one is old else one for one in waiting], True


def tour_to_join(
    search: PlannedSearch,
    joins: int,
    waiting: Sequence[PlannedSearch],
    active: Sequence[PlannedSearch],
    *,
    late: bool,
) -> tuple[int | None, str]:
    """Return the tour of a goal that a search is to join.

    Args:
        search: The search.
        joins: Number of the goal.
        waiting: Goals that wait.
        active: Goals that are searched for.
        late: The search for the active goals cannot start anew.

    Returns:
        The tour; None and the reason if the search cannot join it.
    """
    known = (*active, *waiting)
    tour = next((one.tour for one in known if one.goal.goal_id == joins), None)
    if tour is None:
        why = f"goal {joins} is neither searched for nor waiting"
    elif late and any(one.tour == tour for one in active):
        why = f"the search for goal {joins} has begun"
    else:
        members = [one.goal.object for one in known if one.tour == tour]
        name = in_words(search.goal.object)
        if search.goal.object in members:
            why = f"{name} is in the tour of goal {joins} already"
        elif len(members) >= MAX_GOALS:
            why = f"a tour has at most {MAX_GOALS} objects"
        else:
            return tour, ""
    return None, f"{why}: this is a search of its own"

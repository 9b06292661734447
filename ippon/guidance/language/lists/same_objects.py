"""Objects of one sentence that are one and the same: "my tv, television and telly"."""

from collections.abc import Sequence

from ippon.guidance.language.goals.goal import Goal
from ippon.guidance.language.naming import resolve_object


def once_each(goals: Sequence[Goal]) -> tuple[tuple[Goal, ...], tuple[str, ...]]:
    """Return the goals without those that only name an earlier one again.

    Names that stand for one label in the table are the same, unless something tells the objects
    apart: what was said of them or of their places, a number, or "another". "Two mugs and two mugs"
    may be four, and stay.

    Args:
        goals: In the order in which they were said.

    Returns:
        The goals that are left, in their order, and a sentence for each that is not.
    """
    left: list[Goal] = []
    notes: list[str] = []
    for goal in goals:
        first = next((one for one in left if _is_same(one, goal)), None)
        if first is None:
            left.append(goal)
        elif first.object == goal.object:
            notes.append(f"“{goal.object}” was said more than once: it is searched for once")
        else:
            notes.append(
                f"“{goal.object}” means the same as “{first.object}”: it is searched for once"
            )
    return tuple(left), tuple(dict.fromkeys(notes))


def _is_same(one: Goal, other: Goal) -> bool:
    alike = (
        one.count == other.count
        and one.count in (1, "all")
        and set(one.attributes) == set(other.attributes)
        and one.relations == other.relations
        and one.context == other.context
        and one.refers_to == other.refers_to == ""
    )
    return alike and _label(one) == _label(other)


def _label(goal: Goal) -> str:
    return resolve_object(goal.object, ()).canonical

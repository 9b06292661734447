"""The context of a goal as one text, from which levels and rooms are read again."""

from collections.abc import Callable, Sequence

from ippon.guidance.knowledge import load_knowledge
from ippon.guidance.language.context import read_context
from ippon.guidance.language.context_words import RELATIONS
from ippon.guidance.language.goals.goal import Relation


def context_text(told: Sequence[str], relations: Sequence[Relation], name: str) -> str:
    """Return what was told of a place as one text that denies what the relations deny.

    Args:
        told: The operator's words, in parts: "in the bathroom" of "there is no soap in the
            bathroom".
        relations: What was read of them.
        name: The object.
    """
    if not told:
        # A place that was said once for a list: "look in the kitchen for the mug and the plate".
        return "; ".join(one.text for one in relations)
    text = ", ".join(told)
    agrees = _agreement(relations, name)
    if agrees(text):
        return text
    parts = [
        f"not {part}" if part.split()[0].lower() in RELATIONS and not agrees(part) else part
        for part in told
    ]
    own = [one.text for one in relations]
    tries = ("; ".join(told), "; ".join(parts), "; ".join(own))
    return next(filter(agrees, tries), text)


def _agreement(relations: Sequence[Relation], name: str) -> Callable[[str], bool]:
    """Return whether a text, read again, says nothing else of the places than the relations."""
    denied: dict[str, set[bool]] = {}
    for one in relations:
        label = _label(one.place)
        if label is not None:
            denied.setdefault(label, set()).add(one.negated)

    def agrees(text: str) -> bool:
        claims = read_context(text, (), ooi=name.replace(" ", "_")).claims if denied else ()
        for label, signs in denied.items():
            told = [one for one in claims if label in (one.place, one.room)]
            # "From the shelf" is right where "taken from the shelf" denies the shelf.
            same = [one for one in told if one.relation != "from" or not one.negated]
            if same and all(one.firm and one.negated not in signs for one in same):
                return False
        return True

    return agrees


def _label(place: str) -> str | None:
    entry = load_knowledge().find(place)
    return load_knowledge().room(place) or (entry.label if entry is not None else None)

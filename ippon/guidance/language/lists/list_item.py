"""An object of a list beside those that were read before: one more, the same, or in its place."""

from typing import Final

from ippon.guidance.language.goals.clauses import state
from ippon.guidance.language.goals.drafts import Draft, Reading, draft
from ippon.guidance.language.goals.goal import Order
from ippon.guidance.language.goals.references import (
    UNASKED,
    complained,
    describes_declined,
    refer,
    replaced,
    selects,
)
from ippon.guidance.language.grammar.noun_phrase import NounPhrase
from ippon.guidance.language.words import word_set

_PLACEHOLDERS: Final = word_set(
    "thing thingy thingie thingamajig thingummy whatsit wotsit whatnot doodah doohickey gizmo item "
    "object whatchamacallit"
)
"""They stand for a name that does not come to mind."""


def take_item(
    reading: Reading, phrase: NounPhrase, order: Order, asked: str, *, apposed: bool = False
) -> None:
    """Take a noun phrase as an object of the list that is being read."""
    goal = draft(phrase, order if reading.drafts else "and", asked)
    told = next(
        (one for one in reading.drafts if one.head == goal.head and one.trigger == "told"),
        None,
    )
    if told is not None and not goal.attributes:
        reading.drafts.remove(told)
        reading.drafts.append(told)
        return
    if asked not in UNASKED:
        # "The rings! Has anyone seen the rings?"
        named = [one for one in reading.drafts if one.head == goal.head and _is_only_named(one)]
        reading.drafts = [one for one in reading.drafts if one not in named]
    last = reading.drafts[-1] if reading.drafts else None
    if last is not None and not phrase.head and not last.attributes and selects(last, asked):
        # "There are two umbrellas, I need the black one."
        for one in phrase.attributes:
            last.add(one)
        last.count = 1 if phrase.count is None else phrase.count
        last.reference = phrase.reference or last.reference
        return
    if not phrase.head or describes_declined(reading, phrase):
        refer(reading, goal)
        for one in replaced(reading, asked, other=goal.reference == "other"):
            reading.drafts.remove(one)
    elif complained(reading, asked):
        reading.drafts.pop()
    reading.list_start = min(reading.list_start, len(reading.drafts))
    for place in reading.places:
        goal.relate(place)
    for words in reading.before:
        state(reading, words, [goal])
    only_denied = last is not None and apposed and all(one.negated for one in last.attributes)
    same = last is not None and f" {goal.head}".endswith(f" {last.head}")
    if last is not None and only_denied and last.attributes and same:
        last.head, last.display = goal.head, goal.display
        for one in goal.attributes:
            last.add(one)  # "The jacket, not the leather one, the denim jacket".
        return
    if last is not None and apposed and last.head in _PLACEHOLDERS:
        last.head, last.phrase = "", phrase  # "The thing, the corkscrew".
    if last is not None and not last.head and goal.head:
        last.head = goal.head
        last.display = " ".join([*(one.value for one in last.attributes), goal.head])
        plain = not (last.phrase.attributes and goal.attributes)
        if goal.order == "and" and phrase.determined and plain and apposed:
            # "The one with the lid, the big pot."
            for one in goal.attributes:
                last.add(one)
            return
    reading.drafts.append(goal)
    # The next object of a list shares a place that was said first; what was told is used up.
    reading.before = []


def _is_only_named(goal: Draft) -> bool:
    return goal.trigger == "bare" and not (goal.attributes or goal.relations or goal.context)

"""Places that are named by a pronoun: "the sofa and the bag behind it"."""

from typing import Final

from ippon.guidance.language.goals.drafts import Reading
from ippon.guidance.language.goals.features import BE, SUBJECTS
from ippon.guidance.language.goals.goal import Relation
from ippon.guidance.language.grammar.noun_ends import STANDS
from ippon.guidance.language.grammar.relation_phrase import prepositions_at

_NAMING: Final = ("it", "them", "that", "those", "this")


def read_place_named(reading: Reading, index: int) -> int:
    """Read "behind it" after an object as a place at the object before.

    Returns:
        Index after it; `index` where no such words stand.
    """
    said, goal = reading.said, reading.drafts[-1]
    start = index
    while said.word(start) in SUBJECTS | BE | STANDS:
        start += 1
    relations, at = prepositions_at(said, start)
    ends = said.breaks(at + 1) or said.word(at + 1) in ("and", "or", "then", "please")
    if not relations or said.word(at) not in _NAMING or not ends:
        return index
    if len(reading.drafts) > 1:
        before = reading.drafts[-2]
        name, attributes = before.head, tuple(before.attributes)
    elif reading.places:
        place = reading.places[-1]  # "Go to the sofa and find the bag next to it".
        name, attributes = place.place, place.attributes
        goal.relations = [one for one in goal.relations if one != place]
    else:
        return index
    for relation in relations:
        goal.relate(Relation(relation=relation, place=name, attributes=attributes))
        goal.note(goal.relations[-1].text)
    return at + 1

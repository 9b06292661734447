"""Places that are named by a pronoun: "the sofa and the bag behind it"."""

from typing import Final

from ippon.guidance.language.grammar.relation_phrase import prepositions_at
from ippon.guidance.language.requests.drafts import Reading
from ippon.guidance.language.requests.features import BE, SUBJECTS
from ippon.guidance.language.requests.goals import Relation

_NAMING: Final = ("it", "them", "that", "those", "this")


def read_place_named(reading: Reading, index: int) -> int:
    """Read "behind it" after an object as a place at the object before.

    Returns:
        Index after it; `index` where no such words stand.
    """
    said = reading.said
    if len(reading.drafts) < 2:
        return index
    start = index
    while said.word(start) in SUBJECTS or said.word(start) in BE:
        start += 1
    relations, at = prepositions_at(said, start)
    ends = said.breaks(at + 1) or said.word(at + 1) in ("and", "or", "then", "please")
    if not relations or said.word(at) not in _NAMING or not ends:
        return index
    before = reading.drafts[-2]
    for relation in relations:
        place = Relation(relation=relation, place=before.head, attributes=tuple(before.attributes))
        reading.drafts[-1].relate(place)
        reading.drafts[-1].note(place.text)
    return at + 1

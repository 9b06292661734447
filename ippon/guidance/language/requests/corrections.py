"""What takes the place of what was said before: "no, the scarf", "no, in the hallway"."""

from ippon.guidance.language.context_words import NEGATIONS
from ippon.guidance.language.goals.drafts import Draft, Reading
from ippon.guidance.language.goals.goal import Attribute
from ippon.guidance.language.grammar.attributes import is_part
from ippon.guidance.language.grammar.determiners import NUMBERS, count_again
from ippon.guidance.language.grammar.noun_phrase import NounPhrase, read_noun_phrase
from ippon.guidance.language.grammar.places import is_room
from ippon.guidance.language.grammar.relation_phrase import read_relation, relation_to
from ippon.guidance.language.lists.goal_list import BE, read_goals, read_modifiers
from ippon.guidance.language.words import is_mass


def read_correction(reading: Reading, index: int, start: int) -> int:
    """Let what is said anew take the place of the last object, its attributes or its place.

    Args:
        reading: The sentence; it has an object.
        index: Index of the words that take back, such as "no".
        start: Index of what is said anew.

    Returns:
        Index after it; `index` where nothing is said anew.
    """
    said, last = reading.said, reading.drafts[-1]
    if said.word(start) in NEGATIONS:
        return max(index, read_modifiers(reading, start))  # "A mug, no, not the chipped one".
    if said.word(start - 1) == "no" and not said.breaks(start) and said.breaks(index):
        part = read_noun_phrase(said, start)
        if part is not None and part.head and part.shared and _is_lacking(part):
            last.add(Attribute(kind="feature", value=part.display, negated=True))
            return part.end  # "A suitcase, no wheels".
        reading.unused += [said.said(index, start)] if part is not None and part.shared else []
    counted = count_again(said, start)
    if counted:
        last.count = NUMBERS[said.word(start)]
        return start + counted  # "Two mugs, no, three".
    relation = read_relation(said, start, verbs=False)
    if relation is not None:
        last.relations = [*relation.relations]
        last.context = [said.said(start, relation.end)]
        return relation.end
    phrase = read_noun_phrase(said, start)
    if phrase is None or (said.word(phrase.end) in BE and not said.breaks(phrase.end)):
        return index
    if last.relations and is_room(phrase.head) and said.breaks(phrase.end):
        place = relation_to(said, start, phrase, last.relations[-1].relation)
        last.relations, last.context = [place], [place.text]
        return phrase.end  # "In the kitchen, no, the hall".
    if phrase.head:
        return _replace_object(reading, start) or index
    place = read_relation(said, phrase.end) if not said.breaks(phrase.end) else None
    if place is not None and not phrase.attributes:
        last.relations, last.context = [*place.relations], [said.said(phrase.end, place.end)]
        return place.end
    _describe_anew(last, phrase)
    return phrase.end


def _is_lacking(part: NounPhrase) -> bool:
    """Tell whether "no" and a noun say what an object is without, not which other is meant."""
    last = part.display.lower().rpartition(" ")[2]
    return is_part(last) or is_mass(last) or (part.display.endswith("s") and not part.known)


def _describe_anew(last: Draft, phrase: NounPhrase) -> None:
    if phrase.count is not None:
        last.count = phrase.count or 1
        return
    last.attributes = list(phrase.attributes)
    last.display = " ".join([*(one.value for one in phrase.attributes), last.head])


def _replace_object(reading: Reading, start: int) -> int:
    """Read the objects at an index in place of the last; 0 where there is none."""
    last = reading.drafts[-1]
    before = len(reading.drafts)
    listed = before - reading.list_start
    reading.order = last.order
    end = read_goals(reading, start, last.trigger)
    new = reading.drafts[before:]
    if not new:
        return 0
    # A whole list that is said again takes the place of the whole list.
    first = new[0]
    again = any(one.head == first.head for one in reading.drafts[before - listed : before])
    replaced = listed if len(new) == listed or again else 1
    for place in last.relations:
        first.relate(place)
    first.context += [words for words in last.context if words not in first.context]
    del reading.drafts[before - replaced : before]
    reading.list_start = before - replaced
    return end

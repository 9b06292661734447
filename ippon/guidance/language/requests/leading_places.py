"""Places that are said before the object: "look in the kitchen for", "on my desk is a"."""

import re
from dataclasses import replace

from ippon.guidance.language.context_words import ABSTRACT, BELIEFS, DOUBTS, SEARCHED
from ippon.guidance.language.goals.drafts import Reading
from ippon.guidance.language.goals.goal import ALL, Relation
from ippon.guidance.language.grammar import phrases
from ippon.guidance.language.grammar.guesses import is_guessed_before
from ippon.guidance.language.grammar.noun_phrase import NounPhrase, read_noun_phrase
from ippon.guidance.language.grammar.phrases import PREPOSITIONS
from ippon.guidance.language.grammar.places import holds_things, is_room, is_searched_inside
from ippon.guidance.language.grammar.relation_phrase import read_relation, relation_to
from ippon.guidance.language.grammar.utterance import Utterance, hear
from ippon.guidance.language.lists.goal_list import read_goals
from ippon.guidance.language.requests.courtesy import skip_asking
from ippon.guidance.language.words import word_set

_SEARCHED = word_set("check search try inspect explore comb scan")
"""What stands behind these without a preposition is a place."""
_LEADING = word_set("so and then but please you")
"""They may stand before what says where to look."""
_GUESSED = word_set("think believe guess bet suppose might may maybe perhaps probably")


def read_place_first(reading: Reading, index: int) -> int:
    """Read "look in the kitchen for" and "go to the kitchen and"."""
    said = reading.said
    leading = max(_read_leading_place(reading, index), _read_several_places(reading, index))
    if leading > index:
        return leading
    start = said.tokens[index].start
    looked = phrases.LOOKED.match(said.text, start)
    match = None if looked else phrases.GO.match(said.text, start)
    matched = looked or match
    if matched is None:
        return index
    end = reading.after(matched.end())
    stated = looked is None and match is not None and match["there"] is not None
    last = end if stated else end - 1  # Without "and" or "for".
    if looked is None and match is not None and match["place"].startswith(("for ", "high")):
        return index
    after = skip_asking(reading, end)
    guessed = bool(_GUESSED & set(said.words(last, after)))
    phrase = read_noun_phrase(said, after)
    if phrase is None:
        return index
    relations: list[Relation] = []
    at = index
    while at < last:
        found = read_relation(said, at)
        relations += found.relations if found else ()
        at = found.end if found else at + 1
    everywhere = False
    begin = reading.after(match.start("place")) if match is not None else index
    place = read_noun_phrase(said, begin, of=False) if match is not None else None
    searched = said.word(begin - 1) in _SEARCHED or said.word(begin - 2) in _SEARCHED
    searched = searched and said.word(begin - 1) not in PREPOSITIONS
    if relations and place is not None and place.head and place.count != ALL and searched:
        relations.insert(0, _at(said, begin, place))  # "Check the fridge in the basement for".
    if looked is not None and not relations:
        verb = next(n for n in range(index, last) if said.word(n) in SEARCHED)
        place = read_noun_phrase(said, verb + 1, of=False)
        relations = [_at(said, verb + 1, place)] if place is not None and place.head else []
    if not relations and match is not None:
        place_end = reading.after(match.end("place"))
        if place is None or place.end < place_end or _is_adverb(place):
            return index
        everywhere = place.count == ALL or said.word(place_end - 1) in ("house", "flat")
        relations = [] if everywhere else [_at(said, begin, place)]
    if not relations and not everywhere:
        return index
    denied = [one for one in reading.places if one.negated]
    found = [] if guessed else relations
    reading.places = denied + [
        replace(one, negated=one.negated or looked is not None) for one in found
    ]
    reading.before.append(said.said(index, last))
    return read_goals(reading, after, said.said(index, after))


def read_place_again(reading: Reading, index: int) -> int:
    """Read "look in the pantry for the flour" after "the kitchen, no," in place of the room.

    Returns:
        Index after it; `index` where no room alone, or no other place, was named.
    """
    last = reading.drafts[-1]
    plain = len(reading.drafts) == 1 and not (last.attributes or last.relations)
    if not plain or last.trigger != "bare" or not is_room(last.head):
        return index
    reading.drafts.clear()
    end = read_place_first(reading, index) if index < len(reading.said) else index
    if end == index:
        reading.drafts.append(last)
    return end


def _is_place(phrase: NounPhrase, *, first: bool) -> bool:
    """Tell whether a noun phrase alone says where: "second floor, room 210, top cupboard:"."""
    part = not first and holds_things(phrase.head) and bool(phrase.attributes) and phrase.shared
    numbered = phrase.head.startswith("room ") or phrase.head.endswith("floor")
    named = is_room(phrase.head) or (numbered and bool(phrase.attributes or " " in phrase.head))
    return named or part


def _is_adverb(place: NounPhrase) -> bool:
    """Tell whether a place is none: "up" of "look up, there is"."""
    return place.head in ("up", "down", "out", "away", "back", "off", "ahead", "along")


def _at(said: Utterance, start: int, place: NounPhrase) -> Relation:
    """Return the relation to a place that is named at a word without a preposition."""
    one = relation_to(said, start, place, "at")
    return replace(one, relation="in") if is_searched_inside(one.place) else one


def read_hint(reading: Reading, index: int) -> int:
    """Read "look behind the door" after an object: where to look for it."""
    said = reading.said
    begun = said.breaks(index) or said.word(index - 1) in _LEADING
    at = reading.match(phrases.LOOK, index) if reading.drafts and begun else index
    if at == index:
        return index
    seen = read_noun_phrase(said, at + 1, of=False) if said.word(at) == "at" else None
    if seen is not None and seen.known and not holds_things(seen.head):
        return index  # "Look at the dog".
    first = read_noun_phrase(said, at, of=False)
    relations, end = list[Relation](), at
    placed = first is not None and first.head not in ABSTRACT
    if first is not None and placed and (holds_things(first.head) or not first.known):
        relations, end = [_at(said, at, first)], first.end
    while (place := read_relation(said, end, verbs=False)) is not None and not place.soft:
        relations, end = [*relations, *place.relations], place.end
    after = end + said.starts(end, ("first", "instead", "please", "again", "for it", "for them"))
    if not relations or not said.breaks(after):
        return index
    for goal in reading.drafts[reading.list_start :]:
        goal.note(said.said(index, end))
        for one in relations if not is_guessed_before(said, index) else ():
            goal.relate(one)
    return after


def _whole_place(name: str) -> tuple[Utterance, NounPhrase] | None:
    """Return the place that a text names and nothing else; None for other texts."""
    said = hear(name)
    place = read_noun_phrase(said, 0)
    whole = place is not None and place.head and place.end == len(said)
    return (said, place) if place is not None and whole else None


def _read_several_places(reading: Reading, index: int) -> int:
    """Read "check the hall, the study first, then the attic for"."""
    match = phrases.SEVERAL.match(reading.said.text, reading.said.tokens[index].start)
    if match is None:
        return index
    names = re.split(r"(?: first)?(?:,? and then |,? then |,? and |,? or |, )", match["places"])
    places = [_whole_place(name) for name in names]
    known = [place for place in places if place is not None]
    after = reading.after(match.end())
    phrase = read_noun_phrase(reading.said, after)
    sure = any(place.known or is_room(place.head) for _, place in known)
    if len(names) < 2 or len(known) < len(names) or not sure or phrase is None:
        return index
    reading.places = [_at(named, 0, place) for named, place in known]
    reading.before.append(reading.said.said(index, after - 1))
    return read_goals(reading, after, "bare")


def _read_leading_place(reading: Reading, index: int) -> int:
    """Read "upstairs in the hall: the hat", "kitchen: scissors", "on my desk is a folder"."""
    said = reading.said
    begins = not index or said.ends(index) or said.word(index - 1) == "somewhere"
    if reading.drafts or not begins:
        return index
    end, relations = index, list[Relation]()
    while (place := read_relation(said, end, verbs=end > index)) is not None:
        believed = (BELIEFS | DOUBTS) & set(said.words(end, place.end))
        end, relations = place.end, [*relations, *(() if believed else place.relations)]
        end += said.starts(end, phrases.SIDES)
    room = None if relations else read_noun_phrase(said, index)
    while room is not None and _is_place(room, first=not relations) and said.breaks(room.end):
        if said.ends(room.end):
            break
        on = room.head == "shelf" or room.head.endswith("floor")
        relations.append(relation_to(said, end, room, "on" if on else "in"))
        end = room.end
        room = read_noun_phrase(said, end)
    verb = said.word(end) in ("is", "are", "lies", "there", "there's")
    if not relations or not (verb or said.breaks(end)) or end >= len(said):
        return index
    after = skip_asking(reading, end) if said.word(end).startswith("there") else end + verb
    after = after if verb else skip_asking(reading, after)
    phrase = read_noun_phrase(said, after)
    if phrase is None or not (phrase.known or phrase.determined) or is_room(phrase.head):
        return index
    reading.places = [*reading.places, *relations]
    reading.before.append(said.said(index, end))
    return read_goals(reading, after, "bare")

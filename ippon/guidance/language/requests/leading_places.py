"""Places that are said before the object: "look in the kitchen for", "on my desk is a"."""

from dataclasses import replace

from ippon.guidance.language.requests import phrases
from ippon.guidance.language.requests.courtesy import skip_asking
from ippon.guidance.language.requests.drafts import Reading
from ippon.guidance.language.requests.goals import ALL, Relation
from ippon.guidance.language.requests.lists import read_goals
from ippon.guidance.language.requests.noun_phrase import read_noun_phrase
from ippon.guidance.language.requests.relation_phrase import (
    is_room,
    is_searched_inside,
    read_relation,
)


def read_place_first(reading: Reading, index: int) -> int:
    """Read "look in the kitchen for" and "go to the kitchen and"."""
    said = reading.said
    leading = _read_leading_place(reading, index)
    if leading > index:
        return leading
    start = said.tokens[index].start
    looked = phrases.LOOKED.match(said.text, start)
    match = None if looked else phrases.GO.match(said.text, start)
    matched = looked or match
    if matched is None:
        return index
    end = reading.after(matched.end())
    if looked is None and match is not None and match["place"].startswith(("for ", "high")):
        return index
    after = skip_asking(reading, end)
    phrase = read_noun_phrase(said, after)
    if phrase is None:
        return index
    found = next((one for at in range(index, end) if (one := read_relation(said, at))), None)
    relations: list[Relation] = list(found.relations) if found else []
    everywhere = False
    if not relations and match is not None:
        place = read_noun_phrase(said, reading.after(match.start("place")), of=False)
        place_end = reading.after(match.end("place"))
        if place is None or place.end < place_end:
            return index
        everywhere = place.count == ALL or said.word(place_end - 1) in ("house", "flat")
        relation_word = "in" if is_searched_inside(place.head) else "at"
        relations = [] if everywhere else [Relation(relation=relation_word, place=place.head)]
    if not relations and not everywhere:
        return index
    denied = [one for one in reading.places if one.negated]
    reading.places = denied + [
        replace(one, negated=one.negated or looked is not None) for one in relations
    ]
    reading.before.append(said.said(index, end - 1))
    return read_goals(reading, after, said.said(index, after))


def _read_leading_place(reading: Reading, index: int) -> int:
    """Read "upstairs in the hall: the hat", "kitchen: scissors", "on my desk is a folder"."""
    said = reading.said
    if reading.drafts or (index and not said.ends(index)):
        return index
    end, relations = index, list[Relation]()
    while (place := read_relation(said, end, verbs=end > index)) is not None:
        end, relations = place.end, [*relations, *place.relations]
        end += said.starts(end, phrases.SIDES)
    room = None if relations else read_noun_phrase(said, index)
    if room is not None and is_room(room.head) and ":" in said.gap(room.end):
        end, relations = room.end, [Relation(relation="in", place=room.head)]
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

"""Objects that come after others which are said later: "before the keys, find my wallet"."""

from ippon.guidance.language.goals.drafts import Reading, draft
from ippon.guidance.language.goals.goal import Order
from ippon.guidance.language.goals.modifiers import read_modifier
from ippon.guidance.language.grammar import phrases
from ippon.guidance.language.grammar.noun_phrase import read_noun_phrase
from ippon.guidance.language.grammar.places import is_room
from ippon.guidance.language.lists.goal_list import read_goals
from ippon.guidance.language.requests.courtesy import skip_asking


def read_before(reading: Reading, index: int) -> int:
    """Read "before you find the mop"; what is no object ("before we leave") is left."""
    said = reading.said
    start = index + (said.word(index) in ("but", "and"))
    if said.word(start) != "before":
        return index
    if said.word(start + 1) in ("that", "this") and reading.drafts:
        return _read_preceding(reading, start + 2) or index
    start += 1 + (said.word(start + 1) in ("you", "we", "i"))
    asked = skip_asking(reading, start)
    phrase = read_noun_phrase(said, asked)
    if phrase is None or not phrase.head or not phrase.known or is_room(phrase.head):
        return index
    later = draft(phrase, "then", "listed")
    end = phrase.end
    while not said.breaks(end) and (more := read_modifier(said, end, later)) > end:
        end = more
    complete = said.breaks(end) or reading.match(phrases.ASKED, end) > end
    if not complete or not (asked > start or phrase.determined):
        return index
    if reading.drafts:
        reading.drafts.append(later)
    else:
        reading.later.append(later)
    return end


def read_after(reading: Reading, index: int) -> int:
    """Read "after you find the mug," and "if you can't find the mug," as the first of two."""
    start = reading.match(phrases.ONCE_FOUND, index)
    order: Order = "then" if start > index else "or"
    start = start if start > index else reading.match(phrases.UNLESS_FOUND, index)
    phrase = read_noun_phrase(reading.said, start) if start > index else None
    if reading.drafts or phrase is None or not phrase.head or is_room(phrase.head):
        return index
    end = read_goals(reading, start, "listed")
    if len(reading.drafts) > 1:
        reading.drafts[1].order = order
    else:
        reading.order = order
    return end


def _read_preceding(reading: Reading, index: int) -> int:
    """Read "before that, find the dog"; 0 where no object follows."""
    told = len(reading.drafts)
    end = read_goals(reading, skip_asking(reading, index), "listed")
    first, then = reading.drafts[told:], reading.drafts[:told]
    if not first:
        return 0
    first[0].order, then[0].order = "and", "then"
    reading.drafts = [*first, *then]
    return end

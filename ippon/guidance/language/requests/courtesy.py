"""Courtesy and what only asks: words that name neither an object nor a place."""

from typing import Final

from ippon.guidance.language.goals.drafts import Reading
from ippon.guidance.language.grammar import phrases
from ippon.guidance.language.grammar.attributes import listed_kind
from ippon.guidance.language.grammar.determiners import NO_OWNERS, may_be_noun
from ippon.guidance.language.grammar.noun_phrase import read_noun_phrase
from ippon.guidance.language.grammar.places import is_room
from ippon.guidance.language.lists.goal_list import continues

_LONGEST: Final = 9
_VISIBLE: Final = ("colour", "size", "material", "pattern", "shape")


def skip_announcement(reading: Reading, index: int) -> int:
    """Skip what announces a request and names nothing: "here's an easy one:"."""
    said = reading.said
    if reading.drafts or (index and not said.breaks(index)):
        return index
    end = index + 1
    while end < len(said) and not said.breaks(end):
        end += 1
    words = said.words(index, end)
    vague = "something" in words and not any(listed_kind(word) in _VISIBLE for word in words)
    if end - index > _LONGEST or not (":" in said.gap(end) or vague) or said.ends(end):
        return index
    if any(_names(reading, n) for n in range(index, end)):
        return index
    start = skip_asking(reading, end)
    phrase = read_noun_phrase(said, start)
    asked = phrase is not None and phrase.head and (phrase.determined or phrase.known)
    return end if asked and phrase is not None and not is_room(phrase.head) else index


def _names(reading: Reading, index: int) -> bool:
    """Tell whether a thing, a place, an owner or a number stands at a word."""
    word = reading.said.word(index)
    if word[:1].isdigit() or (word.endswith("'s") and word not in NO_OWNERS):
        return True
    phrase = read_noun_phrase(reading.said, index, of=False)
    return phrase is not None and bool(phrase.head) and (phrase.known or is_room(phrase.head))


def skip_courtesy(reading: Reading, index: int) -> int:
    """Skip courtesy and who says it; "and" is left where it goes on with an object."""
    said = reading.said
    if not reading.drafts:
        end = reading.match(phrases.SAYS, index)
        if end > index:
            reading.hedged[end] = index
            return end
    end = reading.match(phrases.PADDING, index)
    if end == index + 1 and listed_kind(said.word(index)) and may_be_noun(said, end):
        return index
    if end > index and said.word(index) in ("and", "but", "also") and reading.drafts:
        return index if end == index + 1 and continues(reading, index) else end
    return end


def skip_asking(reading: Reading, index: int) -> int:
    """Skip padding and a verb that asks."""
    while index < len(reading.said):
        end = reading.match(phrases.ASKED, index)
        end = end if end > index else skip_courtesy(reading, index)
        if end == index:
            break
        index = end
    return index

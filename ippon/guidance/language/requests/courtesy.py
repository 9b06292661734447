"""Courtesy and what only asks: words that name neither an object nor a place."""

from ippon.guidance.language.grammar import phrases
from ippon.guidance.language.grammar.attributes import listed_kind
from ippon.guidance.language.grammar.determiners import may_be_noun
from ippon.guidance.language.requests.drafts import Reading
from ippon.guidance.language.requests.lists import continues


def skip_courtesy(reading: Reading, index: int) -> int:
    """Skip courtesy and who says it; "and" is left where it goes on with an object."""
    said = reading.said
    if not reading.drafts:
        end = reading.match(phrases.SAYS, index)
        if end > index:
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

"""What somebody has or finds without the robot: "the rum I can find myself"."""

from typing import Final

from ippon.guidance.language.goals.drafts import Reading
from ippon.guidance.language.grammar.noun_phrase import NounPhrase, read_noun_phrase
from ippon.guidance.language.grammar.utterance import Utterance
from ippon.guidance.language.words import word_set

_HAVING: Final = (
    "i have", "we have", "i already have", "we already have", "i've got", "we've got",
    "i've already got", "we've already got", "i have got",
)  # fmt: skip
_ABLE: Final = ("i can", "we can", "i could", "we could", "i will", "we will", "i'll", "we'll")
_ALONE: Final = ("myself", "ourselves", "on my own", "on our own", "alone")
_WHO = word_set("i we i've we've i'll we'll")
_REACH: Final = 8
"""So many words may hold a thing and who has it."""
_HERE = word_set("already here with me now")


def is_left_out(said: Utterance, phrase: NounPhrase) -> bool:
    """Tell whether a thing is named that somebody has, or will get without help."""
    return _end(said, phrase) > phrase.end


def _end(said: Utterance, phrase: NounPhrase) -> int:
    index = phrase.end
    if not phrase.head or said.breaks(index):
        return index
    able = said.starts(index, _ABLE)
    if able:
        alone = said.starts(index + able + 1, _ALONE)  # "I can find myself".
        end = index + able + 1 + alone if alone else index
    else:
        end = index + said.starts(index, _HAVING)
    while end > index and said.word(end) in _HERE and not said.breaks(end):
        end += 1
    return end if said.breaks(end) else index


def skip_left_out(reading: Reading, index: int) -> int:
    """Skip a thing that somebody has or gets without help, and note it as not used.

    Returns:
        Index after it; `index` where none is named, or no other object before it.
    """
    said = reading.said
    begins = index + (said.word(index) in ("and", "but"))
    if not reading.drafts or not (said.breaks(index) or begins > index):
        return index
    if not _WHO & set(said.words(begins + 1, begins + _REACH)):
        return index
    phrase = read_noun_phrase(said, begins)
    if phrase is None or not is_left_out(said, phrase):
        return index
    last = reading.drafts[-1]
    last.attributes = [
        one for one in last.attributes if not (one.negated and one.value.endswith(phrase.head))
    ]
    end = _end(said, phrase)
    reading.unused.append(said.said(index, end))
    return end

"""What is said of a whole list: which comes first, and how many of each."""

from typing import Final

from ippon.guidance.language.goals.drafts import Reading
from ippon.guidance.language.grammar.determiners import NUMBERS
from ippon.guidance.language.grammar.noun_phrase import NounPhrase, read_noun_phrase
from ippon.guidance.language.words import is_mass, word_set

_REACH: Final = 8
"""So many words may hold a thing and "first"."""
_PACKAGES = word_set("can carton bottle jar tin pack packet box bag tube tub roll")


def is_named_first(reading: Reading, phrase: NounPhrase) -> bool:
    """Tell whether "the torch first" names one of the objects before."""
    return _place_of(reading, phrase) is not None


def _place_of(reading: Reading, phrase: NounPhrase) -> int | None:
    """Return the number of the object before that a phrase names as the first; None for none."""
    said = reading.said
    first = said.word(phrase.end) == "first" and not said.breaks(phrase.end)
    if not (first and said.breaks(phrase.end + 1)) and not _after_first(reading, phrase):
        return None
    said_of = [one for one in phrase.attributes if one.value != "first"]
    for number, goal in enumerate(reading.drafts):
        if goal.head == phrase.head and all(one in goal.attributes for one in said_of):
            return number
    return None


def _after_first(reading: Reading, phrase: NounPhrase) -> bool:
    """Tell whether "first" is read as one of several: "the scarf first please"."""
    return reading.said.word(phrase.end - 1) == "first" and len(phrase.attributes) == 1


def read_first_of(reading: Reading, index: int) -> int:
    """Read "the torch first" after "two radios and a torch"; returns the index after it."""
    said = reading.said
    if len(reading.drafts) < 2 or not said.breaks(index):
        return index
    if "first" not in said.words(index, index + _REACH):
        return index
    phrase = read_noun_phrase(said, index)
    number = _place_of(reading, phrase) if phrase is not None else None
    if phrase is None or number is None:
        return index
    reading.drafts.insert(0, reading.drafts.pop(number))
    reading.drafts[0].order = "and"
    reading.drafts[1].order = "then"
    return phrase.end + (said.word(phrase.end) == "first")


def read_each(reading: Reading, index: int) -> int:
    """Read "three of each"; returns the index after it, the same for other words."""
    said = reading.said
    if said.word(index) not in NUMBERS or said.words(index + 1, index + 3) != ["of", "each"]:
        return index
    if not said.breaks(index + 3):
        return index
    reading.each = NUMBERS[said.word(index)]
    return index + 3


def settle_each(reading: Reading) -> None:
    """Let the number of each be that of all objects without their own."""
    for one in reading.drafts if reading.each else ():
        if one.phrase.count is None:
            one.count = reading.each


def read_packages(reading: Reading, index: int) -> int:
    """Read "two cans" after "paint" alone; returns the index after it, the same for none."""
    said, goal = reading.said, reading.drafts[-1]
    alone = len(reading.drafts) == 1 and goal.phrase.count is None and is_mass(goal.head)
    if not alone or not said.breaks(index) or said.ends(index):
        return index
    phrase = read_noun_phrase(said, index)
    if phrase is None or phrase.head not in _PACKAGES or phrase.attributes:
        return index
    if not isinstance(phrase.count, int) or not said.ends(phrase.end):
        return index
    goal.count = phrase.count
    goal.note(said.said(index, phrase.end))
    return phrase.end

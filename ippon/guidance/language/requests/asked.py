"""What is asked for: "find", "where is", "is there any", and the goals behind it."""

import re
from dataclasses import replace
from typing import Final

from ippon.guidance.knowledge import load_knowledge
from ippon.guidance.language.context_words import NEGATIONS
from ippon.guidance.language.goals.drafts import Reading, draft
from ippon.guidance.language.goals.placed import read_placed
from ippon.guidance.language.grammar import phrases
from ippon.guidance.language.grammar.attributes import listed_kind
from ippon.guidance.language.grammar.determiners import NUMBERS, count_again
from ippon.guidance.language.grammar.noun_phrase import read_noun_phrase
from ippon.guidance.language.grammar.places import is_room
from ippon.guidance.language.grammar.relation_phrase import read_relation
from ippon.guidance.language.lists.goal_list import read_goals
from ippon.guidance.language.lists.list_order import read_each
from ippon.guidance.language.words import word_set

_WANTING: Final = re.compile(
    r"(?!(?:(?:so|and|but|now|well) )?"
    r"(?:i|we|you|he|she|they|who|what|where|in|on|i've|we've|i'm|we're)\b).*\w "
    r"(?:needs?|wants?|misses|would like|has lost|(?:is|are) (?:looking|asking) for|"
    r"ask(?:s|ed)? for|requests|requested)\s*$",
    re.IGNORECASE,
)
"""Who needs the object, where somebody is named."""
_TOLD: Final = 4
"""So many words after "it's a bracelet," may hold "it"."""
_REPEATING = ("it", "they", "them", "him", "her", "some", "any", "one")
_MISSED = word_set("find see seen found remember know")
_LACKING = ("no ", "there", "i ", "we ", "i've", "we've")
"""Beginnings of "there is no" and "we have no"."""


def read_asked(reading: Reading, index: int) -> int:
    """Read what asks for something, and the goals behind it.

    Args:
        reading: Of the sentence; gets the goals.
        index: Of the first word.

    Returns:
        Index of the word after it; `index` where nothing is asked for.
    """
    said = reading.said
    if _names_a_thing(reading, index):
        return index
    named = _identified(reading, index)
    if named > index:
        return read_goals(reading, named, said.said(index, named))
    end = reading.match(phrases.ASKED, index)
    if end == index:
        return index
    start = end
    while start < len(said) and (more := reading.match(phrases.PADDING, start)) > start:
        if more == start + 1 and listed_kind(said.word(start)):
            break
        start = more
    start = read_each(reading, start)
    again = _read_again(reading, index, end, start)
    if again is not None:
        return again
    asked = said.said(index, end)
    told = reading.match(phrases.TOLD, start) if "where" in asked.lower() else start
    owned = read_noun_phrase(said, told) if told > start else None
    if owned is not None and owned.determined:
        start = told  # "Where the kids have hidden the remote".
    after = read_goals(reading, start, asked)
    if after > start:
        _describe(reading, start, asked, set(said.words(index, end)))
        return after
    if start == len(said):
        return index
    nested = reading.drafts or reading.match(phrases.TOLD, start) == start
    return index if nested and reading.match(phrases.ASKED, start) == start else start


def _identified(reading: Reading, index: int) -> int:
    """Return the index after "it's" of "it's a thin bracelet, it was in": what is sought.

    The same for others: what follows must name a thing of the table, and "it" must stand for it.
    """
    said = reading.said
    if reading.drafts or reading.places or (index and not said.ends(index)):
        return index
    start = index + 1 + (said.word(index + 1) in ("is", "was"))
    if said.word(index) != ("it's" if start == index + 1 else "it"):
        return index
    phrase = read_noun_phrase(said, start)
    if phrase is None or not (phrase.known and phrase.determined and phrase.head):
        return index
    ends = is_room(phrase.head) or not said.breaks(phrase.end)
    told = said.words(phrase.end, phrase.end + _TOLD)
    return index if ends or not {"it", "it's"} & set(told) else start


def _names_a_thing(reading: Reading, index: int) -> bool:
    """Tell whether two words are a thing's name: "hand towel" is no order to hand one over."""
    said = reading.said
    if said.word(index) in ("get", "bring") or said.breaks(index + 1):
        return False
    return load_knowledge().find(" ".join(said.words(index, index + 2))) is not None


def _read_again(reading: Reading, index: int, end: int, start: int) -> int | None:
    """Read what asks again for what was named before: "find it", "is there one in".

    Returns:
        Index of the word after it; None where it asks for something of its own.
    """
    said, word = reading.said, reading.said.word(start)
    subject = reading.subject
    if subject is not None and not reading.drafts and word in ("it", "them"):
        goal = draft(subject, "and", said.said(index, end))
        read_placed(said, subject.end, goal)
        reading.drafts.append(goal)
        return start + 1  # "The phone is ringing, find it".
    again = read_noun_phrase(said, start) if word in _REPEATING else None
    named = again is not None and bool(again.head)  # "Some paper".
    if word in _REPEATING and reading.drafts and not named:
        placed = word in ("some", "any", "one") and read_relation(said, start + 1)
        if placed and word == "one":
            last = reading.drafts[-1]  # "The last chair is taken, is there one in".
            last.attributes = [one for one in last.attributes if one.kind != "which"]
        end = start + 1 + (said.word(start + 1) in ("is", "are", "went"))  # "Where it is".
        return end if said.breaks(end) or placed else index
    if reading.drafts and (length := count_again(said, start)):
        reading.drafts[-1].count = NUMBERS[word]
        return start + length
    return None


def _describe(reading: Reading, start: int, asked: str, heard: set[str]) -> None:
    """Take from the words that ask what they say of the goals behind them."""
    said, goals = reading.said, reading.drafts[reading.list_start :]
    if " in " in asked or _WANTING.match(asked):
        reading.drafts[reading.list_start].note(asked)  # "The lady in room 12", "Tom needs".
    phrase = read_noun_phrase(said, start)
    placed = read_relation(said, phrase.end) if phrase is not None else None
    if NEGATIONS & heard and asked.lower().startswith(_LACKING) and placed is not None:
        # "There is no soap in the bathroom", "I couldn't find it on the shelf".
        absent = not _MISSED & heard or "couldn't" in heard
        absent_from = list(placed.relations)
        while said.word(placed.end) in ("or", "nor"):
            further = read_relation(said, placed.end)
            if further is None:
                break
            absent_from, placed = [*absent_from, *further.relations], further
        for goal in goals if absent else ():
            goal.relations = [
                replace(one, negated=True) if one in absent_from else one for one in goal.relations
            ]
    if asked.lower().startswith(("how many", "count")):
        reading.drafts[-1].count = "all"

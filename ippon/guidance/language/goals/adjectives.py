"""Adjectives that stand without their noun: "is blue and heavy", "isn't scratchy"."""

import re
from typing import Final

from ippon.guidance.language.goals.drafts import Draft
from ippon.guidance.language.goals.goal import Attribute
from ippon.guidance.language.grammar.attributes import (
    attribute_kind,
    is_intensity,
    is_shade,
    listed_kind,
)
from ippon.guidance.language.grammar.noun_phrase import read_noun_phrase
from ippon.guidance.language.grammar.phrases import PREPOSITIONS
from ippon.guidance.language.grammar.relation_phrase import prepositions_at
from ippon.guidance.language.grammar.utterance import Utterance
from ippon.guidance.language.languages import ENGLISH
from ippon.guidance.language.words import word_set

_MISSING = word_set("missing lost gone back")
_ADJECTIVE: Final = re.compile(
    r"un\w{3,}ed|\w{3,}(?:less|able|ible|ous|ish|proof)|\w{7,}ic|\w+(?:-\w+)?-(?:\w+ed|free)"
)
"""A word that is an adjective wherever it stands."""


def read_unlisted(said: Utterance, index: int, goal: Draft, *, negated: bool) -> int:
    """Read "scratchy" of "that isn't scratchy", which no table lists; 0 for other words."""
    word = said.word(index)
    kind = attribute_kind(word)
    ends = said.breaks(index + 1) or said.word(index + 1) in ("please", "and", "or", "but")
    if kind is None or not ends or word in _MISSING or word in ENGLISH:
        return 0
    goal.add(Attribute(kind=kind, value=word, negated=negated))
    return index + 1


def read_apposed(said: Utterance, index: int, goal: Draft) -> int:
    """Read ", unscratched," after an object; returns the index after it, the same for none."""
    word = said.word(index)
    alone = said.breaks(index) and said.breaks(index + 1) and not said.ends(index)
    if not alone or word in ENGLISH or not _ADJECTIVE.fullmatch(word):
        return index
    goal.add(Attribute(kind=attribute_kind(word) or "other", value=word))
    return index + 1


def read_adjectives(said: Utterance, start: int, goal: Draft, *, negated: bool) -> int:
    """Read a list of adjectives that stands alone; 0 where there is none."""
    index, found = start, 0
    while index < len(said):
        word = said.word(index)
        if (
            found
            and said.breaks(index)
            and not (
                "," in said.gap(index) and listed_kind(word) is not None and not said.ends(index)
            )
        ):
            break
        if (word in ("and", "but", "or", "nor") and found and is_adjective_at(said, index + 1)) or (
            is_intensity(word) and is_adjective_at(said, index + 1)
        ):
            index += 1
        elif is_adjective_at(said, index):
            kind = listed_kind(word) or "other"
            if is_shade(word) and listed_kind(said.word(index + 1)) == "colour":
                kind, word = "colour", f"{word} {said.word(index + 1)}"
            goal.add(Attribute(kind=kind, value=word, negated=negated))
            found += 1
            index += len(word.split())
        else:
            break
    if not found or (said.word(index) in ("one", "ones")):
        return 0
    noun = not said.breaks(index) and index < len(said) and _is_noun(said, index)
    if noun:
        del goal.attributes[-found:]
        return 0
    return index


def is_adjective_at(said: Utterance, index: int) -> bool:
    """Tell whether an adjective stands at a word, and no preposition."""
    word = said.word(index)
    if is_intensity(word) and listed_kind(word) is None:
        return is_adjective_at(said, index + 1)
    placing = word in ("right", "left") and bool(prepositions_at(said, index + 1)[0])
    free = word == "free" and said.word(index + 1) in ("of", "from")
    if placing or free or prepositions_at(said, index)[0]:
        return False  # "Right next to", "closest to", "free of nuts".
    return listed_kind(word) is not None and word not in _MISSING and word not in PREPOSITIONS


def _is_noun(said: Utterance, index: int) -> bool:
    phrase = read_noun_phrase(said, index, of=False)
    return phrase is not None and not phrase.determined and bool(phrase.head)

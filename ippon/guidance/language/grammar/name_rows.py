"""Names beside each other without a comma: "toothbrush toothpaste and a towel"."""

from functools import cache
from typing import Final

from ippon.guidance.knowledge import load_knowledge
from ippon.guidance.language.grammar.attributes import listed_kind
from ippon.guidance.language.grammar.determiners import NUMBERS, may_be_noun
from ippon.guidance.language.grammar.phrases import STOP
from ippon.guidance.language.grammar.utterance import Utterance, read_once
from ippon.guidance.language.words import singular_candidates, word_set

_DETERMINERS: Final = word_set("the my our your his her their a an some")
_LONGEST: Final = 4


def begins_name(said: Utterance, index: int) -> bool:
    """Tell whether a word begins another object of a row: "toothpaste", "the toaster"."""
    if said.breaks(index):
        return False
    if said.word(index) in _DETERMINERS:
        end = _name_end(said, index + 1)
        return end > index + 1 and _is_joined(said, end)
    if _row_start(said, index) < index and (
        said.word(index) in NUMBERS or said.word(index).isdecimal()
    ):
        end = _name_end(said, index + 1)
        several = end > index + 1 and said.word(end - 1).endswith("s")
        return several and not may_be_noun(said, end)  # "Three mugs two spoons".
    return index in _row(said, _row_start(said, index))


def stands_beside(said: Utterance, start: int, end: int) -> str:
    """Return the words of a row of names of which a noun phrase is one; empty where it is none."""
    while start < end and _name_end(said, start) == start:
        start += 1
    begin = _row_start(said, start)
    row = _row(said, begin)
    return said.said(begin, _name_end(said, row[-1])) if row and start < end else ""


def unclear_pair(said: Utterance, start: int, end: int) -> bool:
    """Tell whether two names of a list may be two objects or one: "hat gloves and scarf"."""
    first = _name_end(said, start) if listed_kind(said.word(start)) is None else start
    pair = start < first < end and _name_end(said, first) == end
    return pair and _is_joined(said, end) and not _both_determined(said, start, end)


def _row_start(said: Utterance, index: int) -> int:
    while index > 0 and not said.breaks(index) and _name_end(said, index - 1) == index:
        index -= 1
    return index + (listed_kind(said.word(index)) is not None)  # "Paper cups".


@read_once
def _row(said: Utterance, start: int) -> list[int]:
    """Return where the names of a row begin but the first; empty where they are one compound."""
    begins, end = [start], _name_end(said, start)
    while end > begins[-1] and not said.breaks(end) and _name_end(said, end) > end:
        begins.append(end)
        end = _name_end(said, end)
    if len(begins) == 2 and not (
        _is_joined(said, end)
        and not _both_determined(said, start, end)
        and _are_two(said, start, begins[1], end)
    ):
        return []
    return begins[1:]


@read_once
def _name_end(said: Utterance, index: int) -> int:
    """Return the index after the longest name of the table at a word; the same for none."""
    knowledge = load_knowledge()
    if said.word(index) in STOP or listed_kind(said.word(index)) not in (None, "material"):
        return index
    for end in range(min(index + _LONGEST, len(said)), index, -1):
        name = " ".join(said.words(index, end))
        whole = not any(said.breaks(n) or said.hyphened(n) for n in range(index + 1, end))
        if whole and not said.hyphened(end) and knowledge.find(name) is not None:
            return end
    return index


def _is_joined(said: Utterance, index: int) -> bool:
    """Tell whether "and" and one more object follow."""
    if said.word(index) not in ("and", "or") or said.breaks(index + 1):
        return False
    start = index + 1 + (said.word(index + 1) in _DETERMINERS)
    while listed_kind(said.word(start)) is not None:
        start += 1
    return said.word(index + 1) in _DETERMINERS or _name_end(said, start) > start


def _both_determined(said: Utterance, start: int, end: int) -> bool:
    """Tell whether "the bike bell and the torch" names two."""
    before = said.word(start - 1) in _DETERMINERS or listed_kind(said.word(start - 1)) is not None
    return before and said.word(end + 1) in _DETERMINERS


def _are_two(said: Utterance, start: int, middle: int, end: int) -> bool:
    """Tell whether two names are hardly one compound: "plates cups", "soap shampoo"."""
    several = any(load_knowledge().find(one) for one in singular_candidates(said.word(middle - 1)))
    last = said.word(end - 1)
    ends = last in _compound_ends() or last.endswith(("er", "or"))
    return (several and middle - start == 1) or not ends


@cache
def _compound_ends() -> frozenset[str]:
    """Return the last words of the names of several words: "rack" of "coat rack"."""
    ends = {name.rpartition(" ")[2] for name in load_knowledge().phrases if " " in name}
    return frozenset(ends | {single for word in ends for single in singular_candidates(word)})

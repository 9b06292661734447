"""The head of a noun phrase, and what describes it."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

from rapidfuzz.distance import OSA

from ippon.guidance.knowledge import Knowledge, load_knowledge
from ippon.guidance.language.context_words import STOREYS
from ippon.guidance.language.goals.goal import Attribute, AttributeKind
from ippon.guidance.language.grammar.attributes import (
    UNITS,
    attribute_kind,
    is_intensity,
    is_shade,
    listed_kind,
)
from ippon.guidance.language.grammar.determiners import NUMBERS
from ippon.guidance.language.languages import ENGLISH
from ippon.guidance.language.naming import resolve_object
from ippon.guidance.language.words import singular_candidates, word_set

_SIZES = ("a3", "a4", "a5", "aa", "aaa", "xs", "xl", "xxl")
ONES: Final = ("one", "ones", "kind", "sort", "type")
"""What stands for a thing that was named: "the blue one", "the wide kind"."""
CODE: Final = re.compile(r"[a-z]{1,4}\d+$")
"""A code or size of one of many: M8, K7."""
_POSTPOSED = ("wood", "metal", "plastic", "leather", "steel")
"""Materials that follow the noun in the English of some: "a chair wood"."""
_APPLIED: Final = word_set("glue paint polish varnish cleaner oil filler stain soap")
_SOFT: Final = word_set("linen paper cotton wool fabric")
_HOLDING: Final = word_set("cart trolley bin rack holder dispenser cutter shredder hamper")

_KINDS: Final[dict[str, AttributeKind]] = {
    "colour": "colour", "color": "colour", "coloured": "colour", "colored": "colour",
    "size": "size", "sized": "size", "shape": "shape", "shaped": "shape",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class NamedHead:
    """A head with its attributes."""

    head: str
    attributes: list[Attribute]
    known: bool
    corrected: bool
    crowded: bool


def name_head(
    spoken: list[str], words: list[str], count: int | str | None, knowledge: Knowledge
) -> NamedHead:
    """Tell the head of a noun phrase from what describes it."""
    words = _without_kinds(words, knowledge)
    if words[-1] in ONES:
        attributes, nouns = _describe(words[:-1])
        attributes += [Attribute(kind="other", value=noun) for noun in nouns]
        return NamedHead("", attributes, True, False, False)
    whole = " ".join(spoken)
    made_of = len(spoken) > 1 and _is_made_of(whole, spoken[0], knowledge)
    if not made_of and (knowledge.find(whole) or knowledge.room(whole)):
        return NamedHead(_single(spoken, count, knowledge), [], True, False, False)
    after: list[str] = []
    if len(words) > 1 and CODE.match(words[-1]) and knowledge.find(" ".join(words[:-1])):
        words, after = words[:-1], words[-1:]  # "The key K7".
    if len(words) > 2 and words[-2] == "size":
        words, after = words[:-2], words[-2:]
    start = _head_start(words, knowledge)
    while start is None and len(words) > 1 and listed_kind(words[-1]) is not None:
        after.insert(0, words.pop())
        start = _head_start(words, knowledge)
    if start is None and after:
        words, after = [*words, *after], []
    if start is None and all(
        listed_kind(word) is not None or _is_number(word) or word in UNITS for word in words
    ):
        return NamedHead("", _describe(words)[0], True, False, False)
    head, known, corrected = "", True, False
    if start is None:
        start, head = _respelt(words)
        corrected = bool(head) and head != f"{' '.join(words[start:])}s"  # "Airpod".
        if not head:
            start, known = _unknown_start(words), False
    head = head or _single(words[start:], count, knowledge)
    attributes, nouns = _describe(words[:start])
    if attributes and not nouns and _names_kind(attributes[-1], head, known=known):
        head = f"{attributes.pop().value} {head}"
    crowded = sum(knowledge.find(noun) is not None for noun in nouns) > 1
    if known and not corrected and nouns:
        head, corrected = _respelt_compound(nouns, head, knowledge)
    else:
        head = " ".join([*nouns, head])
    return NamedHead(head, [*attributes, *_describe(after)[0]], known, corrected, crowded)


def _names_kind(before: Attribute, head: str, *, known: bool) -> bool:
    """Tell whether a word says what a thing is for or reads: "wood glue", "wet floor sign"."""
    last = head.rpartition(" ")[2]
    if before.kind == "material":
        return last in _APPLIED or (before.value in _SOFT and last in _HOLDING)
    return before.value == "wet" and not known and last in ("sign", "notice")


def _without_kinds(words: list[str], knowledge: Knowledge) -> list[str]:
    """Leave out what only says of which kind an attribute is: "blue colour", "round shape"."""
    return [
        word
        for n, word in enumerate(words)
        if n == 0
        or _KINDS.get(word) is None
        or _KINDS[word] != listed_kind(words[n - 1])
        or knowledge.find(" ".join(words[n : n + 2])) is not None
    ]


def _head_start(words: list[str], knowledge: Knowledge) -> int | None:
    for start in range(len(words)):
        phrase = " ".join(words[start:])
        if knowledge.find(phrase) is None and knowledge.room(phrase) is None:
            continue
        if start + 1 < len(words) and _is_made_of(phrase, words[start], knowledge):
            continue
        lone = start == len(words) - 1 and len(words) > 1
        if lone and words[start] in _POSTPOSED and knowledge.find(words[start - 1]) is not None:
            continue  # "a chair wood" is a chair.
        return start
    return None


def _is_made_of(phrase: str, first: str, knowledge: Knowledge) -> bool:
    """Tell whether a name of the table only says what another is made of: "plastic cup"."""
    if listed_kind(first) not in ("material", "shape") or first == "folding":
        return False
    entry, plain = knowledge.find(phrase), knowledge.find(phrase.partition(" ")[2])
    if entry is None or plain is None:
        return False
    return entry.label != entry.thing.name and entry.thing.name == plain.thing.name


def _unknown_start(words: list[str]) -> int:
    start = 0
    while start < len(words) - 1 and (
        listed_kind(words[start]) is not None
        or words[start] in STOREYS
        or is_intensity(words[start])
        or words[start] in UNITS
        or words[start][0].isdigit()
    ):
        start += 1
    return start


@lru_cache(maxsize=1024)
def _respelt_phrase(phrase: str) -> str:
    found = resolve_object(phrase, ())
    return found.suggestion or "" if found.known and found.suggestion else ""


def _respelt(words: list[str]) -> tuple[int | None, str]:
    """Return where a misspelt head begins, and what was meant."""
    if words[-1] in ENGLISH:
        return None, ""
    for start in range(max(0, len(words) - 3), len(words)):
        meant = _respelt_phrase(" ".join(words[start:]))
        if meant and len(meant.split()) == len(words) - start:
            return start, meant
    meant = _respelt_phrase(words[-1])
    return (len(words) - 1, meant) if meant else (None, "")


def _respelt_compound(nouns: list[str], head: str, knowledge: Knowledge) -> tuple[str, bool]:
    """Return a compound, and whether its spelling was corrected: "coffe mug"."""
    whole = " ".join([*nouns, head])
    singles = " ".join([*(noun.removesuffix("s") for noun in nouns), head])
    if knowledge.find(whole) is None and knowledge.find(singles) is not None:
        return singles, False  # "The cats bed".
    misspelt = [noun for noun in nouns if len(noun) > 4 and knowledge.find(noun) is None]
    if not misspelt or knowledge.find(whole) is not None:
        return whole, False
    near = [
        name for name in knowledge.phrases
        if name.endswith(f" {head}") and name[0] == whole[0] and OSA.distance(name, whole) == 1
    ]  # fmt: skip
    return (near[0], True) if near else (whole, False)


def _single(words: Sequence[str], count: int | str | None, knowledge: Knowledge) -> str:
    """Return a name in the singular, as the table has it where it has it."""
    phrase = " ".join(words)
    head, _, last = phrase.rpartition(" ")
    singles = [f"{head} {word}".strip() for word in singular_candidates(last)]
    known = [single for single in singles if single in knowledge.phrases]
    several = count not in (None, 1)
    if phrase in knowledge.phrases and not (several and known):
        return phrase
    if known and several:
        # "Four glasses" are none to wear.
        own = knowledge.phrases.get(phrase)
        return next(
            (one for one in known if own and knowledge.phrases[one].thing != own.thing), known[0]
        )
    if known:
        return known[0]
    # The exact singular of an unknown word takes seconds to look up the first time.
    regular = singles[0] if singles and not last.endswith(("us", "is", "as")) else phrase
    return regular if singular_candidates(last) else phrase


def _describe(words: list[str]) -> tuple[list[Attribute], list[str]]:
    """Split what stands before a head into attributes and the nouns that belong to the head."""
    nouns: list[str] = []
    words = list(words)
    while words and _is_noun(words):
        nouns.insert(0, words.pop())
    attributes: list[Attribute] = []
    index = 0
    while index < len(words):
        value, kind, index = _next_attribute(words, index)
        if value:
            attributes.append(Attribute(kind=kind, value=value))
    return attributes, nouns


def _is_noun(words: list[str]) -> bool:
    word = words[-1]
    measure = word in UNITS and len(words) > 1
    measure = measure and (_is_number(words[-2]) or words[-2] in ("half", "quarter"))
    sized = len(words) > 1 and words[-2] == "size"
    paper = word in _SIZES or CODE.match(word) is not None
    if measure or sized or paper or word == "dot" or _adjective(word) is not None:
        return False
    return not is_intensity(word) and not _is_number(word)


def _is_number(word: str) -> bool:
    return word[0].isdigit() or word in NUMBERS


def _adjective(word: str) -> str | None:
    """Return an adjective, its spelling corrected; None for other words."""
    if listed_kind(word) is not None:
        return word
    respelt = None if "-" in word else _respelt_adjective(word)
    return respelt or (word if attribute_kind(word) is not None else None)


@lru_cache(maxsize=1024)
def _respelt_adjective(word: str) -> str | None:
    if len(word) < 4 or word in ENGLISH or load_knowledge().find(word) is not None:
        return None
    return next(
        (
            colour
            for colour in ("green", "black", "white", "yellow", "blue", "brown", "orange", "purple",
                           "small", "little", "large", "wooden", "striped")
            if word[0] == colour[0] and OSA.distance(word, colour) == 1
        ),
        None,
    )  # fmt: skip


def _next_attribute(words: list[str], index: int) -> tuple[str, AttributeKind, int]:
    word, following = words[index], words[index + 1] if index + 1 < len(words) else ""
    if word in _SIZES or CODE.match(word):
        return word, "size" if word in _SIZES else "which", index + 1
    if (_is_number(word) or word in ("half", "quarter")) and following in UNITS:
        return f"{word} {following}", "size", index + 2
    if word == "size" and following:
        return f"size {following}", "size", index + 2
    if word == "polka":
        return "polka dot", "pattern", index + 2
    kind = attribute_kind(following) if following else None
    if is_shade(word) and kind == "colour":
        return f"{word} {following}", "colour", index + 2
    if word in ("half", "almost", "nearly", "brand") and kind is not None:
        return f"{word} {following}", kind, index + 2
    if is_intensity(word) and (kind is not None or is_intensity(following)):
        return "", "other", index + 1
    adjective = _adjective(word) or word
    return adjective, attribute_kind(adjective) or "other", index + 1

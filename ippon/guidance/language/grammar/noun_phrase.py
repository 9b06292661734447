"""One noun phrase: how many, whose, which, and what."""

import re
from dataclasses import dataclass, replace
from typing import Final, Literal

from ippon.guidance.knowledge import load_knowledge
from ippon.guidance.language.goals.goal import Attribute, AttributeKind, Reference
from ippon.guidance.language.grammar.attributes import listed_kind
from ippon.guidance.language.grammar.determiners import (
    MEASURES,
    NO_OWNERS,
    Determiners,
    read_determiners,
)
from ippon.guidance.language.grammar.heads import NamedHead, name_head
from ippon.guidance.language.grammar.name_rows import stands_beside, unclear_pair
from ippon.guidance.language.grammar.noun_ends import end_of_nouns, hyphened_words
from ippon.guidance.language.grammar.phrases import PRONOUNS, STOP
from ippon.guidance.language.grammar.utterance import Utterance, read_once
from ippon.guidance.language.words import singular_candidates

_THING: Final = (["thing"], ["object"], ["item"], ["things"])
_TIMES: Final = re.compile(r"x([1-9]\d?)$")
_POSSESSIVES: Final = {"mine": "", "yours": "", "ours": "", "hers": "her", "theirs": "their"}


@dataclass(frozen=True, slots=True, kw_only=True)
class NounPhrase:
    """A noun phrase of a sentence."""

    head: str
    """In the singular; empty for "the blue one"."""
    display: str
    attributes: tuple[Attribute, ...]
    count: int | Literal["all"] | None
    """None where none was said."""
    determined: bool
    """An article, a number or an owner stands before it."""
    reference: Reference
    shared: bool
    """No determiner of its own: "phone and keys"."""
    known: bool
    """The knowledge table has the head."""
    corrected: bool
    """The spelling of the head was corrected."""
    crowded: str
    """Names beside each other that may be one object or several."""
    end: int
    """Index after its last word."""


@read_once
def read_noun_phrase(said: Utterance, start: int, *, of: bool = True) -> NounPhrase | None:
    """Read the noun phrase that begins at a word; None where there is none.

    Args:
        said: The sentence.
        start: Index of the first word.
        of: Read what "of" adds to it, too: "cup of coffee".
    """
    knowledge = load_knowledge()
    if said.word(start) in ("after", "before", "during", "until", "while"):
        return None
    if (owned := _read_possessive(said, start)) is not None:
        return owned
    begun = read_determiners(said, start)
    index = begun.index
    end = end_of_nouns(said, index, knowledge)
    words = _words_of(said, index, end, stands_alone=bool(begun.reference))
    if said.word(index) in PRONOUNS or not words:
        return None
    words, times = _take_times(words, begun)
    spoken = said.words(index, end - times) or words
    named = _named(spoken, words, begun.count, said.word(index - 1) in ("a", "an"))
    if said.word(start) == "both" and not singular_candidates(said.word(end - 1)):
        begun.count = None  # "Both my mug and yours".
    attributes = [*(begun.owners or []), *named.attributes]
    display = said.said(index, end - times)
    described, _, measure = named.head.rpartition(" ")
    follows = of and said.word(end) == "of"
    if measure in MEASURES and follows:
        nouns = [Attribute(kind="other", value=described)] if described else []
        attributes, named = [*attributes, *nouns], replace(named, head="")  # "A decent pair of".
    chosen = (not named.head and named.attributes) or measure in MEASURES
    several = read_noun_phrase(said, end + 1) if chosen and follows else None
    if several is not None and several.head:
        # "The smaller of the two boxes", "an unopened pack of syringes".
        named = replace(named, head=several.head, known=several.known, corrected=several.corrected)
        attributes += several.attributes
        display = " ".join([*(one.value for one in attributes), named.head])
        end = several.end
    row = stands_beside(said, index, end)
    if named.corrected:
        display = " ".join([*(one.value for one in named.attributes), named.head])
    if said.word(end) == "more" and begun.count is not None and not said.breaks(end):
        begun.reference, end = "other", end + 1
    if of and said.word(end) == "of" and not said.breaks(end):
        more, display, end = _read_of(said, end, display)
        attributes += more
    return NounPhrase(
        head=named.head,
        display=display,
        attributes=tuple(attributes),
        count=begun.count,
        determined=begun.determined or begun.count is not None,
        reference=begun.reference,
        shared=not begun.determined and begun.count is None and not begun.owners,
        known=named.known,
        corrected=named.corrected,
        crowded=row or (display if named.crowded or unclear_pair(said, index, end) else ""),
        end=end,
    )


def _named(spoken: list[str], words: list[str], count: int | str | None, one: bool) -> NamedHead:
    """Return the head of the nouns; for `one` of a material alone, "a rubber", the material."""
    named = name_head(spoken, words, count, load_knowledge())
    if not one or listed_kind(" ".join(words)) != "material":
        return named
    return replace(named, head=named.head or words[0], attributes=[])


def _take_times(words: list[str], begun: Determiners) -> tuple[list[str], int]:
    """Take a count behind the nouns, "hat x2"; return the nouns, and the number of words taken."""
    times = _TIMES.match(words[-1]) if len(words) > 1 and begun.count is None else None
    if times is None:
        return words, 0
    begun.count = int(times[1])
    return words[:-1], 1


def _words_of(said: Utterance, index: int, end: int, *, stands_alone: bool) -> list[str]:
    """Return the words of the nouns; "one" for those that a reference leaves out."""
    words = [word for word in hyphened_words(said, index, end) if word not in ("and", "or")]
    left_out = not words and (said.breaks(index) or said.word(index) in STOP)
    if stands_alone and (left_out or words in _THING):
        return ["one"]  # "Another", "two more", "the same thing".
    return words


def _read_possessive(said: Utterance, start: int) -> NounPhrase | None:
    """Read "mine" and "my wife's" without a noun behind it; None where there is one."""
    if said.word(start) in _POSSESSIVES:
        return _possessive(_POSSESSIVES[said.word(start)], start + 1)
    owner = start + (said.word(start) in ("my", "our", "his", "her", "their", "the"))
    whose = said.word(owner).endswith("'s") and said.word(owner) not in NO_OWNERS
    if not whose or not said.breaks(owner + 1):
        return None
    said_of = owner if said.word(start) == "the" else start
    return _possessive(said.said(said_of, owner + 1)[:-2], owner + 1)


def _possessive(owner: str, end: int) -> NounPhrase:
    """Return "mine" and "hers" as one more of what was named before."""
    return NounPhrase(
        head="",
        display="",
        attributes=(Attribute(kind="owner", value=owner),) if owner else (),
        count=None,
        determined=True,
        reference="",
        shared=False,
        known=True,
        corrected=False,
        crowded="",
        end=end,
    )


def _read_of(said: Utterance, index: int, display: str) -> tuple[list[Attribute], str, int]:
    """Read "of my brother" (whose) and "of coffee" (with what in it) after a head."""
    following = said.word(index + 1)
    if following in ("me", "mine", "ours", "yours", "us"):
        return [], display, index + 2
    inner = read_noun_phrase(said, index + 1, of=False)
    if inner is None:
        return [], display, index
    owns = following in ("my", "our", "his", "her", "their")
    name = said.said(index + 1, index + 2)
    owner = not inner.known and (owns or following == "the" or name[:1].isupper())
    kind: AttributeKind = "owner" if owner else "content"
    value = f"{following} {inner.display}" if owns else inner.display
    return [Attribute(kind=kind, value=value)], f"{display} of {inner.display}", inner.end

"""One noun phrase: how many, whose, which, and what."""

import re
from dataclasses import dataclass, replace
from typing import Final, Literal

from ippon.guidance.knowledge import Knowledge, load_knowledge
from ippon.guidance.language.context_words import NEGATIONS
from ippon.guidance.language.goals.goal import Attribute, AttributeKind, Reference
from ippon.guidance.language.grammar.attributes import UNITS, listed_kind
from ippon.guidance.language.grammar.determiners import (
    MEASURES,
    NO_OWNERS,
    NUMBERS,
    is_person_at,
    may_be_noun,
    read_determiners,
)
from ippon.guidance.language.grammar.heads import name_head
from ippon.guidance.language.grammar.phrases import PREPOSITIONS, PRONOUNS, STOP
from ippon.guidance.language.grammar.utterance import Utterance
from ippon.guidance.language.words import singular_candidates, word_set

MAX_WORDS: Final = 9
_POSSESSIVES: Final = {"mine": "", "yours": "", "ours": "", "hers": "her", "theirs": "their"}
_PLACED = word_set("inside outside nearest opposite near far")
_BEFORE_PLACED = word_set("the my a his her your our their other for with")
STANDS = word_set(
    "hangs hung lies lay sits sat stands stood lives lived stays stayed sleeps slept came comes "
    "went goes ran runs flew slid slipped fallen rolls crawled climbed jumped landed ended blew "
    "stuck hides walked broke burst spilled flown blown flew climbs jumps always"
)
"""Verbs and adverbs that stand between a thing and its place."""
_PARTICIPLES = word_set("left hidden fallen forgotten hanging standing")
"""They end a noun phrase but where they begin it: "the hidden egg"."""
_NEAR: Final = 4
"""So many words stand between a preposition and the last noun of a compound place."""
_TIMES: Final = re.compile(r"x([1-9]\d?)$")
_STAY = word_set("live lives belong belongs")
_AWAY = word_set("away off down up out back")
_PARTICLES = word_set(
    "down aside up off out over back missing lost gone checked stacked piled parked hung"
)
"""They belong to the verb: "I put my pipe down"."""
CONTAINERS = word_set("bottle cup glass bowl jar can carton mug jug tin pot bag plate")
"""In these is what "of" says: a glass of water is a glass."""


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
    crowded: bool
    """Several things stand beside each other like one name."""
    end: int
    """Index after its last word."""


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
    owned = _read_possessive(said, start)
    if owned is not None:
        return owned
    begun = read_determiners(said, start)
    index = begun.index
    end = _end_of_nouns(said, index, knowledge)
    words = [word for word in _hyphened_words(said, index, end) if word not in ("and", "or")]
    if not words and begun.reference and (said.breaks(index) or said.word(index) in STOP):
        words = ["one"]  # "Another", "two more", "the same".
    if said.word(index) in PRONOUNS or not words:
        return None
    if begun.reference and words in (["thing"], ["object"], ["item"], ["things"]):
        words = ["one"]  # "The same thing".
    times = _TIMES.match(words[-1]) if len(words) > 1 and begun.count is None else None
    if times is not None:
        begun.count, words = int(times[1]), words[:-1]  # "Hat x2".
    spoken = said.words(index, end - (times is not None)) or words
    named = name_head(spoken, words, begun.count, knowledge)
    if said.word(start) == "both" and not singular_candidates(said.word(end - 1)):
        begun.count = None  # "Both my mug and yours".
    attributes = [*(begun.owners or []), *named.attributes]
    display = said.said(index, end - (times is not None))
    several = read_noun_phrase(said, end + 1) if of and said.word(end) == "of" else None
    chosen = (not named.head and named.attributes) or named.head in MEASURES
    if chosen and several is not None and several.head:
        # "The smaller of the two boxes", "an unopened pack of syringes".
        named = replace(named, head=several.head, known=several.known, corrected=several.corrected)
        attributes += several.attributes
        display = " ".join([*(one.value for one in attributes), named.head])
        end = several.end
    if said.word(end) == "more" and begun.count is not None and not said.breaks(end):
        begun.reference, end = "other", end + 1
    if named.corrected:
        display = " ".join([*(one.value for one in named.attributes), named.head])
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
        crowded=named.crowded,
        end=end,
    )


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
        crowded=False,
        end=end,
    )


def _hyphened_words(said: Utterance, start: int, end: int) -> list[str]:
    """Return the words of a range; particles and numbers with a hyphen in one: "walk-in"."""
    knowledge = load_knowledge()
    small = PREPOSITIONS.keys() | NUMBERS | _PARTICLES
    words: list[str] = []
    for index in range(start, end):
        whole = said.hyphened(index) and index > start
        particle = bool(small & {said.word(index - 1), said.word(index)})
        if whole and particle and _known_length(said, index - 1, knowledge) < 2:
            words[-1] += f"-{said.word(index)}"
        else:
            words.append(said.word(index))
    return words


def _end_of_nouns(said: Utterance, start: int, knowledge: Knowledge) -> int:
    index = start
    while index < len(said) and index - start < MAX_WORDS:
        word = said.word(index)
        if index > start and said.breaks(index) and not _comma_of_adjectives(said, index):
            break
        length = _known_length(said, index, knowledge)
        if length > 1 or (index > start and said.hyphened(index)) or said.hyphened(index + 1):
            index += max(length, 1)
            continue
        if word in PRONOUNS or (index > start and _names_room_of(said, index, knowledge)):
            break
        measured = said.word(index)[:1].isdigit() and said.word(index + 1) in UNITS
        if index > start and measured and not may_be_noun(said, index + 2):
            break  # "Ruler 50 cm".
        if index > start and (said.word(index + 1) == "than" or stands_somewhere(said, index)):
            break
        if index > start and (word == "another" or (word in _STAY and said.breaks(index + 1))):
            break  # "Where does the dog food live?"
        adverb = word.endswith("ly") and listed_kind(word) is None and knowledge.find(word) is None
        if index > start and adverb and said.breaks(index + 1):
            break  # "Find my glasses quietly".
        if word == "more" and index > start and not may_be_noun(said, index + 1):
            break  # "One towel more".
        if word in _PARTICLES and index > start and not may_be_noun(said, index + 1):
            break
        over = said.breaks(index + 1) or said.word(index + 1) in ("and", "then")
        if word in ("first", "next", "last") and index > start and over:
            break
        if index > start and is_person_at(said, index):
            break
        if word == "end" and index > start and said.word(index + 1) == "up":
            break
        if word in ("and", "or"):
            if not _joins_adjectives(said, index):
                break
        elif (
            (
                (word in _PARTICIPLES or word.endswith("ed"))
                and index == start
                and _determined(said, index)
                and may_be_noun(said, index + 1)
            )
            or (
                word == "can"
                and (
                    listed_kind(said.word(index - 1)) or said.word(index - 1) in ("a", "the", "my")
                )
                and (said.breaks(index + 1) or said.word(index + 1) not in PRONOUNS)
            )
            or (
                word == "left"
                and (said.word(index - 1) == "far" or listed_kind(said.word(index - 1)) == "which")
                and may_be_noun(said, index + 1)
            )
        ):
            pass
        elif word in _PLACED and index == start and _determined(said, index):
            pass  # "The inside pocket".
        elif word in ("really", "rather") and index == start and listed_kind(said.word(index + 1)):
            pass  # "A really big box".
        elif (word in STOP or _is_preposition(said, index) or word in NEGATIONS) and not (
            word in ("over", "off") and index == start and said.word(index + 1) == "white"
        ):
            break
        index += 1
    return index


def stands_somewhere(said: Utterance, index: int) -> bool:
    """Tell whether a verb says how a thing stands before its place: "drying on", "plugged in"."""
    word, knowledge = said.word(index), load_knowledge()
    if said.breaks(index) or said.breaks(index + 1):
        return False
    if word == "always" and said.word(index + 1) in STANDS:
        return True
    away = said.word(index + 1) in _AWAY and not said.breaks(index + 2)
    if not (_is_preposition(said, index + 1) or (away and _is_preposition(said, index + 2))):
        return False
    if word in STANDS:
        return True
    moving = word.endswith(("ing", "ed")) and len(word) > 5
    return moving and listed_kind(word) is None and knowledge.find(word) is None


def _names_room_of(said: Utterance, index: int, knowledge: Knowledge) -> bool:
    """Tell whether a room is named right after a thing: "green bag hallway"."""
    word, before = said.word(index), said.word(index - 1)
    if {"the", "my", "our"} & set(said.words(max(0, index - _NEAR), index)):
        return False  # "The roof terrace".
    begin = index - 1
    while begin > 0 and said.word(begin) not in PREPOSITIONS and not said.breaks(begin):
        begin -= 1
    if said.word(begin) in PREPOSITIONS and index - begin <= _NEAR:
        return False  # "In the lift lobby".
    room = knowledge.room(word) is not None and knowledge.find(word) is None
    return room and knowledge.find(before) is not None and knowledge.room(before) is None


def _determined(said: Utterance, index: int) -> bool:
    return said.word(index - 1) in _BEFORE_PLACED


def _is_preposition(said: Utterance, index: int) -> bool:
    return any(" ".join(said.words(index, index + length)) in PREPOSITIONS for length in (1, 2, 3))


def _known_length(said: Utterance, index: int, knowledge: Knowledge) -> int:
    """Return the number of words of the longest name of the table at an index."""
    if said.word(index) in STOP:
        return 0
    for length in range(5, 1, -1):
        words = said.words(index, index + length)
        if len(words) < length or any(said.breaks(index + n) for n in range(1, length)):
            continue
        name = " ".join(words)
        if words[0] in CONTAINERS and words[1] == "of":
            continue  # "Glass of water" is a glass.
        if knowledge.find(name) is not None or knowledge.room(name) is not None:
            return length
    return 0


def _comma_of_adjectives(said: Utterance, index: int) -> bool:
    """Tell whether a comma stands between adjectives: "a big, red mug"."""
    before, word, after = said.word(index - 1), said.word(index), said.word(index + 1)
    if said.gap(index).strip() != "," or listed_kind(before) is None:
        return False
    if load_knowledge().find(before) is not None:
        return False
    if listed_kind(word) is not None and said.breaks(index + 1):
        return _comma_of_adjectives(said, index + 1)
    return (
        listed_kind(word) is not None
        and may_be_noun(said, index + 1)
        and after
        not in (
            "and",
            "or",
        )
    )


def _joins_adjectives(said: Utterance, index: int) -> bool:
    """Tell whether "and" stands between adjectives of one noun: "black and white cat"."""
    before, word = said.word(index - 1), said.word(index + 1)
    if listed_kind(before) is None or listed_kind(word) is None or said.breaks(index + 1):
        return False
    return may_be_noun(said, index + 2) and said.word(index + 2) not in ("one", "ones")


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

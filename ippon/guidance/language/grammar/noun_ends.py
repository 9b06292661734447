"""Where a noun phrase ends, and which of its words belong together."""

from functools import cache
from typing import Final

from ippon.guidance.knowledge import Knowledge, load_knowledge
from ippon.guidance.language.context_words import NEGATIONS, STOREYS
from ippon.guidance.language.grammar.attributes import UNITS, listed_kind
from ippon.guidance.language.grammar.determiners import (
    NO_OWNERS,
    NUMBERS,
    is_person_at,
    may_be_noun,
)
from ippon.guidance.language.grammar.name_rows import begins_name
from ippon.guidance.language.grammar.phrases import PREPOSITIONS, PRONOUNS, STOP, TIME
from ippon.guidance.language.grammar.utterance import Utterance
from ippon.guidance.language.words import word_set

MAX_WORDS: Final = 9
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
_STAY = word_set("live lives belong belongs")
_AWAY = word_set("away off down up out back")
_PARTICLES = word_set(
    "down aside up off out over back home missing lost gone checked stacked piled parked hung"
)
"""They belong to the verb: "I put my pipe down"."""
_LACKING = word_set("free less")
"""Behind a hyphen they belong to the word before: "sugar-free"."""
CONTAINERS = word_set("bottle cup glass bowl jar can carton mug jug tin pot bag plate")
"""In these is what "of" says: a glass of water is a glass."""


def hyphened_words(said: Utterance, start: int, end: int) -> list[str]:
    """Return the words of a range, some with a hyphen as one: "walk-in", "left-handed"."""
    knowledge = load_knowledge()
    small = PREPOSITIONS.keys() | NUMBERS | _PARTICLES | _LACKING
    words: list[str] = []
    for index in range(start, end):
        whole = said.hyphened(index) and index > start
        before, word = said.word(index - 1), said.word(index)
        adjective = listed_kind(before) is not None and listed_kind(word) is None
        joined = bool(small & {before, word}) or (adjective and word != "and")
        if whole and joined and _known_length(said, index - 1, knowledge) < 2:
            words[-1] += f"-{word}"
        else:
            words.append(word)
    return words


def end_of_nouns(said: Utterance, start: int, knowledge: Knowledge) -> int:
    """Return the index after the adjectives and nouns that begin at a word."""
    index = start
    while index < len(said) and index - start < MAX_WORDS:
        word = said.word(index)
        if index > start and said.breaks(index) and not _comma_of_adjectives(said, index):
            break
        length = _known_length(said, index, knowledge)
        if length > 1 or (index > start and said.hyphened(index)) or said.hyphened(index + 1):
            index += max(length, 1)
            continue
        if word in PRONOUNS or (index > start and _ends_before(said, index, knowledge)):
            break
        if word in ("and", "or"):
            if not _joins_adjectives(said, index):
                break
        elif _belongs(said, index, first=index == start):
            pass
        elif (word in STOP or _is_preposition(said, index) or word in NEGATIONS) and not (
            word in ("over", "off") and index == start and said.word(index + 1) == "white"
        ):
            break
        index += 1
    return index


def _ends_before(said: Utterance, index: int, knowledge: Knowledge) -> bool:
    """Tell whether a word after the first of a noun phrase is no part of it."""
    word, following = said.word(index), said.word(index + 1)
    if _names_room_of(said, index, knowledge) or is_person_at(said, index):
        return True
    if begins_name(said, index):
        return True
    if following == "than" or word == "another" or stands_somewhere(said, index):
        return True
    if TIME.match(said.text, said.tokens[index].start):
        return True  # "My tablet last night".
    if word[:1].isdigit() and following in UNITS and not may_be_noun(said, index + 2):
        return True  # "Ruler 50 cm".
    adverb = word.endswith("ly") and listed_kind(word) is None and knowledge.find(word) is None
    if (word in _STAY or adverb) and said.breaks(index + 1):
        return True  # "Where does the dog food live?", "find my glasses quietly".
    noun = word == "back" and said.word(index - 2) in ("a", "the")  # "A high back".
    noun = noun and knowledge.find(said.word(index - 1)) is None
    if (word == "more" or word in _PARTICLES) and not (noun or may_be_noun(said, index + 1)):
        return True  # "One towel more".
    over = said.breaks(index + 1) or following in ("and", "then")
    if (word, following) in (("end", "up"), ("free", "of"), ("free", "from"), ("used", "to")):
        return True  # "Cookies free of nuts".
    return word in ("first", "next", "last") and over


def _belongs(said: Utterance, index: int, *, first: bool) -> bool:
    """Tell whether a word that often ends a noun phrase belongs to it: "the hidden egg"."""
    word, before, following = said.word(index), said.word(index - 1), said.word(index + 1)
    chosen = listed_kind(before) == "which"
    if word == "can":
        article = bool(listed_kind(before)) or before in ("a", "the", "my")
        return article and (said.breaks(index + 1) or following not in PRONOUNS)
    if word == "left" and (before == "far" or chosen) and may_be_noun(said, index + 1):
        return True
    if not first:
        return False
    if word in ("really", "rather"):
        return listed_kind(following) is not None  # "A really big box".
    participle = word in _PARTICIPLES or word.endswith("ed")
    described = participle or word in STOREYS  # "The upstairs bathroom".
    placed = word in _PLACED or (described and may_be_noun(said, index + 1))
    owned = before.endswith("'s") and before not in NO_OWNERS and following not in STOP
    return placed and (owned or before in _BEFORE_PLACED)  # "Mia's left shoe", "The inside pocket".


def stands_somewhere(said: Utterance, index: int) -> bool:
    """Tell whether a verb says how a thing stands before its place: "drying on", "plugged in"."""
    word, knowledge = said.word(index), load_knowledge()
    if said.breaks(index) or said.breaks(index + 1):
        return False
    if word == "always" and said.word(index + 1) in STANDS:
        return True
    away = said.word(index + 1) in _AWAY and not said.breaks(index + 2)
    away = away or (word in STANDS and _is_adverb(said, index + 1))
    if not (_is_preposition(said, index + 1) or (away and _is_preposition(said, index + 2))):
        return False
    if word in STANDS:
        return True
    moving = word.endswith(("ing", "ed")) and len(word) > 3
    return moving and listed_kind(word) is None and knowledge.find(word) is None


@cache
def _last_words() -> frozenset[str]:
    """Return the last words of all names of the table: "piano" of "upright piano"."""
    return frozenset(name.rpartition(" ")[2] for name in load_knowledge().phrases)


def _is_adverb(said: Utterance, index: int) -> bool:
    """Tell whether an unknown word stands between a verb and a place: "ran aground on"."""
    word = said.word(index)
    return not said.breaks(index + 1) and not (
        word in _last_words() or word in STOP or word in NUMBERS or word.endswith("'s")
    )


def _names_room_of(said: Utterance, index: int, knowledge: Knowledge) -> bool:
    """Tell whether a room is named right after a thing: "green bag hallway"."""
    word, before = said.word(index), said.word(index - 1)
    if {"the", "my", "our"} & set(said.words(max(0, index - _NEAR), index)):
        return False  # "The roof terrace".
    begin = index - 1
    while index - begin <= _NEAR and begin > 0 and not said.breaks(begin):
        if said.word(begin) in PREPOSITIONS:
            break
        begin -= 1
    if said.word(begin) in PREPOSITIONS and index - begin <= _NEAR:
        return False  # "In the lift lobby".
    room = knowledge.room(word) is not None and knowledge.find(word) is None
    return room and knowledge.find(before) is not None and knowledge.room(before) is None


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

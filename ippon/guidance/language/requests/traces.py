"""Words of a sentence that left no trace in what was read of it."""

from functools import cache
from typing import Final

from rapidfuzz.distance import OSA

from ippon.guidance.language.context_words import BELIEFS, DOUBTS, NEGATIONS, NEUTRAL
from ippon.guidance.language.goals.drafts import Reading
from ippon.guidance.language.goals.goal import ALL, Goal
from ippon.guidance.language.grammar import phrases
from ippon.guidance.language.grammar.attributes import listed_kind
from ippon.guidance.language.grammar.determiners import COUNTS, MEASURES, NUMBERS
from ippon.guidance.language.languages import ENGLISH
from ippon.guidance.language.words import singular_candidates, tokenize, word_set

_EMPTY: Final = (
    phrases.ASKED, phrases.PADDING, phrases.TAIL, phrases.GONE, phrases.TOLD, phrases.SAYS,
)  # fmt: skip
"""What asks, and what says nothing of an object."""
_DENYING: Final = (NEGATIONS | word_set("except unless")) - {"no", "cannot", "doubt", "nobody"}
_PLACING = word_set(
    "before under underneath behind inside outside above below between near beside upstairs "
    "downstairs"
)
_PLAIN = word_set(
    "avoid enter check need stay until ones belongs belong different preferably ideally bother"
)
_VISIBLE: Final = ("colour", "size", "material", "pattern", "shape")
_GUESSED: Final = BELIEFS | DOUBTS
_NEAR: Final = 8
"""So many words around a denial may tell what it denies."""
_TAKEN_BACK: Final = 4
"""So many words may stand between "not" and what takes the place of what is denied."""


def lost_words(reading: Reading) -> tuple[list[str], list[str]]:
    """Return the words without a trace: those that change what is meant, and names.

    The first are denials, alternatives, numbers and places: without them, another object or another
    place is searched for. Words that a correction takes back need no trace.
    """
    said = reading.said
    goals = [read.goal() for read in reading.drafts]
    told = " ".join([*map(_told, goals), *reading.unused, *reading.stray]).lower()
    kept = {token.word for token in tokenize(told)}
    kept |= {single for word in kept for single in singular_candidates(word)}
    values = _values(goals)
    start = max(_after_corrections(reading), reading.begin)
    changing = _odd_numbers(goals)
    names: list[str] = []
    for index in sorted(set(range(start, len(said))) - _covered(reading, start)):
        word = said.word(index)
        if word in kept:
            # The context holds it, but no attribute and no place does.
            if (
                word in _DENYING
                and word not in values.split()
                and not _denies(reading, index, goals)
            ):
                names.append(_rest_of_clause(reading, index))
            elif listed_kind(word) in _VISIBLE and word not in values:
                names.append(word)
            continue
        if listed_kind(word) in _VISIBLE:
            changing.append(word)
            continue
        if word in _DENYING:
            listed = word == "nor" and len(goals) > 1
            changing += [] if listed or _is_denied(goals) else [word]
        elif word in _PLACING:
            if any(
                place.relation == phrases.PREPOSITIONS.get(word)
                for goal in goals
                for place in goal.relations
            ):
                continue  # "Beside it" is told as "next to".
            ordered = word == "before" and any(goal.order == "then" for goal in goals)
            changing += [] if ordered or said.word(index - 1) == "as" else [word]  # "As before".
        elif word == "or":
            changing += [] if _is_offered(reading, index, goals) else [word]
        elif word in NUMBERS or word.isdecimal():
            changing += [] if _is_counted(reading, index, goals) else [word]
        elif len(word) > 2 and word not in _known_words() and not _is_near(word, kept, told):
            names.append(word)
    return changing, names


def _odd_numbers(goals: list[Goal]) -> list[str]:
    """Return the numbers before an object that neither count it nor measure it: "0", "1000"."""
    described = [one for goal in goals for one in goal.attributes if one.kind in ("other", "which")]
    return [one.value for one in described if one.value.replace(".", "").isdecimal()]


def _values(goals: list[Goal]) -> str:
    texts = [f"{goal.object} {goal.display}" for goal in goals]
    texts += [one.value for goal in goals for one in goal.attributes]
    texts += [one.text for goal in goals for one in goal.relations]
    return " ".join(texts).lower()


def _denies(reading: Reading, index: int, goals: list[Goal]) -> bool:
    """Tell whether a denied attribute or place stands near a denial, or it denies neither."""
    said = reading.said
    around = said.words(max(0, index - _NEAR), index + _NEAR)
    if any(phrase in " ".join(around) for phrase in NEUTRAL) or set(around) & _GUESSED:
        return True
    denied = [one.value for goal in goals for one in goal.attributes if one.negated]
    denied += [one.text for goal in goals for one in goal.relations if one.negated]
    words = {word for value in denied for word in value.lower().split()}
    return any(word in words or word.removesuffix("'s") in words for word in around)


def _rest_of_clause(reading: Reading, index: int) -> str:
    end = index + 1
    while end < len(reading.said) and not reading.said.breaks(end) and end - index < _NEAR:
        end += 1
    return reading.said.said(index, end)


def _told(goal: Goal) -> str:
    values = [one.value for one in goal.attributes] + [one.text for one in goal.relations]
    return " ".join([goal.object, goal.display, goal.context, *values])


def _after_corrections(reading: Reading) -> int:
    """Return the index after the last words that take back what stands before them."""
    said = reading.said
    start = 0
    for index in range(len(said)):
        if index == 0 and said.word(0) in ("not", "never"):
            start = next((n for n in range(1, len(said)) if said.breaks(n)), _TAKEN_BACK)
        word, length = said.word(index), said.starts(index, phrases.CORRECTIONS)
        named = said.word(index + length) in ("the", "my", "a", "an")
        if length and (length > 1 or named or said.breaks(index) or word not in ENGLISH):
            start = max(start, index + length)
    return start


def _covered(reading: Reading, start: int) -> set[int]:
    """Return the indices of the words of phrases that ask or say nothing of an object."""
    covered: set[int] = set()
    index = start
    while index < len(reading.said):
        end = max(reading.match(pattern, index) for pattern in _EMPTY)
        covered |= set(range(index, end))
        index = max(end, index + 1)
    return covered


def _is_denied(goals: list[Goal]) -> bool:
    return any(one.negated for goal in goals for one in (*goal.attributes, *goal.relations))


def _is_offered(reading: Reading, index: int, goals: list[Goal]) -> bool:
    around = (reading.said.word(index - 1), reading.said.word(index + 1))
    said_after = reading.said.word(index + 2) or around[1]
    named = all(word in NUMBERS or word.isdecimal() for word in around)
    adjectives = any(listed_kind(word) is not None for word in around)
    places = " ".join(one.place for goal in goals for one in goal.relations).split()
    placed = around[0] in places and said_after in places
    return named or adjectives or placed or any(goal.order == "or" for goal in goals)


def _is_counted(reading: Reading, index: int, goals: list[Goal]) -> bool:
    said = reading.said
    word = said.word(index)
    number = NUMBERS.get(word) or int(word)
    counts = [goal.count for goal in goals if isinstance(goal.count, int)]
    ranged = said.word(index + 1) in ("or", "to")
    chosen = said.word(index - 1) == "are" or said.word(index - 2) == "of"  # "Of the two".
    every = any(goal.count == ALL for goal in goals)  # "All thirty tablets".
    return ranged or chosen or every or number == 1 or number in counts or number == sum(counts)


@cache
def _known_words() -> frozenset[str]:
    """Words that build a sentence and name nothing."""
    fixed = " ".join([*phrases.FIXED, *COUNTS]).split()
    return ENGLISH | MEASURES | _PLAIN | frozenset(fixed)


def _is_near(word: str, kept: set[str], told: str) -> bool:
    """Tell whether a word is kept in the singular, in two words, or with its spelling corrected."""
    if kept & {word.removesuffix("'s"), *singular_candidates(word)}:
        return True
    edits = 1 if len(word) < 5 else 2
    return word.removesuffix("s") in told.replace(" ", "") or any(
        OSA.distance(word, other) <= edits for other in kept
    )

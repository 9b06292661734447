"""Whether a sentence says where a thing is, or guesses it: "I may have left it in the hall"."""

from itertools import pairwise

from ippon.guidance.language.context_words import BELIEFS, DOUBTS, HABITS, NEGATIONS
from ippon.guidance.language.grammar.phrases import TIME
from ippon.guidance.language.grammar.relation_phrase import (
    SOFT,
    RelationPhrase,
    prepositions_at,
    read_relation,
)
from ippon.guidance.language.grammar.utterance import Utterance
from ippon.guidance.language.words import DETERMINERS, word_set

_GUESSES = (
    HABITS
    | (BELIEFS - word_set("should must seem seems"))
    | word_set(
        "maybe perhaps possibly swear sworn mistaken memory remember thought believed reckoned "
        "rumour rumor"
    )
)
"""Of a sentence before the object: "could" and "might" ask there."""
_UNCERTAIN = (
    ("possible", "that"),
    ("be", "that"),
    ("chance", "that"),
    ("chances", "are"),
    ("a", "chance"),
)
_PERHAPS = word_set("could might may")


def is_guessed(said: Utterance, phrase: RelationPhrase, object_end: int) -> bool:
    """Tell whether the sentence around a relation of an object says that it is a guess or a habit.

    Args:
        said: The sentence.
        phrase: The relation.
        object_end: Index after the object.
    """
    last = phrase.end
    first = _sentence_start(said, phrase.begin)
    while not said.ends(last) and not (said.breaks(last) and said.word(last) in ("or", "and")):
        if said.word(last) in SOFT and read_relation(said, last) is not None:
            break  # "In my room, probably under the bed".
        last += 1
    after = min(max(first, object_end), phrase.begin)
    asked = said.word(first + 1) in DETERMINERS or said.word(first + 1) == "there"
    if said.word(first) in _PERHAPS and asked:
        return True  # "Could my wallet have fallen behind the sofa?"
    if not any(said.breaks(n) for n in range(object_end, phrase.begin + 1)) and any(
        be in ("was", "were") and doing.endswith("ing")
        for be, doing in pairwise(said.words(first, object_end))
    ):
        return True  # "I was reading the atlas in the den".
    if ("must", "have") in pairwise(said.words(first, after)):
        return True
    times = (TIME.match(said.text, said.tokens[n].start) for n in range(phrase.end, last))
    if said.word(first) != "i" and "had" in said.words(first, object_end) and any(times):
        return True  # "Tom had the drill in the garage yesterday".
    doubts = BELIEFS | DOUBTS | HABITS
    return bool(doubts & set(said.words(after, last))) or is_guessed_before(said, after)


def is_guessed_before(said: Utterance, index: int) -> bool:
    """Tell whether the sentence says up to a word that it is a guess: "I may have dropped"."""
    words = said.words(_sentence_start(said, index), index)
    supposed = any(
        (word in _PERHAPS and following == "have") or (word, following) in _UNCERTAIN
        for word, following in pairwise(words)
    )
    return supposed or bool(_GUESSES & set(words))


def as_guessed(said: Utterance, begin: int, end: int) -> str:
    """Return what was told of a place with the guess or the habit that stands apart from it.

    "Perhaps the keys are in my coat" tells "maybe in my coat".
    """
    last = end
    while not said.ends(last):
        last += 1
    words = set(said.words(_sentence_start(said, begin), last))
    if not NEGATIONS & set(said.words(begin, end)):
        begin = next((n for n in range(begin, end) if prepositions_at(said, n)[0]), begin)
    guess = "maybe"
    if not DOUBTS & words:
        guess = "probably" if BELIEFS & words else "usually" if HABITS & words else guess
    return f"{guess} {said.said(begin, end)}"


def _sentence_start(said: Utterance, index: int) -> int:
    while index > 0 and not said.ends(index):
        index -= 1
    return index

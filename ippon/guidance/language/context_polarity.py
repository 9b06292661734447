"""Whether a clause says that the object is at a place or is not, and how surely."""

import re
from collections.abc import Container
from typing import Literal

from ippon.guidance.language import context_words as lexicon
from ippon.guidance.language.words import ADJECTIVES, DETERMINERS, word_set

Strength = Literal["sure", "likely", "habit", "maybe"]

_DEGREES = re.compile(
    r"\b(not|don't|dont|can't|cannot|couldn't) (?:really|exactly|entirely|quite|completely|"
    r"absolutely|totally|so|too|that|all that|very|even|be) (?=(?:sure|certain|know|say|"
    r"remember|recall)\b)"
)
"""Between a negation and knowledge: "not really sure"."""
_FORBIDDEN = re.compile(
    r"\b(?:(?:need|must|should|would)(?:n't| not)|(?:don't|dont|do not) (?:need|have) to|"
    r"no need to|(?:no|any) (?:point|use|sense)(?: in)?|not worth)"
    r"(?: (?:even|really|bother|bothering|to))*"
    r" (?:look|search|check|go|try|bother|inspect|enter)(?:ing)?\b"
)
"""What says that a place need not be searched: "you don't need to look in the kitchen"."""

_GONE = re.compile(
    r"(?:\bwasn't|\b(?:it|they|that) weren't)$|"
    r"\b(?:it|they|that) (?:wasn't|weren't) (?:this|last|yesterday|today|tonight|when|any)\b"
)
"""What says that a thing was not where it was said to be."""
_GONE_NOW = re.compile(rf"\b{lexicon.GONE_SINCE}(?: (?:now|again|already))*$")
_PLACED = re.compile(
    r"\b(?:was|were|been|had|seen|placed|puts?|kept|keeps?(?! \w+ing)|leaves?|forgot|dropped|"
    r"stored|laid|lay|stood|sat|hung|(?:i|we|he|she|they|you|last) saw|"
    r"(?<!\bthe )(?<!\bmy )(?<!\bhis )(?<!\bher )left)\b"
)
"""What says that a thing was at a place; "the left shoe" does not."""

_USED = word_set(
    "hair beard face teeth email emails mail mails inbox message messages text texts phone watch "
    "time clock weather news recipe homework blood temperature ticket tickets"
)
"""What is checked, tried or combed where it is used: "I combed my hair in the bathroom"."""
_THINGS = word_set("it it's they they're")
_PLACING = word_set(
    "leave leaves left put puts keep keeps kept take takes store stores lay lie lies"
)


def polarity(
    words: list[str],
    first: int,
    begin: int,
    relation: str,
    *,
    places: Container[int],
    activity: bool,
) -> tuple[bool, Strength]:
    """Return whether a clause denies a place, and how sure it is.

    Args:
        words: All words of the clause.
        first: Index of the first word after what the speaker does not know.
        begin: Index of the first word of the place's phrase.
        relation: Preposition of the place.
        places: Indices of the words that name places.
        activity: Whether the place is where something is done: "while cooking".
    """
    before, whole = _text(words[first:begin]), _text(words)
    doubtful = any(f" {phrase} " in whole for phrase in lexicon.DOUBT_PHRASES)
    conditional = " if " in before and bool(lexicon.NEGATIONS & set(before.split()))
    # A denial reaches as far as the statement that it is in.
    stated = max(first, _statement_start(words, begin, places))
    scope = _without_neutral(_text(words[stated:begin]))
    rarely = _is_rarely(words, stated, begin)
    denied = (bool(lexicon.NEGATIONS & set(scope)) or rarely) and not conditional
    asked = " have you " in before or " did you " in before or " could you " in before
    aside = relation in lexicon.NEGATIVE_RELATIONS
    if relation == "from" and not (lexicon.MOVED | lexicon.MISSING) & set(words):
        aside = False  # "The bottle from the fridge" is in the fridge, unless it was moved.
    subject = words[stated + 1] if stated > first else ""
    anew = subject in _THINGS or (subject and lexicon.BELIEFS & set(scope))
    searched = _is_searched(scope if anew else _without_neutral(before)) and not asked
    if denied and not aside and _is_forbidden(scope):
        return True, "sure"
    if denied and not aside and lexicon.SEARCHES & set(scope) and not activity:
        return False, "maybe"  # "I haven't checked the bedroom yet."
    negated = not aside if searched else denied != aside
    if activity:
        return denied, "maybe"
    strength = _strength(whole, doubtful or conditional)
    return negated, "habit" if rarely and strength in ("sure", "likely") else strength


def strength_of(words: list[str]) -> Strength:
    """Return how sure a clause is of what it says."""
    whole = _text(words)
    return _strength(whole, any(f" {phrase} " in whole for phrase in lexicon.DOUBT_PHRASES))


def retracts(words: list[str]) -> bool:
    """Tell whether a clause without a place denies what was said before: "but it wasn't"."""
    said = f" {' '.join(words)} "
    absent = any(f" {phrase} " in said for phrase in lexicon.ABSENT_PHRASES)
    return absent or bool(_GONE.search(said.strip()))


def was_placed(words: list[str]) -> bool:
    """Tell whether a thing is said to have been at a place: "I left it on", not "check"."""
    guessed = (lexicon.BELIEFS | lexicon.DOUBTS) & set(words)
    return not guessed and bool(_PLACED.search(" ".join(words)))


def is_gone(words: list[str], *, placed: bool) -> bool:
    """Tell whether a clause ends in "it's gone" and takes back where a thing is.

    "Check the garage, it's missing" only says why.

    Args:
        words: All words of the clause.
        placed: Whether the thing is said to have been at the place.
    """
    gone = "if" not in words and bool(_GONE_NOW.search(" ".join(words)))
    return gone and (placed or "but" in words)


def _statement_start(words: list[str], begin: int, places: Container[int]) -> int:
    """Return the index of the joining word after which a place is stated anew, else 0.

    "It isn't on the sofa and I think it's on the bed"; not "I don't think Tom and I left it there".
    """
    for index in range(begin - 2, 0, -1):
        if words[index] not in ("and", "so", "since") or words[index + 1] not in lexicon.SUBJECTS:
            continue
        if words[index] == "since" or any(before in places for before in range(index)):
            return index
    return 0


def _text(words: list[str]) -> str:
    """Return words as a text with a space at both ends, without "really" in "not really sure"."""
    return _DEGREES.sub(r"\1 ", f" {' '.join(words)} ")


def _without_neutral(text: str) -> list[str]:
    for phrase in lexicon.NEUTRAL:
        text = text.replace(f" {phrase} ", " ")
    return text.split()


def _is_rarely(words: list[str], first: int, begin: int) -> bool:
    """Tell whether a thing is said to be seldom there: "I hardly ever leave it in"."""
    for index in range(first, begin):
        if words[index] in lexicon.RARELY:
            after = index + 1 + (words[index + 1 : index + 2] == ["ever"])
            if after >= begin or words[after] in _PLACING:
                return True
    return False


def _is_forbidden(scope: list[str]) -> bool:
    """Tell whether words before a place forbid to search it: "but don't look in the kitchen"."""
    words = [word for word in scope if word not in {"but", "and", "so", "please", "just"}]
    forbids = words[:1] in (["don't"], ["dont"], ["never"]) or words[:2] == ["do", "not"]
    if forbids and {"look", "search", "check", "go", "try", "bother"} & set(words):
        return True
    return _FORBIDDEN.search(" ".join(words)) is not None


def _is_searched(scope: list[str]) -> bool:
    """Tell whether the words before a place say that somebody looked there without success.

    "I tried it on in the bedroom" and "I checked my email in the kitchen" do not.
    """
    for index, verb in enumerate(scope):
        if verb not in lexicon.SEARCHED or (verb == "tried" and scope[-1] == "on"):
            continue
        after = (word for word in scope[index + 1 :] if word not in DETERMINERS | ADJECTIVES)
        if verb in ("looked", "searched") or next(after, "") not in _USED:
            return True
    return False


def _strength(whole: str, doubtful: bool) -> Strength:
    words = set(whole.split())
    if doubtful or lexicon.DOUBTS & words:
        return "maybe"
    if any(f" {phrase} " in whole for phrase in lexicon.STALE_PHRASES):
        return "maybe"
    if lexicon.HABITS & words or any(f" {text} " in whole for text in lexicon.HABIT_PHRASES):
        return "habit"
    return "likely" if lexicon.BELIEFS & words else "sure"

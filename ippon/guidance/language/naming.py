"""Resolution of an operator's text to an object: synonyms, plurals, misspellings, attributes."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache

from rapidfuzz import fuzz, process
from rapidfuzz.distance import OSA

from ippon.guidance.knowledge import Entry, Knowledge, load_knowledge
from ippon.guidance.language.words import (
    ADJECTIVES,
    DETERMINERS,
    plain,
    singular,
    tokenize,
    word_set,
)
from ippon.vocabulary import canonical_label, in_words

_CUT = word_set("of with without for in on at from that which who by near under next made")
"""Words that end the noun phrase: "cup of coffee" is a cup."""
TOYS = word_set("toy plush stuffed")
"""Words that make a toy of any noun."""
_MAX_WORDS = 12
_MAX_MISSPELT = 3
"""Longer unknown phrases are descriptions, not misspellings."""
_DOUBLED = re.compile(r"(.)\1")
_FOREIGN = re.compile(r"[^\W_]", re.UNICODE)


@dataclass(frozen=True, slots=True, kw_only=True)
class ResolvedObject:
    """Object that an operator's text stands for."""

    canonical: str
    """Label to search for: the vocabulary's label for the object ("couch" gives "sofa"), else the
    table's name, else the operator's words."""
    known: bool
    """Whether the knowledge table has it, or a wider thing."""
    category: str | None
    """Label of the vocabulary for the object, or for a wider thing."""
    display: str
    """The operator's words without articles and possessives, with attributes."""
    suggestion: str | None = None
    """A spelling that was assumed (`known`) or that may be meant (not `known`)."""
    concept: str | None = None
    """Entry of the knowledge table that is used for it."""


def resolve_object(text: str, vocabulary: Sequence[str]) -> ResolvedObject:
    """Return the object that a text names.

    Args:
        text: A noun phrase as a person types it: "my red hat", "the couches", "toy elephant".
        vocabulary: Labels of the common objects.

    Raises:
        ValueError: The text contains no word.
    """
    words = _noun_phrase(text)
    knowledge = load_knowledge()
    display = " ".join(words)
    core = list(words)
    while len(core) > 1 and core[0] in ADJECTIVES and knowledge.find(" ".join(core)) is None:
        core.pop(0)
    found = _look_up(core, knowledge)
    suggestion = None
    if found is None and len(core) <= _MAX_MISSPELT:
        found, suggestion = _spelling(core, knowledge)
    if found is None:
        return _unknown(core, display, vocabulary, suggestion)
    label, category = _fit(found, vocabulary)
    return ResolvedObject(
        canonical=label,
        known=True,
        category=category,
        display=display,
        suggestion=suggestion,
        concept=found.thing.name,
    )


def same_object(one: str, other: str) -> bool:
    """Tell whether two labels are names of the same thing: "couch" and "sofa"."""
    if canonical_label(one) == canonical_label(other):
        return True
    knowledge = load_knowledge()
    entries = [knowledge.find(in_words(canonical_label(text))) for text in (one, other)]
    first, second = entries
    return first is not None and second is not None and first.label == second.label


def is_instance_of(label: str, ooi: str) -> bool:
    """Tell whether a thing labelled `label` counts as an `ooi`.

    A baseball cap is a hat and a television is a tv; a hat need not be a baseball cap.
    """
    if same_object(label, ooi):
        return True
    knowledge = load_knowledge()
    entry = knowledge.find(in_words(canonical_label(label)))
    goal = knowledge.find(in_words(canonical_label(ooi)))
    return entry is not None and goal is not None and goal.label in wider(entry, knowledge)


@lru_cache(maxsize=64)
def vocabulary_labels(vocabulary: tuple[str, ...]) -> dict[str, str]:
    """Return the labels of a vocabulary by the canonical labels of the table."""
    knowledge = load_knowledge()
    labels: dict[str, str] = {}
    for label in vocabulary:
        entry = knowledge.find(in_words(canonical_label(label)))
        labels.setdefault(entry.label if entry else canonical_label(label), label)
    return labels


def category_of(entry: Entry, vocabulary: Sequence[str]) -> str | None:
    """Return the label of the vocabulary for the thing, or for its nearest wider thing."""
    labels = vocabulary_labels(tuple(vocabulary))
    knowledge = load_knowledge()
    for name in (entry.label, *wider(entry, knowledge)):
        if name in labels:
            thing = knowledge.thing(name)
            if name == entry.label or thing is None or thing.spread != "broad":
                return labels[name]
    return None


def wider(entry: Entry, knowledge: Knowledge) -> list[str]:
    """Return the labels of wider things of an entry, nearest first, without itself."""
    found = [entry.thing.name] if entry.label != entry.thing.name else []
    queue = list(entry.thing.parents)
    while queue:
        name = queue.pop(0)
        if name not in found:
            found.append(name)
            thing = knowledge.thing(name)
            queue += thing.parents if thing else ()
    return found


def _noun_phrase(text: str) -> list[str]:
    if not _FOREIGN.search(plain(text)):
        raise ValueError(f"no object in {text[:40]!r}: name what to look for, such as 'hat'")
    tokens = tokenize(plain(text).replace("_", " "))
    words = [token.word for token in tokens if token.word not in DETERMINERS]
    words = [word for word in words if not word.endswith("'s")] or words
    words = words or [token.word for token in tokens]
    knowledge = load_knowledge()
    for index, word in enumerate(words):
        if index and word in _CUT and knowledge.find(" ".join(words)) is None:
            words = words[:index]
            break
    return words[:_MAX_WORDS]


def _look_up(words: list[str], knowledge: Knowledge) -> Entry | None:
    """Return the longest end of a phrase that the table has; else the longest beginning.

    The head of an English noun phrase is last. The words before it make it a narrower thing if they
    are nouns of the table ("ski helmet"), and only describe it otherwise.
    """
    for start in range(len(words)):
        entry = knowledge.find(" ".join(words[start:]))
        if entry is None:
            continue
        before = words[:start]
        if TOYS & set(before):
            return Entry(label="_".join(words), thing=knowledge.things["toy"])
        nouns = [word for word in before if word not in ADJECTIVES and knowledge.find(word)]
        if not nouns:
            return entry
        return Entry(label="_".join([*nouns, entry.label]), thing=entry.thing)
    for end in range(len(words) - 1, 0, -1):
        entry = knowledge.find(" ".join(words[:end]))
        if entry is not None:
            return Entry(label="_".join([*words[:-1], singular(words[-1])]), thing=entry.thing)
    return None


def _spelling(words: list[str], knowledge: Knowledge) -> tuple[Entry | None, str | None]:
    """Correct clear misspellings; for possible ones, return a suggestion only."""
    suggestion: str | None = None
    for start in range(len(words)):
        phrase = " ".join(words[start:])
        if len(phrase) < 4:
            suggestion = suggestion or _swapped(phrase, knowledge)
            continue
        near = process.extract(phrase, knowledge.phrases.keys(), scorer=fuzz.ratio, limit=5)
        for candidate, _, _ in near:
            if _is_misspelling(phrase, candidate):
                return knowledge.phrases[candidate], candidate
        if near and near[0][1] >= 75.0 and suggestion is None:
            suggestion = near[0][0]
    return None, suggestion


def _swapped(phrase: str, knowledge: Knowledge) -> str | None:
    """Return a known word of three letters with two letters exchanged."""
    if len(phrase) != 3:
        return None
    swapped = (phrase[1] + phrase[0] + phrase[2], phrase[0] + phrase[2] + phrase[1])
    return next((word for word in swapped if word in knowledge.phrases), None)


def _is_misspelling(phrase: str, candidate: str) -> bool:
    """Tell whether an unknown phrase is almost certainly a misspelling of a candidate.

    Short words have many neighbours ("coach" and "couch" are both words), so they must keep their
    letters, doubled or exchanged at most; longer ones may lack or replace one, and from nine
    letters on two.
    """
    if phrase[0] != candidate[0]:
        return False
    edits = OSA.distance(phrase, candidate)
    if len(phrase) < 6:
        doubled = _DOUBLED.sub(r"\1", phrase) == _DOUBLED.sub(r"\1", candidate)
        exchanged = len(phrase) == len(candidate) and set(phrase) == set(candidate)
        return edits == 1 and (doubled or exchanged)
    return edits <= (1 if len(phrase) < 9 else 2)


def _fit(entry: Entry, vocabulary: Sequence[str]) -> tuple[str, str | None]:
    category = category_of(entry, vocabulary)
    own = vocabulary_labels(tuple(vocabulary)).get(entry.label)
    return (own or entry.label), category


def _unknown(
    words: Iterable[str], display: str, vocabulary: Sequence[str], suggestion: str | None
) -> ResolvedObject:
    *first, last = words
    label = "_".join([*first, singular(last)])
    own = vocabulary_labels(tuple(vocabulary)).get(label)
    return ResolvedObject(
        canonical=own or label,
        known=own is not None,
        category=own,
        display=display,
        suggestion=suggestion,
    )

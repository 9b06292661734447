"""The kinds of thing that a detector was trained on, and what it says of other labels."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final, Protocol, runtime_checkable

from rapidfuzz import fuzz

from ippon.segmentation.detectors.coco import NO_CLASS, answers_of
from ippon.vocabulary import canonical_label

_NEAR_RATIO: Final = 75.0
"""Share of equal letters, in percent, from which two labels may be one misspelt."""
_SHARED_WORD: Final = 0.5
"""Likeness of a label to a class with which it shares a word; a misspelling comes nearer."""
_MOST_NAMES: Final = 100
"""Names that a message lists; longer lists are cut."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Assignment:
    """Which of the labels that were asked for each class of a network stands for."""

    labels: tuple[str, ...]
    """Those that the network can tell, in the order asked."""
    ooi: str | None
    """Object of interest, None without one or where the network cannot tell it."""
    label_of_class: tuple[str | None, ...]
    """One a class of the network; None where nobody asked for it."""


@dataclass(frozen=True)
class ClosedVocabulary:
    """The classes of a detector in the order of its outputs, with the labels they answer to."""

    classes: tuple[str, ...]
    """Canonical; empty where an output belongs to no class."""
    answers: tuple[tuple[str, ...], ...]
    """The labels that each class answers to, best first."""

    @classmethod
    def of(cls, classes: Sequence[str]) -> "ClosedVocabulary":
        """Return the vocabulary of classes that answer to their names and common synonyms."""
        names = tuple(canonical_label(name) for name in classes)
        return cls(names, tuple(answers_of(name) if name else () for name in names))

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The kinds of thing, each once."""
        return tuple(dict.fromkeys(name for name in self.classes if name != NO_CLASS))

    def knows(self, label: str) -> bool:
        """Tell whether a class answers to a label."""
        wanted = canonical_label(label)
        return any(wanted in answers for answers in self.answers)

    def unseen(self, labels: Sequence[str]) -> tuple[str, ...]:
        """Return the labels that no class answers to, in their order."""
        return tuple(label for label in labels if not self.knows(label))

    def nearest(self, label: str, limit: int = 3) -> tuple[str, ...]:
        """Return the kinds of thing whose names come nearest to a label, best first.

        Names count that share a word with it, the last one most ("desk_chair" and "chair"), or that
        it may be a misspelling of. Meaning does not count: nothing comes near "hat".
        """
        wanted = canonical_label(label)
        rated: list[tuple[float, str]] = []
        for name, answers in zip(self.classes, self.answers, strict=True):
            rating = max((_likeness(wanted, answer) for answer in answers), default=0.0)
            if not rating and set(wanted.split("_")) & set(name.split("_")):
                rating = _SHARED_WORD
            if rating > 0.0:
                rated.append((-rating, name))
        return tuple(dict.fromkeys(name for _, name in sorted(rated)))[:limit]

    def refusal(self, label: str) -> str:
        """Return a sentence that says that a label is not known, and what would do."""
        near = self.nearest(label)
        nearest = f"; nearest to it: {', '.join(near)}" if near else ""
        more = len(self.names) - _MOST_NAMES
        rest = f" and {more} more" if more > 0 else ""
        return (
            f"this detector knows {len(self.names)} kinds of thing and {label!r} is none of "
            f"them{nearest}; it knows: {', '.join(self.names[:_MOST_NAMES])}{rest}; "
            "an open-vocabulary network (--segmentation.backend san or owlv2) takes any word"
        )

    def assign(self, labels: Sequence[str], ooi: str | None) -> Assignment:
        """Decide which label each class stands for.

        A class that answers to the object of interest stands for it: a detector that calls cups and
        mugs 'cup' shows cups to a search for a mug. Otherwise the best of its answers counts.

        Args:
            labels: Common labels, canonical and distinct.
            ooi: Object of interest, or None.
        """
        asked = tuple(labels) if ooi is None or ooi in labels else (*labels, ooi)
        wanted = set(asked)
        label_of_class = tuple(
            ooi if ooi in answers else next((one for one in answers if one in wanted), None)
            for answers in self.answers
        )
        told = {label for label in label_of_class if label is not None}
        return Assignment(
            labels=tuple(label for label in asked if label in told),
            ooi=ooi if ooi in told else None,
            label_of_class=label_of_class,
        )

    def label_for(self, label: str, labels: Sequence[str]) -> str | None:
        """Return which of some labels the instances of one of them carry; None where not known.

        Asked for cups and mugs, a detector that calls both 'cup' finds both as cups.

        Args:
            label: One of `labels`.
            labels: All that are asked for, canonical and distinct.
        """
        assigned = self.assign(labels, None)
        if label in assigned.labels:
            return label
        told = zip(self.answers, assigned.label_of_class, strict=True)
        return next((carried for answers, carried in told if label in answers), None)


@runtime_checkable
class KnowsItsVocabulary(Protocol):
    """A segmenter that recognises fixed kinds of thing only."""

    @property
    def vocabulary(self) -> ClosedVocabulary:
        """The kinds of thing."""
        ...


def closed_vocabulary(segmenter: object) -> ClosedVocabulary | None:
    """Return the kinds of thing that a segmenter is limited to; None where it takes any word."""
    return segmenter.vocabulary if isinstance(segmenter, KnowsItsVocabulary) else None


def refusal_of(segmenter: object, label: str) -> str | None:
    """Return why a segmenter cannot look for a label, and what would do; None where it can.

    Args:
        segmenter: A `Segmenter` of any kind.
        label: The object of interest as it would be asked for, canonical.
    """
    vocabulary = closed_vocabulary(segmenter)
    if vocabulary is None or vocabulary.knows(label):
        return None
    return vocabulary.refusal(label)


def _likeness(one: str, other: str) -> float:
    """Return how alike two labels look: 0 for not at all, up to 3."""
    first, second = one.split("_"), other.split("_")
    if first[-1] == second[-1]:
        return 2.0 + 1.0 / (len(first) + len(second))
    ratio = fuzz.ratio(one, other)
    return ratio / 100.0 if ratio >= _NEAR_RATIO else 0.0

"""The classes of a closed-vocabulary detector, and their matching to labels."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final, Protocol, runtime_checkable

from rapidfuzz import fuzz

from ippon.segmentation.detectors.coco import NO_CLASS, synonyms_of_class
from ippon.vocabulary import canonical_label

_NEAR_RATIO: Final = 75.0
"""Share of equal letters, in percent, from which one label may be a misspelling of another."""
_SHARED_WORD: Final = 0.5
"""Similarity of a label to a class with a common word; a misspelling scores higher."""
_MOST_NAMES: Final = 100
"""Most names in a message."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Assignment:
    """Label of each class of a network, for the requested labels."""

    labels: tuple[str, ...]
    """Requested labels that the network knows, in their order."""
    ooi: str | None
    """Object of interest; None without one, or if the network does not know it."""
    label_of_class: tuple[str | None, ...]
    """One per class; None if the class was not requested."""


@dataclass(frozen=True)
class ClosedVocabulary:
    """The classes of a detector in the order of its outputs, with their labels."""

    classes: tuple[str, ...]
    """Canonical; empty for an output without a class."""
    answers: tuple[tuple[str, ...], ...]
    """Labels of each class, best first."""

    @classmethod
    def of(cls, classes: Sequence[str]) -> "ClosedVocabulary":
        """Return the vocabulary of classes with their names and common synonyms as labels."""
        names = tuple(canonical_label(name) for name in classes)
        own = frozenset(names)
        return cls(names, tuple(synonyms_of_class(name, own) if name else () for name in names))

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The classes, each once."""
        return tuple(dict.fromkeys(name for name in self.classes if name != NO_CLASS))

    @cached_property
    def told_names(self) -> tuple[str, ...]:
        """Names that tell others what the classes answer to, each once.

        A class that a file of labels gives other labels is named by those, as in "mug/beaker",
        which `synonyms_of_class` reads.
        """
        told = (
            name
            if name in answers and set(answers) <= set(synonyms_of_class(name))
            else "/".join(answers)
            for name, answers in zip(self.classes, self.answers, strict=True)
        )
        return tuple(dict.fromkeys(name for name in told if name != NO_CLASS))

    def knows(self, label: str) -> bool:
        """Tell whether a class has a label."""
        wanted = canonical_label(label)
        return any(wanted in answers for answers in self.answers)

    def unseen(self, labels: Sequence[str]) -> tuple[str, ...]:
        """Return the labels that no class has, in their order."""
        return tuple(label for label in labels if not self.knows(label))

    def nearest(self, label: str, limit: int = 3) -> tuple[str, ...]:
        """Return the classes whose names are most similar to a label, best first.

        Names are similar that share a word, above all the last one ("desk_chair" and "chair"), or
        that may be misspellings. Meaning is not compared: nothing is similar to "hat".
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

    def unsupported_reason(self, label: str) -> str:
        """Return a message that a label is unknown, with alternatives."""
        near = self.nearest(label)
        nearest = f"; nearest to it: {', '.join(near)}" if near else ""
        more = len(self.names) - _MOST_NAMES
        rest = f" and {more} more" if more > 0 else ""
        return (
            f"this detector knows {len(self.names)} kinds of thing and {label!r} is none of "
            f"them{nearest}; it knows: {', '.join(self.names[:_MOST_NAMES])}{rest}; "
            "an open-vocabulary network (--segmentation.backend san or owlv2) takes any word"
        )

    def assign(
        self, labels: Sequence[str], ooi: str | None, also: Sequence[str] = ()
    ) -> Assignment:
        """Assign a label to each class.

        Objects of interest take precedence: a detector with one class for cups and mugs returns
        cups in a search for a mug. Otherwise the best requested label of a class counts.

        Args:
            labels: Common labels, canonical and distinct.
            ooi: Object of interest, or None.
            also: Further ones of a tour, which are among `labels`, most important first.
        """
        asked = tuple(labels) if ooi is None or ooi in labels else (*labels, ooi)
        wanted = set(asked)
        label_of_class = tuple(
            next((one for one in (ooi, *also, *answers) if one in wanted and one in answers), None)
            for answers in self.answers
        )
        told = {label for label in label_of_class if label is not None}
        return Assignment(
            labels=tuple(label for label in asked if label in told),
            ooi=ooi if ooi in told else None,
            label_of_class=label_of_class,
        )

    def label_for(self, label: str, labels: Sequence[str]) -> str | None:
        """Return which requested label the instances of a label get; None if it is unknown.

        With cups and mugs requested, a detector with one class for both returns both as cups.

        Args:
            label: One of `labels`.
            labels: All requested labels, canonical and distinct.
        """
        assigned = self.assign(labels, None)
        if label in assigned.labels:
            return label
        told = zip(self.answers, assigned.label_of_class, strict=True)
        return next((carried for answers, carried in told if label in answers), None)


@runtime_checkable
class HasClosedVocabulary(Protocol):
    """A segmenter with a fixed set of classes."""

    @property
    def vocabulary(self) -> ClosedVocabulary:
        """The classes."""
        ...


def closed_vocabulary(segmenter: object) -> ClosedVocabulary | None:
    """Return the vocabulary of a segmenter; None for an open vocabulary."""
    return segmenter.vocabulary if isinstance(segmenter, HasClosedVocabulary) else None


def unsupported_reason(segmenter: object, label: str) -> str | None:
    """Return why a segmenter cannot search for a label, with alternatives; None if it can.

    Args:
        segmenter: A `Segmenter` of any kind.
        label: Object of interest, canonical.
    """
    vocabulary = closed_vocabulary(segmenter)
    if vocabulary is None or vocabulary.knows(label):
        return None
    return vocabulary.unsupported_reason(label)


def _likeness(one: str, other: str) -> float:
    """Return the similarity of the spelling of two labels: 0 for none, up to 3."""
    first, second = one.split("_"), other.split("_")
    if first[-1] == second[-1]:
        return 2.0 + 1.0 / (len(first) + len(second))
    ratio = fuzz.ratio(one, other)
    return ratio / 100.0 if ratio >= _NEAR_RATIO else 0.0

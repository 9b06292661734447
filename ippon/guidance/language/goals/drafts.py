"""Goals while they are being read, and how far a sentence is read."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

from ippon.guidance.language.goals.goal import Attribute, Goal, Order, Reference, Relation
from ippon.guidance.language.grammar.noun_phrase import NounPhrase
from ippon.guidance.language.grammar.utterance import Utterance


@dataclass(slots=True)
class Draft:
    """A goal that is being read."""

    phrase: NounPhrase
    order: Order = "and"
    attributes: list[Attribute] = field(default_factory=list)
    relations: list[Relation] = field(default_factory=list)
    context: list[str] = field(default_factory=list)
    head: str = ""
    display: str = ""
    count: int | Literal["all"] = 1
    reference: Reference = ""
    gone: bool = False
    """It is told to be gone, so that another may take its place."""
    trigger: str = ""
    """The words that asked for it."""

    @property
    def is_owned(self) -> bool:
        """Whether it is said whose it is: "she" is then the owner."""
        return any(one.kind == "owner" for one in self.attributes)

    def probe(self) -> "Draft":
        """Return a copy to try a reading on."""
        return replace(self, attributes=[], relations=[], context=[])

    def add(self, attribute: Attribute) -> None:
        """Add an attribute, once."""
        if attribute not in self.attributes:
            self.attributes.append(attribute)

    def relate(self, relation: Relation) -> None:
        """Add a relation, once."""
        if relation not in self.relations:
            self.relations.append(relation)

    def note(self, words: str) -> None:
        """Add words to the context."""
        words = words.strip(" ,;:-–—")
        if words and words not in self.context:
            self.context.append(words)

    def goal(self) -> Goal:
        """Return what was read."""
        return Goal(
            object=self.head,
            display=self.display,
            attributes=tuple(self.attributes),
            count=self.count,
            relations=tuple(self.relations),
            context=", ".join(self.context),
            order=self.order,
            refers_to=self.reference,
        )


def draft(phrase: NounPhrase, order: Order = "and", trigger: str = "") -> Draft:
    """Begin a goal with its noun phrase."""
    return Draft(
        phrase=phrase,
        order=order,
        attributes=list(phrase.attributes),
        head=phrase.head,
        display=phrase.display,
        count=1 if phrase.count is None else phrase.count,
        reference=phrase.reference,
        trigger=trigger,
    )


@dataclass(slots=True)
class Reading:
    """A sentence that is being read."""

    said: Utterance
    previous: Sequence[Goal] = ()
    """Goals of the request before."""
    drafts: list[Draft] = field(default_factory=list)
    unused: list[str] = field(default_factory=list)
    """What was told and says nothing about a place."""
    stray: list[str] = field(default_factory=list)
    """What stands where an object should, and is none."""
    list_start: int = 0
    """Index of the first draft of the latest list."""
    asked_for: bool = False
    """The latest list was asked for by a verb with "for": "look for"."""
    order: Order | None = None
    """How the next object follows, where that was said."""
    before: list[str] = field(default_factory=list)
    """Told before the first object."""
    hedged: dict[int, int] = field(default_factory=dict)
    """Where "maybe" and "I think" before such words end, and where they begin."""
    later: list[Draft] = field(default_factory=list)
    """Objects that come after those that are still to be read."""
    each: int = 0
    """How many of each object are meant, where that was said."""
    declined: NounPhrase | None = None
    """An object not to be searched for, which "the white one" may name."""
    subject: NounPhrase | None = None
    """What a clause before the first object tells of, which "another one" and "it" may name."""
    begin: int = 0
    """Index after what was said to others."""
    places: list[Relation] = field(default_factory=list)
    """Said before the object: "look in the kitchen for"."""
    _matched: dict[tuple[int, int], int] = field(default_factory=dict)

    def after(self, position: int) -> int:
        """Return the index of the first word at or after an offset of the text."""
        return next(
            (n for n, token in enumerate(self.said.tokens) if token.start >= position),
            len(self.said),
        )

    def match(self, pattern: re.Pattern[str], index: int) -> int:
        """Return the index after a pattern that matches at a word; the same for none."""
        if index >= len(self.said):
            return index
        key = (id(pattern), index)  # The hash of a pattern takes longer than most matches.
        if key not in self._matched:
            match = pattern.match(self.said.text, self.said.tokens[index].start)
            self._matched[key] = index if match is None else self.after(match.end())
        return self._matched[key]

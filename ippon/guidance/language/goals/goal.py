"""What a person asks for: objects with what was said of each."""

from collections.abc import Collection
from dataclasses import dataclass
from typing import Final, Literal

from ippon.guidance.knowledge import load_knowledge
from ippon.guidance.language.mentions import room_phrases

AttributeKind = Literal[
    "colour",
    "size",
    "material",
    "pattern",
    "shape",
    "condition",
    "feel",
    "which",
    "quality",
    "owner",
    "content",
    "feature",
    "other",
]
Order = Literal["and", "then", "or"]
Reference = Literal["", "other", "same"]

_STOREYS: Final = ("upstairs", "downstairs", "outdoors", "indoors")
ALL: Final = "all"
"""Count of a goal of which every one is wanted."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Attribute:
    """What tells the object from others of its name: red, wooden, Anna's."""

    kind: AttributeKind
    value: str
    """In the operator's words."""
    negated: bool = False

    @property
    def text(self) -> str:
        """In words: "not red"."""
        return f"not {self.value}" if self.negated else self.value


@dataclass(frozen=True, slots=True, kw_only=True)
class Relation:
    """Where the object is said to be, or not to be."""

    relation: str
    """on, in, under, above, next to, near, between, behind, in front of, at, from."""
    place: str
    """A thing, a room or a name of one, in the operator's words without article."""
    negated: bool = False
    attributes: tuple[Attribute, ...] = ()
    """Of the place: "next to the white fridge"."""

    @property
    def text(self) -> str:
        """In words: "not next to white fridge"."""
        denied = "not " if self.negated else ""
        if self.relation == "at" and self.place in _STOREYS:
            return denied + self.place
        described = [one.text for one in self.attributes]
        return denied + " ".join([self.relation, *described, self.place])


@dataclass(frozen=True, slots=True, kw_only=True)
class Goal:
    """One object that is asked for."""

    object: str
    """Head of the noun phrase in the singular, as one names the kind of object."""
    display: str
    """The operator's words without article: "red mug"."""
    attributes: tuple[Attribute, ...] = ()
    count: int | Literal["all"] = 1
    relations: tuple[Relation, ...] = ()
    """What is stated as certain; the rest is in the context."""
    context: str = ""
    """All that was said about the place, for the proximity levels."""
    order: Order = "and"
    """How the goal follows the one before: in any order, afterwards, or in its place."""
    refers_to: Reference = ""
    """The goal before: another one like it, or the same once more."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Request:
    """What a sentence asks for."""

    goals: tuple[Goal, ...]
    doubtful: bool
    """Show it for correction before the robot moves."""
    because: str = ""
    """Why it is doubtful, and what would help."""
    unused: tuple[str, ...] = ()
    """Words that were not understood; nothing else of the sentence was left out."""
    language: str = ""
    """Name of the language where it is not English; then rules find no goal."""


def _is_room(place: Relation, rooms: Collection[str]) -> bool:
    """Tell whether a relation names the room of the object, which is searched first or last."""
    named = place.place in _STOREYS or bool(room_phrases(place.place))
    known = place.place in rooms or load_knowledge().room(place.place) is not None
    return named or known


def unchecked(goal: Goal, rooms: Collection[str] = ()) -> tuple[str, ...]:
    """Return a sentence for each thing that was said and that the search does not use yet.

    Args:
        goal: What was said.
        rooms: Names of the map's rooms, as words in lower case.
    """
    notes = [
        f"whose it is cannot be seen (“{one.value}”): any {goal.object} counts"
        for one in goal.attributes
        if one.kind == "owner"
    ]
    others = [one for one in goal.attributes if one.kind not in ("colour", "size", "owner")]
    if others:
        said = ", ".join(f"“{one.text}”" for one in others)
        notes.append(
            f"{said} {'is' if len(others) == 1 else 'are'} checked only by a model that takes "
            f"images (--llm.second-opinion): without one, any {goal.object} counts"
        )
    notes += [
        f"“{place.text}” guides the search, but a find is not checked for it yet"
        for place in goal.relations
        if not _is_room(place, rooms)
    ]
    return tuple(notes)

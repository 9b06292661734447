"""The object that is searched for."""

from dataclasses import dataclass
from typing import Literal

from ippon.guidance.language.goals.goal import Attribute
from ippon.guidance.language.naming import ResolvedObject
from ippon.vocabulary import in_words


@dataclass(frozen=True, slots=True, kw_only=True)
class Goal:
    """One object of interest."""

    goal_id: int
    object: str
    """Canonical label, as in the queries to the segmentation."""
    display: str
    """The object in the operator's words."""
    context: str = ""
    """What the operator said about its place; empty for nothing."""
    attributes: tuple[Attribute, ...] = ()
    """What tells it from others of its name."""
    count: int | Literal["all"] = 1
    """How many are searched for; "all": until everything reachable was seen."""
    other: bool = False
    """Another one than those of its kind that earlier searches have found."""
    thing_id: int | None = None
    """Number of the remembered thing that it is; None for any of its kind."""
    category: str | None = None
    """The common object that it is an instance of; None if there is none."""

    @classmethod
    def of(cls, resolved: ResolvedObject, goal_id: int, context: str = "") -> "Goal":
        """Return the goal of an object that a text names."""
        return cls(
            goal_id=goal_id,
            object=resolved.canonical,
            display=resolved.display,
            context=context,
            category=resolved.category,
        )

    @property
    def described(self) -> str:
        """The object with all that an image may show of it: "mug, with a dinosaur on it".

        Neither its name ("Rosie") nor whose it is can be seen.
        """
        kind = self.display if self.thing_id is None else in_words(self.object)
        texts = (one.text for one in self.attributes if one.kind != "owner")
        return ", ".join([kind, *(text for text in texts if text.lower() not in kind.lower())])

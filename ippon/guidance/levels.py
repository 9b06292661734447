"""Proximity levels: the probability that the goal is near a common object."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from enum import IntEnum
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from ippon.mapping.level_probabilities import LEVEL_PROBABILITIES

BY_OPERATOR: Final = "set by the operator"
"""Reason of a level that the operator set; later answers do not change it."""

LevelName = Literal["certain", "near", "average", "far"]


class Level(IntEnum):
    """The four levels of the paper (Sec. Semantic Guidance), ordered by probability."""

    FAR = 0
    AVERAGE = 1
    NEAR = 2
    CERTAIN = 3

    @property
    def text(self) -> LevelName:
        """Name in lower case, as on the wire; `parse` reads it."""
        return _NAMES[self]

    @classmethod
    def parse(cls, text: str) -> "Level":
        """Read a level by name, in any case.

        Raises:
            ValueError: No level has that name.
        """
        try:
            return cls[text.strip().upper()]
        except KeyError:
            known = ", ".join(level.text for level in cls)
            raise ValueError(f"no proximity level {text!r}; the levels are {known}") from None


_NAMES: Final[dict[Level, LevelName]] = {
    Level.FAR: "far",
    Level.AVERAGE: "average",
    Level.NEAR: "near",
    Level.CERTAIN: "certain",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class LevelProbabilities:
    """l(O | C) of each level. The paper gives only the order; these are our defaults."""

    certain: float = LEVEL_PROBABILITIES[3]
    """An unknown voxel near such an object counts as this share of a voxel of the goal; larger
    draws the search to it."""
    near: float = LEVEL_PROBABILITIES[2]
    average: float = LEVEL_PROBABILITIES[1]
    far: float = LEVEL_PROBABILITIES[0]

    def __post_init__(self) -> None:
        """Check the order that the paper demands."""
        if not 1.0 >= self.certain > self.near > self.average > self.far >= 0.0:
            raise ValueError(
                "level probabilities must fall strictly: 1 >= certain > near > average > far >= 0; "
                f"got {self.certain}, {self.near}, {self.average}, {self.far}"
            )

    def as_array(self) -> NDArray[np.float32]:
        """Return (4,) float32 indexed by `Level`."""
        return np.array([self.far, self.average, self.near, self.certain], dtype=np.float32)


@dataclass(frozen=True, slots=True, kw_only=True)
class LabelLevel:
    """The level of one common object, with the reason."""

    label: str
    level: Level
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Guidance:
    """Levels of all common objects for one goal, from one provider."""

    ooi: str
    """Canonical label of the object of interest."""
    context: str
    provider: str
    rows: tuple[LabelLevel, ...]
    """In the order of the vocabulary."""
    notes: tuple[str, ...] = ()
    """Messages for the operator: unknown object, claims that were not understood, …"""

    def labels_of(self, level: Level) -> tuple[str, ...]:
        """Return the common objects of one level, in the order of the vocabulary."""
        return tuple(row.label for row in self.rows if row.level is level)

    def levels(self) -> NDArray[np.uint8]:
        """Return (N,) uint8 levels in the order of the vocabulary."""
        return np.array([row.level for row in self.rows], dtype=np.uint8)

    def changed(self, rows: Iterable[LabelLevel]) -> "Guidance":
        """Return the guidance with some rows replaced; labels that it lacks are ignored."""
        other = {row.label: row for row in rows}
        return replace(self, rows=tuple(other.get(row.label, row) for row in self.rows))

    def over(self, labels: tuple[str, ...], more: Iterable[LabelLevel]) -> "Guidance":
        """Return the guidance for another vocabulary.

        Args:
            labels: The vocabulary.
            more: Rows for at least the labels that the guidance lacks.

        Raises:
            KeyError: A label has no row.
        """
        rated = {row.label: row for row in (*more, *self.rows)}
        return replace(self, rows=tuple(rated[label] for label in labels))

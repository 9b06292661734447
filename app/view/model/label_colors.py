"""The labels of the map with a colour of their own: twelve, also apart for colour-blind eyes.

A label that has a colour keeps it; free colours go to the most frequent labels without one.
"""

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from app.view.colors import UNMAPPED, LegendEntry, Rgb
from app.view.words import Words

KIND_COLORS: Final[tuple[Rgb, ...]] = (
    (90, 150, 255), (255, 75, 0), (210, 255, 75), (135, 45, 120), (150, 255, 195), (150, 30, 0),
    (240, 195, 255), (60, 60, 180), (240, 105, 165), (150, 165, 105), (105, 90, 75), (135, 0, 255),
)  # fmt: skip
"""Found by a search for the largest least distance in CIELAB over normal sight, protanopia,
deuteranopia and tritanopia (simulated after Machado et al. 2009): 27."""
STRUCTURE_COLORS: Final[dict[str, Rgb]] = {
    "wall": (0x8C, 0x93, 0x9C),
    "floor": (0x6A, 0x70, 0x79),
    "ceiling": (0x8C, 0x93, 0x9C),
}
"""Parts of the building have no colour, so that things stand out."""
OTHER: Final[Rgb] = (0xB9, 0xBE, 0xC5)
"""A label without a colour."""
LEAST_VOXELS: Final = 10
"""Voxels from which a label gets a colour."""


class LabelColors:
    """Colours of the labels of one map."""

    def __init__(self) -> None:
        self._labels: tuple[str, ...] = ()
        self._given: list[int] = []
        self.table: NDArray[np.uint8] = np.full((256, 3), UNMAPPED, np.uint8)
        """(256, 3) RGB by number of the label; a new array when anything changes."""
        self.entries: tuple[LegendEntry, ...] = ()
        """Colours that are given, with the labels."""

    def update(self, labels: Sequence[str], counts: NDArray[np.int64]) -> bool:
        """Give free colours; return whether any colour has changed.

        Args:
            labels: Names by number.
            counts: (256,) voxels of each label in the map.
        """
        names = tuple(labels[:255])
        if names[: len(self._labels)] != self._labels:
            self._given = []
        before = (self._labels, tuple(self._given))
        self._labels = names
        # A stable sort: of equally frequent labels the first keeps its place.
        for n in np.argsort(-counts[: len(names)], kind="stable").tolist():
            if len(self._given) == len(KIND_COLORS) or counts[n] < LEAST_VOXELS:
                break
            if n not in self._given and names[n] not in STRUCTURE_COLORS:
                self._given.append(n)
        if (self._labels, tuple(self._given)) == before:
            return False
        self._paint()
        return True

    def _paint(self) -> None:
        table = np.full((256, 3), UNMAPPED, np.uint8)
        table[: len(self._labels)] = OTHER
        for n, name in enumerate(self._labels):
            if name in STRUCTURE_COLORS:
                table[n] = STRUCTURE_COLORS[name]
        entries: list[LegendEntry] = []
        for color, n in zip(KIND_COLORS, self._given, strict=False):
            table[n] = color
            entries.append(LegendEntry(color=color, text=self._labels[n]))
        self.table, self.entries = table, tuple(entries)


def with_rest(kinds: tuple[LegendEntry, ...], say: Words) -> tuple[LegendEntry, ...]:
    """Return a legend of labels by their names, with the colours of what is none of them."""
    rest = [(STRUCTURE_COLORS["wall"], "structure"), (UNMAPPED, "unclassified")]
    if len(kinds) == len(KIND_COLORS):
        rest.insert(1, (OTHER, "others"))
    named = (LegendEntry(color=c, text=say(f"panel.legend.{key}")) for c, key in rest)
    known = (LegendEntry(color=kind.color, text=say.name(kind.text)) for kind in kinds)
    return (*known, *named)

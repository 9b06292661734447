"""Layout of the plan on paper: colours, names that have room, lines and the scale bar."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from app.view.colors import PATH, ROBOT, Rgb
from app.view.plan.plan_cells import Cell, PlanCells
from app.view.plan.plan_scene import PlanScene
from app.view.words import Words

CELL_COLORS: Final[dict[Cell, Rgb]] = {
    Cell.UNKNOWN: (0x2A, 0x31, 0x3B),
    Cell.FLOOR: (0xF2, 0xEF, 0xE8),
    Cell.FURNITURE: (0xC9, 0xB8, 0x9C),
    Cell.WALL: (0x15, 0x19, 0x20),
}
MARGIN_M: Final = 0.6
TEXT: Final[Rgb] = (0x1A, 0x21, 0x29)
PALE: Final[Rgb] = (0xE8, 0xED, 0xF3)
BODY_M: Final = 0.25
"""Radius of the robot on the plan."""
BAR_TEXT_M: Final = 0.26


@dataclass(frozen=True, slots=True, kw_only=True)
class PlacedText:
    """A name on the plan that meets no other."""

    text: str
    x_m: float
    y_m: float
    size_m: float
    """Height of the letters."""
    is_room: bool


class Sheet:
    """The paper: metres from the upper left corner, y down, with a margin round the cells."""

    def __init__(self, cells: PlanCells) -> None:
        self._x0, self._y0 = cells.origin_m
        self.width_m = cells.size_m[0] + 2 * MARGIN_M
        self.height_m = cells.size_m[1] + 2 * MARGIN_M

    def place(self, x: float, y: float) -> tuple[float, float]:
        """Return where a point of the world is on the sheet."""
        return x - self._x0 + MARGIN_M, self.height_m - (y - self._y0 + MARGIN_M)

    @property
    def bar_at(self) -> tuple[float, float]:
        """Left end of the scale bar."""
        return MARGIN_M, self.height_m - 0.3


def scale_bar_m(width_m: float) -> float:
    """Return the length of a scale bar: 1, 2 or 5 times a power of ten."""
    limit = max(width_m / 5.0, 0.1)
    power = 10.0 ** math.floor(math.log10(limit))
    return next(step * power for step in (5.0, 2.0, 1.0) if step * power <= limit)


def placed_texts(scene: PlanScene, say: Words) -> list[PlacedText]:
    """Return the names that have room: rooms first, then furniture, the largest first."""
    wanted = [
        PlacedText(
            text=room.name or say.room(room.kind),
            x_m=room.x_m,
            y_m=room.y_m,
            size_m=0.34,
            is_room=True,
        )
        for room in scene.rooms
        if room.name or room.kind
    ]
    wanted += [
        PlacedText(
            text=say.name(thing.text), x_m=thing.x_m, y_m=thing.y_m, size_m=0.2, is_room=False
        )
        for thing in scene.things
    ]
    placed: list[PlacedText] = []
    for one in wanted:
        if all(not _overlap(one, other) for other in placed):
            placed.append(one)
    return placed


def _overlap(one: PlacedText, other: PlacedText) -> bool:
    half = 0.3 * (len(one.text) * one.size_m + len(other.text) * other.size_m)
    apart_x, apart_y = abs(one.x_m - other.x_m), abs(one.y_m - other.y_m)
    return apart_x < half and apart_y < 0.6 * (one.size_m + other.size_m)


def lines_of(scene: PlanScene) -> Iterator[tuple[list[tuple[float, float]], Rgb, float]]:
    """Yield points, colour and width in metres of the robot's trail and path."""
    for points, color, width_m in ((scene.trail, ROBOT, 0.04), (scene.path, PATH, 0.07)):
        if len(points) > 1:
            yield points, color, width_m

"""Doors of a floor of a large building: every room opens to a corridor, often opposite another."""

from typing import Final

import numpy as np

from ippon.simulation.homes.furniture.style import chance, uniform
from ippon.simulation.homes.layout.openings import (
    END_MARGIN_M,
    Opening,
    SharedWall,
    leaf_position,
    opening_in,
)
from ippon.simulation.homes.layout.room_layout import RoomPlan

_OPEN: Final = frozenset(("foyer", "nurses_station", "shop", "large_shop", "canteen"))
"""Kinds with a wide opening to each corridor that they border on."""
_TWO_DOORS_M: Final = 7.0
"""Length of wall from which a room has two doors."""
_OPPOSITE_M: Final = 5.0
"""Greatest distance of two doors that are opposite each other."""


def join_building(
    rng: np.random.Generator, rooms: tuple[RoomPlan, ...], walls: tuple[SharedWall, ...]
) -> list[Opening]:
    """Choose doors and passages; each room gets one to a corridor at least.

    A door is opposite one across the corridor where the walls allow it.
    """
    doors: list[Opening] = []
    walls_of: dict[int, list[SharedWall]] = {}
    for wall in walls:
        if wall.second < 0 or wall.high - wall.low < 1.1 + 2 * END_MARGIN_M:
            continue
        halls = [k for k in (wall.first, wall.second) if rooms[k].kind == "hall"]
        if len(halls) == 2:
            doors.append(_passage(rng, wall, share=1.0))
        elif halls:
            own = wall.second if halls[0] == wall.first else wall.first
            walls_of.setdefault(own, []).append(wall)
    for room, options in walls_of.items():
        options.sort(key=lambda w: w.low - w.high)
        if rooms[room].kind in _OPEN:
            doors += [_passage(rng, wall, share=uniform(rng, 0.25, 0.5)) for wall in options]
            continue
        longest = [w for w in options if w.high - w.low > 0.9 * (options[0].high - options[0].low)]
        wall = longest[int(rng.integers(len(longest)))]
        for span in _door_spans(wall):
            low = _low_of_door(rng, span, wall, doors)
            width, top = uniform(rng, 0.9, 0.98), uniform(rng, 2.03, 2.12)
            leaf = leaf_position(rng, rooms, wall, low, width)
            doors.append(opening_in(wall, "door", low, low + width, (0.0, top), **leaf))
    return doors


def _passage(rng: np.random.Generator, wall: SharedWall, *, share: float) -> Opening:
    """Return an opening over a share of a wall, at any place."""
    free = wall.high - wall.low - 2 * END_MARGIN_M
    width = max(share * free, min(1.4, free))
    low = wall.low + END_MARGIN_M + uniform(rng, 0.0, free - width)
    return opening_in(wall, "passage", low, low + width, (0.0, 2.3))


def _door_spans(wall: SharedWall) -> list[tuple[float, float]]:
    """Return the parts of a wall that get a door each: one, or the two ends of a long wall."""
    low, high = wall.low + END_MARGIN_M, wall.high - END_MARGIN_M
    if high - low < _TWO_DOORS_M:
        return [(low, high)]
    return [(low, low + 0.35 * (high - low)), (high - 0.35 * (high - low), high)]


def _low_of_door(
    rng: np.random.Generator,
    span: tuple[float, float],
    wall: SharedWall,
    doors: list[Opening],
) -> float:
    """Return the lower end of a door 1 m wide: opposite another, else at an end of the span."""
    low, high = span[0], span[1] - 1.0
    for other in doors:
        across = abs(other.line - wall.line)
        parallel = other.kind == "door" and other.along_x == wall.along_x
        if parallel and 0.0 < across < _OPPOSITE_M and low <= other.low <= high:
            return other.low
    return low if chance(rng, 0.5) else high

"""Layout of a floor of a large building, such as a hospital."""

from collections.abc import Iterator
from itertools import cycle
from typing import Final

import numpy as np

from ippon.simulation.homes.furniture.style import uniform
from ippon.simulation.homes.layout.rect import Rect
from ippon.simulation.homes.layout.room_layout import RoomPlan, snapped, turned

_ROOMS: Final[dict[str, int]] = {
    "bedroom": 14,
    "bathroom": 6,
    "study": 6,
    "living_room": 2,
    "dining_room": 1,
    "kitchen": 1,
    "laundry": 1,
}
"""How common each kind is."""
_WIDTHS_M: Final[dict[str, float]] = {
    "bedroom": 4.4,
    "bathroom": 2.4,
    "study": 3.4,
    "living_room": 6.4,
    "dining_room": 4.8,
    "kitchen": 4.0,
    "laundry": 2.4,
}
"""Usual extent along the corridor."""
_FULL: Final = 0.93
"""Share of a row from which no further room is added; its rooms then fill the rest."""


def plan_large_floor(rng: np.random.Generator) -> tuple[RoomPlan, ...]:
    """Draw four rows of rooms along two corridors joined by a third: about 1,000 m2.

    The caller checks whether doors can connect all rooms.
    """
    length, corridor = snapped(uniform(rng, 36.0, 44.0)), snapped(uniform(rng, 2.0, 2.6))
    kinds = [kind for kind, count in _ROOMS.items() for _ in range(count)]
    deck = cycle([kinds[k] for k in rng.permutation(len(kinds)).tolist()])
    crossing = snapped(length * uniform(rng, 0.3, 0.7))
    strips: list[tuple[float, float]] = []
    y = 0.0
    for row in range(4):
        y0, y = y, snapped(y + uniform(rng, 4.4, 5.6))
        strips.append((y0, y))
        if row in (0, 2):
            y = snapped(y + corridor)
    (y0, y1), (y2, y3), (y4, y5), (y6, y7) = strips
    beyond = snapped(crossing + corridor)
    rooms = [
        *_row(deck, Rect(0.0, y0, length, y1)),
        RoomPlan(kind="hall", rect=Rect(0.0, y1, length, y2)),
        *_row(deck, Rect(0.0, y2, crossing, y3)),
        *_row(deck, Rect(beyond, y2, length, y3)),
        *_row(deck, Rect(0.0, y4, crossing, y5)),
        *_row(deck, Rect(beyond, y4, length, y5)),
        RoomPlan(kind="hall", rect=Rect(crossing, y2, beyond, y5)),
        RoomPlan(kind="hall", rect=Rect(0.0, y5, length, y6)),
        *_row(deck, Rect(0.0, y6, length, y7)),
    ]
    return turned(rng, rooms)


def _row(deck: Iterator[str], rect: Rect) -> list[RoomPlan]:
    """Fill a strip with adjacent rooms."""
    kinds: list[str] = []
    taken = 0.0
    while taken < _FULL * rect.width:
        kinds.append(next(deck))
        taken += _WIDTHS_M[kinds[-1]]
    ends = np.cumsum([_WIDTHS_M[kind] for kind in kinds]) * rect.width / taken + rect.x0
    xs = [rect.x0, *(snapped(float(x)) for x in ends[:-1]), rect.x1]
    return [
        RoomPlan(kind=kind, rect=Rect(x0, rect.y0, x1, rect.y1))
        for kind, x0, x1 in zip(kinds, xs[:-1], xs[1:], strict=True)
    ]

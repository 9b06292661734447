"""Which rooms a floor of a large building has, a hospital's or a home for the elderly's."""

from collections.abc import Iterator
from itertools import cycle
from typing import Final

import numpy as np

from ippon.simulation.homes.layout import RoomPlan, snapped, turned
from ippon.simulation.homes.rect import Rect
from ippon.simulation.homes.style import uniform

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
_ROWS: Final = 4
_FULL: Final = 0.93
"""A row gets no further room when this share of it is taken; its rooms then share the rest."""


def plan_large_floor(rng: np.random.Generator) -> tuple[RoomPlan, ...]:
    """Draw four rows of rooms along two corridors, which a third one joins: about 1,000 m2.

    Whether doors can join all rooms is checked by the caller.
    """
    length, corridor = snapped(uniform(rng, 36.0, 44.0)), snapped(uniform(rng, 2.0, 2.6))
    kinds = [kind for kind, count in _ROOMS.items() for _ in range(count)]
    deck = cycle([kinds[k] for k in rng.permutation(len(kinds)).tolist()])
    crossing = snapped(length * uniform(rng, 0.3, 0.7))
    rooms: list[RoomPlan] = []
    y = crossing_y = 0.0
    for row in range(_ROWS):
        y0, y = y, snapped(y + uniform(rng, 4.4, 5.6))
        if row in (0, _ROWS - 1):
            rooms += _row(deck, Rect(0.0, y0, length, y))
        else:
            rooms += _row(deck, Rect(0.0, y0, crossing, y))
            rooms += _row(deck, Rect(snapped(crossing + corridor), y0, length, y))
        if row == 1:
            crossing_y = y0
        else:
            # Behind the outer rows and, across, between the corridors.
            across = Rect(crossing, crossing_y, snapped(crossing + corridor), y)
            along = Rect(0.0, y, length, snapped(y + corridor))
            if row == _ROWS - 2:
                rooms.append(RoomPlan(kind="hall", rect=across))
            if row < _ROWS - 1:
                rooms.append(RoomPlan(kind="hall", rect=along))
                y = along.y1
    return turned(rng, rooms)


def _row(deck: Iterator[str], rect: Rect) -> list[RoomPlan]:
    """Fill a strip with rooms side by side."""
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

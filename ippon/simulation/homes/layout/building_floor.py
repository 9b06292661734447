"""Layouts of a floor of a large building: office, school, hospital ward and shopping centre."""

from collections.abc import Sequence
from typing import Final, Literal

import numpy as np

from ippon.simulation.homes.furniture.style import uniform
from ippon.simulation.homes.layout.rect import Rect
from ippon.simulation.homes.layout.room_layout import RoomPlan, snapped, turned

BuildingKind = Literal["office", "school", "ward", "shopping_centre"]
BUILDING_KINDS: Final[tuple[BuildingKind, ...]] = ("office", "school", "ward", "shopping_centre")

_WIDTHS_M: Final[dict[str, tuple[float, float]]] = {
    "office": (2.9, 3.5),
    "open_plan_office": (12.0, 16.0),
    "meeting_room": (4.0, 5.5),
    "foyer": (5.5, 7.0),
    "living_room": (5.0, 6.5),
    "kitchen": (3.4, 4.2),
    "washroom": (2.8, 3.6),
    "store_room": (2.4, 3.4),
    "laundry": (2.4, 3.0),
    "classroom": (7.6, 9.0),
    "patient_room": (3.6, 4.2),
    "ward_bay": (7.0, 8.0),
    "nurses_station": (4.5, 6.0),
    "shop": (5.0, 7.5),
    "large_shop": (17.0, 21.0),
    "canteen": (9.0, 11.0),
}
"""Range of the extent along the corridor; like rooms of a building have one width."""


def plan_building(rng: np.random.Generator, kind: BuildingKind) -> tuple[RoomPlan, ...]:
    """Draw a floor of 600 to 1,200 m2.

    An office and a ward have two corridors round a core, a school has one corridor that ends at a
    hall, and a shopping centre a wide walk with a corridor for the staff behind the shops.
    """
    widths = {name: uniform(rng, *span) for name, span in _WIDTHS_M.items()}
    plans = {
        "office": _office,
        "school": _school,
        "ward": _ward,
        "shopping_centre": _shopping_centre,
    }
    return turned(rng, plans[kind](rng, widths))


def _office(rng: np.random.Generator, widths: dict[str, float]) -> list[RoomPlan]:
    """Draw small offices, a core, and open-plan offices with meeting rooms between them."""
    offices = ["office"] * int(rng.integers(8, 11))
    open_plan = ["open_plan_office", "meeting_room", "meeting_room", "open_plan_office"]
    core = ["washroom", "kitchen", "store_room", "living_room", "meeting_room", "washroom"]
    return _round_a_core(
        rng,
        widths,
        corridor=uniform(rng, 1.8, 2.3),
        south=(uniform(rng, 4.4, 5.2), ["foyer", *offices, "meeting_room"]),
        core=(uniform(rng, 4.0, 5.0), core),
        north=(uniform(rng, 7.0, 9.5), open_plan),
    )


def _ward(rng: np.random.Generator, widths: dict[str, float]) -> list[RoomPlan]:
    """Draw bays and patients' rooms round a core with the nurses' station."""
    core = ["washroom", "store_room", "washroom", "kitchen", "laundry", "office", "office"]
    core.insert(int(rng.integers(2, 5)), "nurses_station")
    bays = ["ward_bay", "ward_bay", "washroom", "ward_bay", "living_room"]
    return _round_a_core(
        rng,
        widths,
        corridor=uniform(rng, 2.2, 2.7),
        south=(uniform(rng, 5.4, 6.2), ["patient_room"] * 6 + ["washroom", "ward_bay", "office"]),
        core=(uniform(rng, 4.0, 4.8), core),
        north=(uniform(rng, 5.6, 6.4), bays),
    )


def _round_a_core(
    rng: np.random.Generator,
    widths: dict[str, float],
    *,
    corridor: float,
    south: tuple[float, list[str]],
    core: tuple[float, list[str]],
    north: tuple[float, list[str]],
) -> list[RoomPlan]:
    """Place two outer rows and a core, each with its depth and rooms, and a corridor round it."""
    way = snapped(corridor)
    length = snapped(max(sum(widths[kind] for kind in south[1]), 30.0))
    y1 = snapped(south[0])
    y2 = snapped(y1 + way)
    y3 = snapped(y2 + core[0])
    y4 = snapped(y3 + way)
    end = snapped(length - way)
    return [
        *_row(widths, south[1], Rect(0.0, 0.0, length, y1)),
        *_row(widths, _shuffled(rng, core[1]), Rect(way, y2, end, y3)),
        *_row(widths, north[1], Rect(0.0, y4, length, snapped(y4 + north[0]))),
        RoomPlan(kind="hall", rect=Rect(0.0, y1, length, y2)),
        RoomPlan(kind="hall", rect=Rect(0.0, y3, length, y4)),
        RoomPlan(kind="hall", rect=Rect(0.0, y2, way, y3)),
        RoomPlan(kind="hall", rect=Rect(end, y2, length, y3)),
    ]


def _school(rng: np.random.Generator, widths: dict[str, float]) -> list[RoomPlan]:
    """Draw classrooms on both sides of a corridor that ends at a hall for meals and assemblies."""
    y1 = snapped(uniform(rng, 7.0, 8.0))
    y2 = snapped(y1 + uniform(rng, 2.6, 3.2))
    y3 = snapped(y2 + uniform(rng, 7.0, 8.0))
    south = ["washroom", *["classroom"] * int(rng.integers(4, 6)), "store_room", "washroom"]
    north = ["classroom"] * (south.count("classroom") - 1) + ["living_room", "office", "office"]
    length = snapped(max(sum(widths[kind] for kind in row) for row in (south, north)))
    hall = snapped(length + uniform(rng, 10.0, 13.0))
    return [
        *_row(widths, _shuffled(rng, south), Rect(0.0, 0.0, length, y1)),
        *_row(widths, _shuffled(rng, north), Rect(0.0, y2, length, y3)),
        RoomPlan(kind="hall", rect=Rect(0.0, y1, length, y2)),
        RoomPlan(kind="canteen", rect=Rect(length, 0.0, hall, y3)),
    ]


def _shopping_centre(rng: np.random.Generator, widths: dict[str, float]) -> list[RoomPlan]:
    """Draw shops on both sides of a wide walk, and the staff's rooms behind them."""
    y1 = snapped(uniform(rng, 5.5, 6.5))
    y2 = snapped(y1 + uniform(rng, 3.6, 4.6))
    y3 = snapped(y2 + uniform(rng, 9.5, 11.5))
    y4 = snapped(y3 + uniform(rng, 1.8, 2.2))
    y5 = snapped(y4 + uniform(rng, 3.6, 4.4))
    large = ["large_shop", "canteen", "shop"]
    back = ["store_room", "store_room", "office", "washroom", "washroom", "living_room", "kitchen"]
    length = snapped(sum(widths[kind] for kind in large))
    return [
        *_row(widths, ["shop"] * 5 + ["foyer"], Rect(0.0, 0.0, length, y1)),
        RoomPlan(kind="hall", rect=Rect(0.0, y1, length, y2)),
        *_row(widths, _shuffled(rng, large), Rect(0.0, y2, length, y3)),
        RoomPlan(kind="hall", rect=Rect(0.0, y3, length, y4)),
        *_row(widths, _shuffled(rng, back), Rect(0.0, y4, length, y5)),
    ]


def _shuffled(rng: np.random.Generator, kinds: list[str]) -> list[str]:
    order: list[int] = rng.permutation(len(kinds)).tolist()
    return [kinds[k] for k in order]


def _row(widths: dict[str, float], kinds: Sequence[str], rect: Rect) -> list[RoomPlan]:
    """Fill a strip along x with adjacent rooms in proportion to their usual widths."""
    ends = np.cumsum([widths[kind] for kind in kinds])
    inner = [snapped(rect.x0 + float(end / ends[-1]) * rect.width) for end in ends[:-1]]
    xs = [rect.x0, *inner, rect.x1]
    return [
        RoomPlan(kind=kind, rect=Rect(x0, rect.y0, x1, rect.y1))
        for kind, x0, x1 in zip(kinds, xs[:-1], xs[1:], strict=True)
    ]

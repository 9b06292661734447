"""Rooms of a home and their layout: rectangles whose edges are the centre lines of walls."""

from dataclasses import dataclass

import numpy as np

from ippon.errors import SceneError
from ippon.simulation.homes.furniture.style import chance, pick, uniform
from ippon.simulation.homes.layout.rect import Rect

# Rooms -> range of the floor area in square metres, and how common such homes are.
_SIZES: dict[int, tuple[float, float, float]] = {
    1: (31.0, 38.0, 0.03),
    2: (33.0, 48.0, 0.07),
    3: (42.0, 62.0, 0.11),
    4: (54.0, 84.0, 0.16),
    5: (64.0, 105.0, 0.18),
    6: (78.0, 135.0, 0.17),
    7: (95.0, 170.0, 0.12),
    8: (115.0, 210.0, 0.09),
    9: (135.0, 245.0, 0.07),
}
# Kind -> usual area, least side, greatest ratio of its sides.
_KINDS: dict[str, tuple[float, float, float]] = {
    "studio": (26.0, 4.3, 1.8),
    "living_room": (22.0, 3.5, 1.9),
    "kitchen": (10.0, 2.4, 2.4),
    "bedroom": (13.0, 2.9, 1.8),
    "bathroom": (5.5, 1.85, 2.5),
    "hall": (6.0, 1.35, 3.2),
    "study": (9.0, 2.5, 1.9),
    "dining_room": (12.0, 2.9, 1.8),
    "laundry": (4.8, 1.75, 2.4),
}
_PUBLIC = ("living_room", "dining_room", "kitchen")
_LAYOUT_ATTEMPTS = 400


@dataclass(frozen=True, slots=True, kw_only=True)
class RoomPlan:
    """Type and rectangle of a room."""

    kind: str
    rect: Rect


def plan_rooms(rng: np.random.Generator) -> tuple[RoomPlan, ...]:
    """Draw the rooms of a home; the caller checks whether doors can connect them.

    Raises:
        SceneError: No arrangement was found; this is very unlikely for the range of sizes.
    """
    counts = list(_SIZES)
    weights = np.array([_SIZES[n][2] for n in counts])
    count = counts[int(rng.choice(len(counts), p=weights / weights.sum()))]
    low, high, _ = _SIZES[count]
    area = uniform(rng, low, high)
    kinds = _program(rng, count)
    for _ in range(_LAYOUT_ATTEMPTS):
        rooms = _spine(rng, kinds, area) if "hall" in kinds and count > 4 else None
        if rooms is None:
            ratio = uniform(rng, 1.0, 1.6 if len(kinds) > 2 else 2.0)
            outline = Rect(0.0, 0.0, snapped((area * ratio) ** 0.5), snapped((area / ratio) ** 0.5))
            rooms = _divide(rng, outline, list(kinds), _areas(kinds, area))
        if all(_is_well_shaped(r) for r in rooms):
            return turned(rng, rooms)
    raise SceneError(f"no arrangement of {kinds} in {area:.0f} square metres was found")


def _program(rng: np.random.Generator, count: int) -> tuple[str, ...]:
    """Choose the types of `count` rooms."""
    if count == 1:
        return ("studio",)
    if count == 2:
        return ("studio", "bathroom")
    if count == 3 and chance(rng, 0.35):
        return ("studio", "bathroom", "hall")
    if count == 3:
        return ("living_room", "bedroom", "bathroom")
    kinds = ["living_room", "kitchen", "bedroom", "bathroom"]
    if count >= 5:
        kinds.append("hall" if count > 5 or chance(rng, 0.6) else "bedroom")
    if count >= 6:
        kinds.append("bedroom" if chance(rng, 0.75) else "study")
    extras = ["bathroom", "dining_room", "study", "laundry", "bedroom"]
    order = rng.permutation(len(extras)).tolist()
    kinds += [extras[k] for k in order][: max(0, count - 6)]
    return tuple(kinds)


def _areas(kinds: tuple[str, ...], total: float) -> list[float]:
    usual = [_KINDS[k][0] for k in kinds]
    return [a * total / sum(usual) for a in usual]


def snapped(value: float) -> float:
    """Return a length rounded to steps of 5 cm."""
    return round(round(value / 0.05) * 0.05, 2)


def _divide(
    rng: np.random.Generator, rect: Rect, kinds: list[str], areas: list[float]
) -> list[RoomPlan]:
    """Split a rectangle recursively until every room has its share."""
    if len(kinds) == 1:
        return [RoomPlan(kind=kinds[0], rect=rect)]
    order = rng.permutation(len(kinds)).tolist()
    total, first, taken = sum(areas), [order[0]], areas[order[0]]
    for k in order[1:-1]:
        if taken + 0.5 * areas[k] > total * uniform(rng, 0.4, 0.6):
            break
        first.append(k)
        taken += areas[k]
    rest = [k for k in order if k not in first]
    share = taken / total
    along_x = (rect.width > rect.depth) == chance(rng, 0.9)
    across = rect.depth if along_x else rect.width
    least = [_least_side([kinds[k] for k in part], across) for part in (first, rest)]
    if along_x:
        x = snapped(_cut(rect.x0, rect.x1, share, least))
        halves = Rect(rect.x0, rect.y0, x, rect.y1), Rect(x, rect.y0, rect.x1, rect.y1)
    else:
        y = snapped(_cut(rect.y0, rect.y1, share, least))
        halves = Rect(rect.x0, rect.y0, rect.x1, y), Rect(rect.x0, y, rect.x1, rect.y1)
    rooms: list[RoomPlan] = []
    for half, members in zip(halves, (first, rest), strict=True):
        rooms += _divide(rng, half, [kinds[k] for k in members], [areas[k] for k in members])
    return rooms


def _least_side(kinds: list[str], across: float) -> float:
    """Return the least length of a part whose other side is `across` metres."""
    least = max(_KINDS[k][1] for k in kinds)
    return max(least, across / _KINDS[kinds[0]][2]) if len(kinds) == 1 else least


def _cut(low: float, high: float, share: float, least: list[float]) -> float:
    """Split an edge at a share of its length, shifted so that no part is too short."""
    return min(max(low + share * (high - low), low + least[0]), high - least[1])


def _spine(rng: np.random.Generator, kinds: tuple[str, ...], total: float) -> list[RoomPlan] | None:
    """Place private rooms on both sides of a corridor next to a block of public rooms."""
    areas = dict(enumerate(_areas(kinds, total)))
    public = [
        k
        for k, kind in enumerate(kinds)
        if kind == "living_room" or (kind in _PUBLIC and chance(rng, 0.7))
    ]
    private = [k for k, kind in enumerate(kinds) if k not in public and kind != "hall"]
    scale = max(1.0, (total / 100.0) ** 0.5)
    corridor = snapped(uniform(rng, 1.3, 1.6) * min(scale, 1.2))
    upper, lower = (snapped(uniform(rng, 2.9, 4.3) * min(scale, 1.25)) for _ in range(2))
    height = snapped(upper + corridor + lower)
    block = snapped(sum(areas[k] for k in public) / height)
    sides: tuple[list[int], list[int]] = ([], [])
    lengths = [0.0, 0.0]
    for k in rng.permutation(private).tolist():
        side = 0 if lengths[0] <= lengths[1] else 1
        sides[side].append(k)
        lengths[side] += max(areas[k] / (upper, lower)[side], _KINDS[kinds[k]][1])
    if not sides[0] or not sides[1]:
        return None
    ends = lengths
    if max(lengths) < 1.4 * min(lengths):
        ends = [0.5 * sum(lengths)] * 2
    rooms = _divide(
        rng,
        Rect(0.0, 0.0, block, height),
        [kinds[k] for k in public],
        [areas[k] for k in public],
    )
    rooms.append(
        RoomPlan(
            kind="hall",
            rect=Rect(block, lower, snapped(block + max(ends)), snapped(lower + corridor)),
        )
    )
    bands = ((snapped(lower + corridor), height), (0.0, lower))
    for side, (y0, y1) in enumerate(bands):
        x = block
        for n, k in enumerate(sides[side]):
            width = max(areas[k] / (upper, lower)[side], _KINDS[kinds[k]][1])
            x1 = snapped(x + width * ends[side] / lengths[side])
            if n == len(sides[side]) - 1:
                x1 = snapped(block + ends[side])
            rooms.append(RoomPlan(kind=kinds[k], rect=Rect(x, y0, x1, y1)))
            x = x1
    return rooms


def _is_well_shaped(room: RoomPlan) -> bool:
    _, least, ratio = _KINDS[room.kind]
    short, long = sorted((room.rect.width, room.rect.depth))
    return short >= least and (long <= ratio * short or room.kind == "hall")


def turned(rng: np.random.Generator, rooms: list[RoomPlan]) -> tuple[RoomPlan, ...]:
    """Mirror and transpose at random, and move the lowest corner to the origin."""
    mirror_x, mirror_y, swap = (bool(pick(rng, (True, False))) for _ in range(3))
    rects: list[Rect] = []
    for room in rooms:
        r = room.rect
        if mirror_x:
            r = Rect(-r.x1, r.y0, -r.x0, r.y1)
        if mirror_y:
            r = Rect(r.x0, -r.y1, r.x1, -r.y0)
        rects.append(Rect(r.y0, r.x0, r.y1, r.x1) if swap else r)
    dx, dy = min(r.x0 for r in rects), min(r.y0 for r in rects)
    return tuple(
        RoomPlan(
            kind=room.kind,
            rect=Rect(
                round(r.x0 - dx, 2), round(r.y0 - dy, 2), round(r.x1 - dx, 2), round(r.y1 - dy, 2)
            ),
        )
        for room, r in zip(rooms, rects, strict=True)
    )

"""Doors, passages and windows between rooms and in outer walls."""

from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np

from ippon.simulation.homes.furniture.style import chance, uniform
from ippon.simulation.homes.layout.room_layout import RoomPlan

_LEAVES = ("bathroom", "laundry")
"""Room types that are never passed through."""

# Lower is better; pairs not listed are a last resort.
_COSTS: dict[frozenset[str], float] = {
    frozenset(("living_room", "kitchen")): 1.0,
    frozenset(("living_room", "dining_room")): 1.0,
    frozenset(("kitchen", "dining_room")): 1.2,
    frozenset(("studio", "bathroom")): 1.0,
    frozenset(("kitchen", "laundry")): 1.5,
    frozenset(("living_room", "study")): 2.0,
    frozenset(("living_room", "bedroom")): 2.2,
    frozenset(("living_room", "bathroom")): 3.0,
    frozenset(("bathroom", "laundry")): 9.0,
    frozenset(("bedroom", "bathroom")): 3.5,
    frozenset(("bedroom", "study")): 4.0,
    frozenset(("dining_room", "bedroom")): 4.0,
    frozenset(("dining_room", "bathroom")): 4.5,
    frozenset(("kitchen", "bathroom")): 5.5,
    frozenset(("kitchen", "bedroom")): 6.0,
    frozenset(("bedroom",)): 7.0,
}
_OPEN_PAIRS = (
    frozenset(("living_room", "kitchen")),
    frozenset(("living_room", "dining_room")),
    frozenset(("kitchen", "dining_room")),
    frozenset(("living_room", "hall")),
)
END_MARGIN_M: Final = 0.22
"""Least distance from an opening to the centre line of the wall at its end."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Opening:
    """An opening in a wall."""

    kind: str
    """door, passage, window or front_door."""
    rooms: tuple[int, ...]
    """The two rooms that it connects, or the one room of a window or front door."""
    along_x: bool
    """Whether the wall runs along x."""
    line: float
    """Centre line of the wall: y of a wall along x, else x."""
    low: float
    high: float
    """Bounds along the wall."""
    z0: float
    z1: float
    hinge_low: bool = True
    """Whether the hinge is at the `low` end."""
    leaf_room: int = -1
    """Room into which the leaf opens, -1 for a door without a leaf."""
    leaf_along_wall: bool = False
    """Whether the open leaf lies flat against its wall instead of perpendicular to it."""

    @property
    def width(self) -> float:
        """Clear width in metres."""
        return self.high - self.low


@dataclass(frozen=True, slots=True, kw_only=True)
class SharedWall:
    """A wall segment between two rooms, or between a room and outside (`second` -1)."""

    first: int
    second: int
    along_x: bool
    line: float
    low: float
    high: float


def shared_walls(rooms: tuple[RoomPlan, ...]) -> tuple[SharedWall, ...]:
    """Return each wall segment once; a segment ends where a room on either side ends."""
    found: list[SharedWall] = []
    for along_x in (True, False):
        edges = [_edges(r, along_x) for r in rooms]
        lines = sorted({line for pair in edges for line in pair[:2]})
        for line in lines:
            below = [(k, e[2], e[3]) for k, e in enumerate(edges) if e[1] == line]
            above = [(k, e[2], e[3]) for k, e in enumerate(edges) if e[0] == line]
            found += _stretches(below, above, along_x, line)
    return tuple(found)


def _edges(room: RoomPlan, along_x: bool) -> tuple[float, float, float, float]:
    """Return the room's lower and upper line, and its extent along them."""
    r = room.rect
    return (r.y0, r.y1, r.x0, r.x1) if along_x else (r.x0, r.x1, r.y0, r.y1)


def _stretches(
    below: list[tuple[int, float, float]],
    above: list[tuple[int, float, float]],
    along_x: bool,
    line: float,
) -> list[SharedWall]:
    cuts = sorted({c for _, a, b in below + above for c in (a, b)})
    out: list[SharedWall] = []
    for start, b in pairwise(cuts):
        a, middle = start, 0.5 * (start + b)
        first = next((k for k, lo, hi in below if lo < middle < hi), -1)
        second = next((k for k, lo, hi in above if lo < middle < hi), -1)
        if first < 0:
            first, second = second, first
        if first < 0:
            continue
        previous = out[-1] if out else None
        same = previous is not None and (previous.first, previous.second) == (first, second)
        if previous is not None and same and previous.high == a:
            a = previous.low
            out.pop()
        out.append(
            SharedWall(first=first, second=second, along_x=along_x, line=line, low=a, high=b)
        )
    return out


def join_rooms(
    rng: np.random.Generator, rooms: tuple[RoomPlan, ...], walls: tuple[SharedWall, ...]
) -> list[Opening] | None:
    """Choose doors and passages so that every room is reachable.

    Returns:
        The openings, or None if the rooms cannot be connected.
    """
    candidates = [
        (_cost(rooms, w) + uniform(rng, 0.0, 0.4), n, w)
        for n, w in enumerate(walls)
        if w.second >= 0 and w.high - w.low >= 0.9 + 2 * END_MARGIN_M
    ]
    group = list(range(len(rooms)))
    doors = [0] * len(rooms)
    chosen: list[Opening] = []
    for cost, _, wall in sorted(candidates, key=lambda c: (c[0], c[1])):
        a, b = wall.first, wall.second
        pair = frozenset((rooms[a].kind, rooms[b].kind))
        loops = group[a] == group[b]
        if loops and not (pair in _OPEN_PAIRS and chance(rng, 0.5)):
            continue
        if any(rooms[k].kind in _LEAVES and doors[k] for k in (a, b)) or cost > 50.0:
            continue
        group = [group[a] if g == group[b] else g for g in group]
        doors[a] += 1
        doors[b] += 1
        chosen.append(_opening(rng, rooms, wall, wide=pair in _OPEN_PAIRS and chance(rng, 0.6)))
    return chosen if len(set(group)) == 1 else None


def _cost(rooms: tuple[RoomPlan, ...], wall: SharedWall) -> float:
    kinds = frozenset((rooms[wall.first].kind, rooms[wall.second].kind))
    if "hall" in kinds:
        return 0.5
    return _COSTS.get(kinds, 8.0) if kinds - set(_LEAVES) else 99.0


def _opening(
    rng: np.random.Generator, rooms: tuple[RoomPlan, ...], wall: SharedWall, *, wide: bool
) -> Opening:
    length = wall.high - wall.low - 2 * END_MARGIN_M
    z1 = uniform(rng, 2.03, 2.12)
    if wide and length > 1.3:
        width = min(uniform(rng, 1.2, 2.6), length)
        low = wall.low + END_MARGIN_M + uniform(rng, 0.0, length - width)
        return opening_in(wall, "passage", low, low + width, (0.0, z1 + 0.15))
    width = min(uniform(rng, 0.88, 0.98), length)
    slack = length - width
    position = uniform(rng, 0.0, 1.0)
    if chance(rng, 0.75):
        position = 0.0 if position < 0.5 else 1.0
    low = wall.low + END_MARGIN_M + position * slack
    return opening_in(
        wall, "door", low, low + width, (0.0, z1), **leaf_position(rng, rooms, wall, low, width)
    )


def leaf_position(
    rng: np.random.Generator,
    rooms: tuple[RoomPlan, ...],
    wall: SharedWall,
    low: float,
    width: float,
) -> dict[str, object]:
    """Return the position of the open leaf: perpendicular to its wall in a corner, else flat."""
    if chance(rng, 0.2):
        return {}
    a, b = wall.first, wall.second
    into = a if _privacy(rooms[a].kind) > _privacy(rooms[b].kind) else b
    _, _, start, end = _edges(rooms[into], wall.along_x)
    before, after = low - start, end - (low + width)
    if min(before, after) < 0.45:
        return {"leaf_room": into, "hinge_low": before < after}
    if max(before, after) > width + 0.25:
        return {"leaf_room": into, "hinge_low": before > after, "leaf_along_wall": True}
    return {}


def _privacy(kind: str) -> int:
    order = ("hall", "living_room", "dining_room", "studio", "kitchen", "study", "bedroom")
    return order.index(kind) if kind in order else len(order)


def opening_in(
    wall: SharedWall, kind: str, low: float, high: float, z: tuple[float, float], **leaf: object
) -> Opening:
    """Return an opening in a wall; `z` is its lower and upper end."""
    rooms = (wall.first,) if wall.second < 0 else (wall.first, wall.second)
    return Opening(
        kind=kind, rooms=rooms, along_x=wall.along_x, line=wall.line,
        low=round(low, 3), high=round(high, 3), z0=z[0], z1=round(z[1], 3),
        **leaf,  # type: ignore[arg-type]
    )  # fmt: skip


def exterior_openings(
    rng: np.random.Generator, rooms: tuple[RoomPlan, ...], walls: tuple[SharedWall, ...]
) -> list[Opening]:
    """Choose the front door and the windows."""
    outside = [w for w in walls if w.second < 0]
    out: list[Opening] = []
    for kind in ("hall", "living_room", "studio", "dining_room", "kitchen", "bedroom"):
        fitting = [w for w in outside if rooms[w.first].kind == kind and w.high - w.low > 1.35]
        if fitting:
            wall = fitting[int(rng.integers(len(fitting)))]
            low = wall.low + 0.2 + uniform(rng, 0.0, wall.high - wall.low - 0.2 - 1.15)
            out.append(opening_in(wall, "front_door", low, low + 0.95, (0.0, 2.08)))
            break
    for wall in outside:
        out += _windows(rng, rooms[wall.first].kind, wall, out[0] if out else None)
    return out


def _windows(
    rng: np.random.Generator, kind: str, wall: SharedWall, door: Opening | None
) -> list[Opening]:
    length = wall.high - wall.low
    small = kind in ("bathroom", "laundry", "hall")
    if not chance(rng, 0.5 if small else 0.8) or length < (1.2 if small else 1.7):
        return []
    sill = uniform(rng, 1.25, 1.4) if small else uniform(rng, 0.82, 0.98)
    top = uniform(rng, 2.1, 2.25)
    if kind in ("living_room", "studio") and chance(rng, 0.25):
        sill = 0.12
    width = uniform(rng, 0.5, 0.8) if small else min(uniform(rng, 1.0, 2.2), length - 0.7)
    count = 2 if length > 2 * width + 1.6 and not small else 1
    out: list[Opening] = []
    for k in range(count):
        middle = wall.low + (k + 0.5) * length / count + uniform(rng, -0.15, 0.15)
        low, high = middle - width / 2, middle + width / 2
        same_wall = door is not None and (door.along_x, door.line) == (wall.along_x, wall.line)
        if door is not None and same_wall and low < door.high + 0.15 and high > door.low - 0.15:
            continue
        out.append(opening_in(wall, "window", low, high, (sill, top)))
    return out

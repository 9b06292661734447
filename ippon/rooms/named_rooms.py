"""Names that people give to rooms: each belongs to the room that contains a point of the map."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy import ndimage

from ippon.frame import FLOORS_APART_M
from ippon.rooms.room_inference import NO_ROOM, Rooms
from ippon.vocabulary import in_words

LEAST_M2: Final = 1.0
"""Floor area from which a part counts as a room."""
OUTSIDE_M: Final = 1.0
"""Distance from a room up to which a name belongs to it, because the map is inferred anew."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RoomName:
    """A name at a point of the map, metres in the world."""

    x_m: float
    y_m: float
    name: str
    floor_z_m: float | None = None
    """Height of the floor; None, as in files of earlier versions, for any floor."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RoomPlace:
    """A room: where its name is written, what it is and what it is called."""

    x_m: float
    y_m: float
    area_m2: float
    kind: str
    """Type in words; empty if unclear."""
    name: str
    """Name that a person has given; empty for none."""


def room_places(rooms: Rooms, names: Iterable[RoomName]) -> tuple[RoomPlace, ...]:
    """Return the rooms, the largest first.

    Args:
        rooms: The inferred rooms.
        names: Names by points; of several in one room the last one applies.
    """
    called = names_by_part(rooms, names)
    areas = np.bincount(rooms.part.reshape(-1), minlength=len(rooms.room)) * rooms.cell_m**2
    found: list[RoomPlace] = []
    for part in range(1, len(rooms.room)):
        if areas[part] < LEAST_M2 and part not in called:
            continue
        # The point that is farthest from all edges has most room for a name.
        inside = np.pad(rooms.part == part, 1)
        depth = np.asarray(ndimage.distance_transform_edt(inside))[1:-1, 1:-1]
        i, j = np.unravel_index(int(depth.argmax()), depth.shape)
        x, y = ((np.array([i, j]) + rooms.origin + 0.5) * rooms.cell_m).tolist()
        kind = int(rooms.room[part])
        found.append(
            RoomPlace(
                x_m=x,
                y_m=y,
                area_m2=float(areas[part]),
                kind="" if kind == NO_ROOM else in_words(rooms.types[kind]),
                name=called.get(part, ""),
            )
        )
    return tuple(sorted(found, key=lambda room: -room.area_m2))


def name_lookup(rooms: Rooms, names: Iterable[RoomName]) -> Callable[[tuple[float, float]], str]:
    """Return a function from a world position to the room's name, else its type, else empty."""
    called = names_by_part(rooms, names)

    def name_at(xy: tuple[float, float]) -> str:
        return called.get(_part_at(rooms, *xy), "") or rooms.name_at(xy)

    return name_at


def renamed(
    rooms: Rooms, names: Iterable[RoomName], x_m: float, y_m: float, name: str
) -> tuple[RoomName, ...]:
    """Return the names after the room at a point is given one; an empty name removes it.

    Raises:
        ValueError: No room is there.
    """
    part = _nearest_part(rooms, x_m, y_m)
    if part == 0:
        raise ValueError(f"there is no room at ({x_m:.1f}, {y_m:.1f})")
    kept = [one for one in names if _part_of(rooms, one) != part]
    added = RoomName(x_m=x_m, y_m=y_m, name=name, floor_z_m=rooms.floor_z_m)
    return (*kept, *([added] if name else []))


def names_by_part(rooms: Rooms, names: Iterable[RoomName]) -> dict[int, str]:
    """Return the names of rooms by number of the part; of several in one room the last applies."""
    called = {_part_of(rooms, one): one.name for one in names}
    called.pop(0, None)
    return called


def names_of_other_floors(rooms: Rooms, names: Iterable[RoomName]) -> tuple[str, ...]:
    """Return the names of rooms that are on another floor than the inferred ones."""
    return tuple(one.name for one in names if _is_of_other_floor(rooms, one))


def _is_of_other_floor(rooms: Rooms, one: RoomName) -> bool:
    return one.floor_z_m is not None and abs(one.floor_z_m - rooms.floor_z_m) > FLOORS_APART_M


def _part_of(rooms: Rooms, one: RoomName) -> int:
    """Return the part that a name belongs to; 0 for none, and for one of another floor."""
    if _is_of_other_floor(rooms, one):
        return 0
    return _nearest_part(rooms, one.x_m, one.y_m)


def _part_at(rooms: Rooms, x_m: float, y_m: float) -> int:
    return max(0, int(rooms.parts_at(np.array([[x_m, y_m]]))[0]))


def _nearest_part(rooms: Rooms, x_m: float, y_m: float) -> int:
    """Return the part at a point, else the nearest one within `OUTSIDE_M`, else 0."""
    part = _part_at(rooms, x_m, y_m)
    if part != 0 or not rooms.part.any():
        return part
    cells = np.argwhere(rooms.part > 0)
    centers = (cells + rooms.origin + 0.5) * rooms.cell_m
    distance = np.linalg.norm(centers - [x_m, y_m], axis=1)
    nearest = int(distance.argmin())
    return int(rooms.part[tuple(cells[nearest])]) if distance[nearest] <= OUTSIDE_M else 0

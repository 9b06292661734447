"""Furnishing of the rooms of offices, schools, wards and shopping centres."""

import math
from collections.abc import Callable, Iterator

import numpy as np

from ippon.simulation.homes.furniture import bathroom as bathing
from ippon.simulation.homes.furniture import beds as sleeping
from ippon.simulation.homes.furniture import decor, kitchen, leisure, seating, storage, tables
from ippon.simulation.homes.furniture.model import Model
from ippon.simulation.homes.furniture.style import uniform
from ippon.simulation.homes.rooms import living_areas as living
from ippon.simulation.homes.rooms.furnisher import Furnisher
from ippon.simulation.homes.rooms.placement import Placed

_WAY_M = 0.8
"""Width of the ways along the walls and between the ends of rows."""


def furnish_public_room(f: Furnisher) -> bool:
    """Furnish a room by its kind; False if it is a kind of homes."""
    furnish: dict[str, Callable[[Furnisher], None]] = {
        "office": _office,
        "open_plan_office": _open_plan_office,
        "meeting_room": _meeting_room,
        "foyer": _foyer,
        "washroom": _washroom,
        "store_room": _store_room,
        "classroom": _classroom,
        "patient_room": _patient_room,
        "ward_bay": _ward_bay,
        "nurses_station": _nurses_station,
        "shop": _shop,
        "large_shop": _shop,
        "canteen": _canteen,
    }
    if f.space.kind not in furnish:
        return False
    furnish[f.space.kind](f)
    return True


def furnish_corridor(f: Furnisher) -> None:
    """Place benches, plants and pictures along a corridor."""
    floor = f.space.floor
    width, length = sorted((floor.width, floor.depth))
    for _ in range(int(length / 9.0)):
        piece = seating.bench if f.chance(0.6) else storage.low_shelf
        model = piece(f.rng, f.style)
        if model.depth_m + 1.3 <= width:
            f.at_wall(model, clearance=1.2)
    f.finish(pictures=f.some(2, 6), plants=f.some(1, 2) if width > 2.0 else 0)


def _office(f: Furnisher) -> None:
    for _ in range(1 if f.space.floor.area < 15.0 else 2):
        living.desk_with_chair(f)
    f.at_wall(storage.bookshelf(f.rng, f.style, uniform(f.rng, 0.8, 1.4)), clearance=0.5)
    if f.chance(0.4):
        f.at_wall(storage.wardrobe(f.rng, f.style, 1.0), clearance=0.6)
    if f.chance(0.4):
        f.in_corner(seating.chair(f.rng, f.style))
    f.finish(pictures=f.some(0, 1), plants=f.some(0, 1))


def _open_plan_office(f: Furnisher) -> None:
    """Place islands of desks, two rows back to back, and cupboards along the walls."""
    f.at_wall(storage.bookshelf(f.rng, f.style, 1.6), clearance=0.6)
    width, depth, count = uniform(f.rng, 1.3, 1.5), uniform(f.rng, 0.7, 0.8), f.some(2, 3)
    block = count * width, 2.0 * (depth + 0.65)
    for x, y, yaw in _grid(f, block, (_WAY_M, 0.6)):
        for k in range(2 * count):
            along = (k // 2 - 0.5 * (count - 1)) * width
            turn = yaw + (math.pi if k % 2 else 0.0)
            desk = f.at(
                tables.work_table(f.rng, f.style, width - 0.01, depth - 0.01),
                x + along * math.cos(yaw),
                y + along * math.sin(yaw),
                turn,
            )
            if desk is not None and f.chance(0.9):
                f.chair_before(desk, seating.office_chair(f.rng, f.style))
    for _ in range(f.some(2, 4)):
        f.at_wall(storage.low_shelf(f.rng, f.style), clearance=0.6)
    f.finish(pictures=f.some(0, 2), plants=f.some(1, 3))


def _meeting_room(f: Furnisher) -> None:
    shorter = min(f.space.floor.width, f.space.floor.depth)
    f.place_to_eat(uniform(f.rng, 1.8, 2.4), min(1.2, shorter - 2.4))
    if f.chance(0.5):
        f.hang(decor.television(f.rng, uniform(f.rng, 1.0, 1.5), on_stand=False), 1.0)
    if f.chance(0.5):
        f.at_wall(storage.low_shelf(f.rng, f.style), clearance=0.5)
    f.finish(pictures=f.some(0, 2), plants=f.some(0, 1))


def _foyer(f: Furnisher) -> None:
    _desk_of_staff(f)
    for _ in range(2):
        f.at_wall(seating.sofa(f.rng, f.style, uniform(f.rng, 1.5, 1.9)), clearance=0.8)
    f.at_wall(seating.bench(f.rng, f.style), clearance=0.8)
    f.finish(pictures=f.some(1, 3), plants=f.some(1, 3))


def _washroom(f: Furnisher) -> None:
    """Place a row of toilets at one wall and washbasins at another."""
    toilets = _row_at_wall(f, lambda: bathing.toilet(f.rng), pitch=1.0, count=f.some(2, 4))
    sides = [s for s in f.sides() if not toilets or s != toilets[0].side]
    basins = f.some(1, 3)
    _row_at_wall(f, lambda: bathing.washbasin(f.rng, f.style), pitch=1.0, count=basins, sides=sides)
    f.finish(pictures=0, plants=0)


def _store_room(f: Furnisher) -> None:
    for _ in range(f.some(2, 4)):
        f.at_wall(storage.bookshelf(f.rng, f.style, uniform(f.rng, 0.9, 1.8)), clearance=0.7)
    for _ in range(f.some(1, 3)):
        f.in_corner(leisure.cardboard_box(f.rng))
    f.finish(pictures=0, plants=0)


def _classroom(f: Furnisher) -> None:
    """Place rows of tables for two that face the teacher's desk at one end of the room."""
    rng, floor = f.rng, f.space.floor
    end = (3, 1) if floor.width > floor.depth else (0, 2)
    front = end[f.some(0, 1)]
    _desk_of_staff(f, [front])
    if f.chance(0.3):
        f.hang(decor.television(rng, uniform(rng, 1.2, 1.5), on_stand=False), 1.2, sides=[front])
    state = int(rng.integers(0, 2**31))
    table_depth = 0.55
    # Seats of a row are on the side away from the front.
    for x, y, yaw in _grid(
        f, (1.3, table_depth + 0.55), (0.8, 0.4), facing=front, keep=2.3, centre=False
    ):
        table = f.at(tables.work_table(rng, f.style, 1.3, table_depth), x, y, yaw)
        for along in (-0.33, 0.33):
            if table is not None and f.chance(0.95):
                f.chair_before(table, seating.chair(np.random.default_rng(state), f.style), along)
    back = [side for side in f.sides() if side != front]
    for _ in range(f.some(1, 3)):
        if f.chance(0.5):
            piece = storage.low_shelf(rng, f.style)
        else:
            piece = storage.bookshelf(rng, f.style, uniform(rng, 0.9, 1.6))
        f.at_wall(piece, clearance=0.5, sides=back)
    f.finish(pictures=f.some(1, 4), plants=f.some(0, 1))


def _patient_room(f: Furnisher) -> None:
    beds = _row_at_wall(
        f, lambda: sleeping.bed(f.rng, f.style, 0.9), pitch=1.9, count=f.some(1, 2), optional=False
    )
    _beside_beds(f, beds)
    f.at_wall(storage.wardrobe(f.rng, f.style, 1.0), clearance=0.6)
    if f.chance(0.5):
        f.hang(decor.television(f.rng, uniform(f.rng, 0.7, 0.9), on_stand=False), 1.5)
    if f.chance(0.6):
        f.at_wall(bathing.washbasin(f.rng, f.style), clearance=0.5)
    if f.chance(0.3):
        f.in_corner(seating.armchair(f.rng, f.style))
    f.finish(pictures=f.some(0, 1), plants=0)


def _ward_bay(f: Furnisher) -> None:
    """Place beds with their heads at two opposite walls."""
    floor = f.space.floor
    for side in (1, 3) if floor.width > floor.depth else (0, 2):
        beds = _row_at_wall(
            f,
            lambda: sleeping.bed(f.rng, f.style, 0.9),
            pitch=1.85,
            count=3,
            sides=[side],
            optional=False,
        )
        _beside_beds(f, beds)
    f.at_wall(bathing.washbasin(f.rng, f.style), clearance=0.5)
    if f.chance(0.4):
        f.hang(decor.television(f.rng, uniform(f.rng, 0.8, 1.0), on_stand=False), 1.5)
    f.finish(pictures=f.some(0, 1), plants=0)


def _beside_beds(f: Furnisher, beds: list[Placed]) -> None:
    for bed in beds:
        f.pillows(bed, 0.9)
        f.beside(bed, sleeping.nightstand(f.rng, f.style), left=True, gap=0.04)
        if f.chance(0.4):
            f.beside(bed, seating.chair(f.rng, f.style), left=False, gap=0.05)


def _nurses_station(f: Furnisher) -> None:
    for _ in range(2):
        _desk_of_staff(f)
    f.at_wall(storage.bookshelf(f.rng, f.style, 1.2), clearance=0.5)
    f.at_wall(storage.chest_of_drawers(f.rng, f.style), clearance=0.5)
    f.finish(pictures=f.some(0, 1), plants=f.some(0, 1))


def _shop(f: Furnisher) -> None:
    """Place racks in rows, shelves along the walls, and a desk to pay at."""
    _desk_of_staff(f)
    length = uniform(f.rng, 2.0, 2.6) if f.space.floor.area < 60.0 else uniform(f.rng, 3.0, 4.2)
    for x, y, yaw in _grid(f, (length, 0.8), (1.4, 1.4)):
        dx, dy = 0.4 * math.sin(yaw), -0.4 * math.cos(yaw)
        f.at(storage.shop_rack(f.rng, f.style, length), x + dx, y + dy, yaw)
    for _ in range(int(f.space.floor.area / 15.0)):
        width = uniform(f.rng, 1.0, 1.8)
        f.at_wall(storage.bookshelf(f.rng, f.style, width), clearance=0.9)
    f.finish(pictures=f.some(0, 2), plants=f.some(0, 1))


def _canteen(f: Furnisher) -> None:
    """Place tables with chairs in rows, and a counter along a wall."""
    longest = f.sides(longest_first=True)
    _row_at_wall(f, lambda: kitchen.counter(f.rng, f.style, 1.6), pitch=1.62, count=3)
    f.at_wall(kitchen.fridge(f.rng), clearance=0.8, sides=longest)
    width = uniform(f.rng, 1.3, 1.7)
    for x, y, yaw in _grid(f, (width + 0.9, 1.7), (0.8, 0.7)):
        dx, dy = 0.4 * math.sin(yaw), -0.4 * math.cos(yaw)
        table = f.at(tables.dining_table(f.rng, f.style, width, 0.8), x + dx, y + dy, yaw)
        if table is not None:
            f.chairs_round(table, width, 0.8)
    if f.chance(0.5):
        f.hang(decor.television(f.rng, 1.4, on_stand=False), 1.6)
    f.finish(pictures=f.some(1, 3), plants=f.some(1, 3))


def _desk_of_staff(f: Furnisher, sides: list[int] | None = None) -> None:
    """Place a desk near a wall, with the chair between the two."""
    model = tables.work_table(f.rng, f.style, uniform(f.rng, 1.4, 1.9), 0.7)
    for side in f.sides() if sides is None else sides:
        fits = f.space.positions(side, model.width_m, 1.8, 0.8, 0.8, 0.0)
        if not fits:
            continue
        u = fits[int(f.rng.integers(len(fits)))]
        x, y, yaw = f.space.pose_at_wall(side, u, 1.1 + model.depth_m)
        desk = f.at(model, x, y, yaw + math.pi)
        if desk is not None:
            f.chair_before(desk, seating.office_chair(f.rng, f.style))
        return


def _row_at_wall(
    f: Furnisher,
    make: Callable[[], Model],
    *,
    pitch: float,
    count: int,
    sides: list[int] | None = None,
    optional: bool = True,
) -> list[Placed]:
    """Place several of a kind along the first wall that has room for one."""
    for side in f.sides() if sides is None else sides:
        row: list[Placed] = []
        for _ in range(count):
            model = make()
            fits = f.space.positions(side, model.width_m, model.depth_m, model.height_m, 0.6, 0.015)
            axis = 0 if side in (0, 2) else 1
            taken = [(p.x, p.y)[axis] for p in row]
            near = [u for u in fits if all(abs(u - t) >= pitch - 0.01 for t in taken)]
            if not near:
                break
            placed = f.space.stand_at_wall(
                model, side, near[0], clearance=0.6, gap=0.015, optional=optional
            )
            f.placed.append(placed)
            row.append(placed)
        if row:
            return row
    return []


def _grid(
    f: Furnisher,
    size: tuple[float, float],
    ways: tuple[float, float],
    *,
    facing: int | None = None,
    keep: float = _WAY_M,
    centre: bool = True,
) -> Iterator[tuple[float, float, float]]:
    """Yield the poses of equal blocks in rows and columns where the floor is free.

    Args:
        f: Furnisher of the room.
        size: Extent of a block along its rows and across, metres.
        ways: Width of the ways between blocks along the rows and across.
        facing: Wall that the rows face; None for rows along the longer side of the room.
        keep: Distance of the first row from that wall.
        centre: Whether a pose is that of the block's centre, not of the middle of its edge
            towards the wall that the rows face.
    """
    floor = f.space.floor
    if facing is None:
        facing = 0 if floor.width > floor.depth else 3
    low, high = f.space.wall_length(facing)
    deep = floor.depth if facing in (0, 2) else floor.width
    columns = _stops(high - low - 2.0 * _WAY_M, size[0], ways[0])
    rows = _stops(deep - keep - _WAY_M, size[1], ways[1])
    for across in rows:
        for along in columns:
            u, v = low + _WAY_M + along, keep + across
            block = f.space.rect_at_wall(facing, u, size[0], size[1], v - 0.5 * size[1])
            if f.space.is_free(block):
                yield f.space.pose_at_wall(facing, u, v if centre else v - 0.5 * size[1])


def _stops(length: float, size: float, way: float) -> list[float]:
    """Return the middles of as many blocks as fit into a length, the rest spread between them."""
    count = int((length + way) / (size + way))
    spare = (length - count * size) / max(count, 1)
    return [(k + 0.5) * (size + spare) for k in range(count)]

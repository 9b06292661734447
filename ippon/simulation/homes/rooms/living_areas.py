"""Furnishing of living rooms, dining rooms and studies."""

import math

from ippon.simulation.homes.furniture import beds as sleeping
from ippon.simulation.homes.furniture import decor, leisure, seating, storage, tables
from ippon.simulation.homes.furniture.model import Model
from ippon.simulation.homes.furniture.style import uniform
from ippon.simulation.homes.rooms.furnisher import Furnisher
from ippon.simulation.homes.rooms.placement import Placed, footprint


def furnish_living_room(f: Furnisher, *, dining: bool) -> None:
    """Place a television with a sofa in front of it, then the other furniture.

    Args:
        f: Furnisher of the room.
        dining: Whether it also needs a dining table, without a dining room in the home.
    """
    television_group(f)
    if dining:
        f.place_to_eat(f.one_of(1.0, 1.4, 1.6), f.one_of(0.8, 0.9, 1.0))
    area = f.space.floor.area
    if f.chance(0.12):
        f.at_wall(decor.fireplace(f.rng), clearance=0.7, where="middle")
    if f.chance(0.75):
        f.at_wall(storage.bookshelf(f.rng, f.style, uniform(f.rng, 0.8, 1.6)), clearance=0.5)
    if f.chance(0.4):
        f.at_wall(storage.chest_of_drawers(f.rng, f.style), clearance=0.5)
    if area > 22.0 and f.chance(0.25):
        f.at_wall(leisure.piano(f.rng), clearance=0.8)
    if area > 26.0 and f.chance(0.6):
        f.at_wall(storage.low_shelf(f.rng, f.style), clearance=0.5)
        f.in_corner(seating.armchair(f.rng, f.style))
    if f.chance(0.65):
        f.in_corner(decor.floor_lamp(f.rng, f.style))
    if f.chance(0.2):
        f.in_corner(seating.pouf(f.rng, f.style))
    f.finish(pictures=f.some(1, 3), plants=f.some(1, 2))


def television_group(f: Furnisher) -> Placed | None:
    """Place television and sofa facing each other; return the sofa."""
    diagonal = uniform(f.rng, 0.9, 1.5)
    width = 0.872 * diagonal + uniform(f.rng, 0.15, 0.5)
    for side in f.sides(longest_first=f.chance(0.5)):
        stand = f.at_wall(
            storage.tv_stand(f.rng, f.style, width),
            clearance=1.3,
            sides=[side],
            where="middle",
            height_m=1.7,
            optional=False,
        )
        if stand is None:
            continue
        mark = len(f.placed)
        hung = f.chance(0.35)
        model = decor.television(f.rng, diagonal, on_stand=not hung)
        f.on(stand, model, z=None if not hung else uniform(f.rng, 0.85, 1.05))
        couch = _sofa_before(f, stand)
        if couch is not None:
            _round_the_sofa(f, couch)
            return couch
        del f.placed[mark - 1 :]
        f.space.solids.pop()
        f.space.clear.pop()
        f.space.spans.pop()
    return None


def _sofa_before(f: Furnisher, stand: Placed) -> Placed | None:
    """Place a sofa opposite a television, at the far wall or free-standing in a deep room."""
    room = f.space.floor
    depth = room.depth if stand.side in (0, 2) else room.width
    for width in (uniform(f.rng, 1.9, 2.4), 1.75, 1.5):
        corner = f.chance(0.25) and width > 1.8 and depth > 3.6
        make = seating.corner_sofa if corner else seating.sofa
        model = make(f.rng, f.style, width)
        to_wall = depth - stand.model.depth_m - model.depth_m
        if to_wall < 1.2:
            continue
        distance = to_wall if to_wall < 3.4 else uniform(f.rng, 2.1, 2.9)
        if to_wall - distance < 0.75:
            distance = to_wall
        for shift in (0.0, 0.25, -0.25, 0.5, -0.5, 0.8, -0.8):
            placed = _try_sofa(f, stand, model, distance, shift, against_wall=distance == to_wall)
            if placed is not None:
                return placed
    return None


def _try_sofa(
    f: Furnisher, stand: Placed, model: Model, distance: float, shift: float, *, against_wall: bool
) -> Placed | None:
    reach = stand.model.depth_m + distance + model.depth_m - (0.02 if against_wall else 0.0)
    x, y = stand.to_world(shift, reach)
    yaw = stand.yaw + math.pi
    rect = footprint(model, x, y, yaw)
    if not f.space.is_free(rect):
        return None
    side = (stand.side + 2) % 4
    if against_wall:
        u = x if side in (0, 2) else y
        half = model.width_m / 2
        if not f.space.wall_is_free(side, u - half, u + half, 0.0, 0.75):
            return None
    f.space.take(rect)
    placed = Placed(
        model=model, x=x, y=y, z=0.0, yaw=yaw, rect=rect, room=f.space.room,
        side=side if against_wall else -1, optional=False,
    )  # fmt: skip
    f.placed.append(placed)
    return placed


def _round_the_sofa(f: Furnisher, couch: Placed) -> None:
    """Add coffee table, carpet, armchair, side table, lamp and cushions."""
    rng, model = f.rng, couch.model
    front = model.surfaces[0].y1 + 0.04
    ahead = front + uniform(rng, 0.38, 0.5)
    if f.chance(0.6):
        x, y = couch.to_world(0.0, front + 0.6)
        f.rug_at(x, y, uniform(rng, 1.6, 2.4), uniform(rng, 1.2, 1.7), couch.yaw)
    if f.chance(0.85):
        table = tables.coffee_table(rng, f.style)
        x, y = couch.to_world(0.0, ahead)
        f.at(table, x, y, couch.yaw)
    if f.chance(0.6):
        chair = seating.armchair(rng, f.style)
        for sign in (1.0, -1.0) if f.chance(0.5) else (-1.0, 1.0):
            away = model.width_m / 2 + uniform(rng, 0.35, 0.6) + chair.depth_m
            x, y = couch.to_world(sign * away, front + 0.55)
            if f.at(chair, x, y, couch.yaw + sign * 0.5 * math.pi, ignore_clear=False):
                break
    _beside_free(f, couch)
    f.cushions(couch, f.some(1, 3))
    if couch.side >= 0:
        f.hang(decor.picture(rng), 1.35, over=couch)


def _beside_free(f: Furnisher, couch: Placed) -> None:
    """Place a side table or a floor lamp at one end of a sofa."""
    rng = f.rng
    for sign in (1.0, -1.0):
        if not f.chance(0.55):
            continue
        model = tables.side_table(rng, f.style) if f.chance(0.6) else decor.floor_lamp(rng, f.style)
        x, y = couch.to_world(sign * (couch.model.width_m / 2 + 0.32), 0.05)
        placed = f.at(model, x, y, couch.yaw, ignore_clear=False)
        if placed is not None and model.label == "side table" and f.chance(0.6):
            f.on(placed, decor.table_lamp(rng))


def furnish_dining_room(f: Furnisher) -> None:
    """Place a table with chairs in the middle and a sideboard at the wall."""
    area = f.space.floor.area
    width = uniform(f.rng, 1.4, 1.8) if area < 14.0 else uniform(f.rng, 1.7, 2.2)
    if f.chance(0.25):
        width = 1.15
    depth = 1.15 if width == 1.15 else uniform(f.rng, 0.85, 1.0)
    if f.dining_group(width, depth, optional=False) is None:
        f.place_to_eat(1.2, 0.8)
    if f.chance(0.8):
        f.at_wall(storage.chest_of_drawers(f.rng, f.style), clearance=0.4)
    if f.chance(0.3):
        f.at_wall(storage.bookshelf(f.rng, f.style, 0.9), clearance=0.4)
    f.finish(pictures=f.some(1, 2), plants=f.some(0, 1))


def furnish_study(f: Furnisher) -> None:
    """Place a desk with a chair, shelves, and sometimes exercise equipment."""
    desk_with_chair(f)
    f.at_wall(storage.bookshelf(f.rng, f.style, uniform(f.rng, 0.8, 1.8)), clearance=0.5)
    if f.chance(0.5):
        f.at_wall(storage.low_shelf(f.rng, f.style), clearance=0.5)
    if f.chance(0.35):
        f.in_corner(seating.armchair(f.rng, f.style))
    if f.chance(0.2):
        f.at_wall(sleeping.bed(f.rng, f.style, 0.9), clearance=0.5, where="corner")
    if f.chance(0.35):
        exercise(f)
    if f.chance(0.4):
        f.hang(storage.wall_shelf(f.rng, f.style), 1.5)
    f.finish(pictures=f.some(0, 2), plants=f.some(0, 1))


def desk_with_chair(f: Furnisher) -> Placed | None:
    """Place a desk at a wall, with a chair."""
    desk = f.at_wall(tables.desk(f.rng, f.style), clearance=0.75, where="corner")
    if desk is None:
        return None
    chair = (seating.office_chair if f.chance(0.7) else seating.chair)(f.rng, f.style)
    f.chair_before(desk, chair)
    if f.chance(0.6):
        f.on(desk, decor.table_lamp(f.rng), along=0.36 * desk.model.width_m)
    return desk


def exercise(f: Furnisher) -> None:
    """Place one or two pieces of exercise equipment."""
    makers = (
        leisure.exercise_bike,
        leisure.treadmill,
        leisure.dumbbells,
        leisure.yoga_ball,
    )
    for k in f.rng.permutation(len(makers)).tolist()[: f.some(1, 2)]:
        f.at_wall(makers[k](f.rng), clearance=0.3, where="corner", gap=0.05)

"""Furnishing of bedrooms, bathrooms, halls and laundries."""

from ippon.simulation.homes.furniture import bathroom as bathing
from ippon.simulation.homes.furniture import beds as sleeping
from ippon.simulation.homes.furniture import decor, kitchen, leisure, seating, storage, tables
from ippon.simulation.homes.furniture.style import uniform
from ippon.simulation.homes.rooms import living_areas as living
from ippon.simulation.homes.rooms.furnisher import Furnisher
from ippon.simulation.homes.rooms.placement import Placed


def furnish_bedroom(f: Furnisher, *, main: bool) -> None:
    """Place a bed with its head at a wall, then the other furniture.

    Args:
        f: Furnisher of the room.
        main: Whether it is the main bedroom, with a wide bed.
    """
    area = f.space.floor.area
    if main:
        widths = (1.8, 1.6, 1.4) if area > 11.0 else (1.4, 1.2)
    else:
        widths = (1.4, 1.2, 0.9) if f.chance(0.4) else (0.9,)
    bed = place_bed(f, widths, bunk=not main and f.chance(0.25))
    if bed is not None and bed.model.width_m > 1.2 and f.chance(0.25):
        x, y = bed.to_world(0.0, bed.model.depth_m + 0.05)
        f.at(seating.bench(f.rng, f.style), x, y, bed.yaw, ignore_clear=False)
    f.at_wall(
        storage.wardrobe(f.rng, f.style, uniform(f.rng, 1.0, 2.0)), clearance=0.6, where="corner"
    )
    if f.chance(0.6):
        drawers = f.at_wall(storage.chest_of_drawers(f.rng, f.style), clearance=0.55)
        if drawers is not None and f.chance(0.35):
            f.on(drawers, decor.television(f.rng, uniform(f.rng, 0.6, 0.8), on_stand=True))
    if (not main and f.chance(0.75)) or f.chance(0.25):
        living.desk_with_chair(f)
    if not main and f.chance(0.6):
        f.at_wall(storage.low_shelf(f.rng, f.style), clearance=0.4)
    if main and area > 15.0 and f.chance(0.25):
        f.in_corner(sleeping.crib(f.rng, f.style))
    if f.chance(0.3):
        f.in_corner(seating.armchair(f.rng, f.style))
    if f.chance(0.35):
        f.hang(decor.wall_mirror(f.rng, f.style), 0.1)
    if f.chance(0.25):
        f.in_corner(bathing.laundry_basket(f.rng))
    if area > 14.0 and f.chance(0.12):
        living.exercise(f)
    f.finish(pictures=f.some(0, 2), plants=f.some(0, 1))


def place_bed(f: Furnisher, widths: tuple[float, ...], *, bunk: bool = False) -> Placed | None:
    """Place the widest bed that fits, with bedside tables and a carpet."""
    rng, style = f.rng, f.style
    if bunk:
        placed = f.at_wall(
            sleeping.bunk_bed(rng, style), clearance=0.5, where="corner", optional=False
        )
        if placed is not None:
            return placed
    for width in widths:
        where = "middle" if width > 1.1 else "corner"
        model = sleeping.bed(rng, style, width)
        bed = f.at_wall(model, clearance=0.55, where=where, optional=False)
        if bed is None:
            continue
        f.pillows(bed, width)
        for left in (True, False):
            stand = f.beside(bed, sleeping.nightstand(rng, style), left=left, gap=0.04)
            if stand is not None and f.chance(0.75):
                f.on(stand, decor.table_lamp(rng))
        if f.chance(0.4) and width > 1.1:
            x, y = bed.to_world(0.0, 1.5)
            f.rug_at(x, y, width + 1.1, 1.4, bed.yaw)
        if f.chance(0.5):
            f.hang(decor.picture(rng), 1.4, over=bed)
        return bed
    return None


def furnish_bathroom(f: Furnisher, *, laundry: bool) -> None:
    """Place toilet, basin, bath or shower, and towels.

    Args:
        f: Furnisher of the room.
        laundry: Whether it also needs a washing machine, without a laundry in the home.
    """
    rng = f.rng
    area = f.space.floor.area
    wet: list[Placed | None] = []
    if area > 4.2 and f.chance(0.6):
        wet.append(f.at_wall(bathing.bathtub(rng), clearance=0.5, where="corner"))
    if not wet or wet[0] is None or area > 8.0:
        model = bathing.shower(rng, glass_left=f.chance(0.5))
        wet.append(f.at_wall(model, clearance=0.5, where="corner"))
    toilet = f.at_wall(bathing.toilet(rng), clearance=0.5, optional=False)
    basin = f.at_wall(bathing.washbasin(rng, f.style), clearance=0.5, where="any")
    if basin is not None:
        f.hang(bathing.bathroom_mirror(rng, f.style), 1.05, over=basin)
        if f.chance(0.5):
            x, y = basin.to_world(0.0, basin.model.depth_m + 0.06)
            mat = bathing.bath_mat(rng)
            if f.free_floor(basin.rect) is False:
                f.at(mat, x, y, basin.yaw, solid=False)
    if toilet is not None and f.chance(0.15):
        f.hang(decor.picture(rng), 1.4, over=toilet)
    if laundry and f.chance(0.7):
        f.at_wall(kitchen.washing_machine(rng), clearance=0.55)
    for _ in range(f.some(1, 2)):
        f.hang(bathing.towel_rail(rng), uniform(rng, 0.75, 0.95))
    if f.chance(0.4):
        f.in_corner(bathing.laundry_basket(rng))
    if area > 6.0 and f.chance(0.35):
        f.at_wall(storage.low_shelf(rng, f.style), clearance=0.4)
    if area > 6.5 and f.chance(0.3):
        f.in_corner(decor.plant(rng, height=uniform(rng, 0.6, 1.1)))
    f.finish(pictures=0, plants=0)


def wet_corner(f: Furnisher) -> None:
    """Place toilet, shower and basin at one wall, for a home without a bathroom."""
    shower = f.at_wall(bathing.shower(f.rng, glass_left=False), clearance=0.5, where="corner")
    toilet = bathing.toilet(f.rng)
    placed = None
    if shower is not None:
        placed = f.beside(shower, toilet, left=f.chance(0.5), gap=0.15)
    placed = placed or f.at_wall(toilet, clearance=0.5, where="corner", optional=False)
    basin = bathing.washbasin(f.rng, f.style)
    if placed is None or not (
        f.beside(placed, basin, left=True, gap=0.2) or f.beside(placed, basin, left=False, gap=0.2)
    ):
        f.at_wall(basin, clearance=0.5)


def furnish_hall(f: Furnisher) -> None:
    """Place coats, shoes and a narrow table while the passage stays free."""
    rng, style, floor = f.rng, f.style, f.space.floor
    width = min(floor.width, floor.depth)
    way = 0.95
    pieces = [
        storage.shoe_rack(rng, style),
        tables.console_table(rng, style),
        seating.bench(rng, style),
        leisure.coat_stand(rng, style),
        storage.low_shelf(rng, style),
    ]
    for k in rng.permutation(len(pieces)).tolist()[: f.some(1, 3)]:
        if pieces[k].depth_m + way <= width:
            f.at_wall(pieces[k], clearance=way - 0.02)
    if f.chance(0.7) and width > 1.25:
        f.hang(leisure.hanging_clothes(rng, style), 0.0)
    if f.chance(0.5):
        f.hang(decor.wall_mirror(rng, style), 0.15)
    if f.chance(0.5):
        x, y = floor.center
        along = floor.width > floor.depth
        length = min(uniform(rng, 1.4, 2.6), max(floor.width, floor.depth) - 0.4)
        size = (length, 0.7) if along else (0.7, length)
        f.rug_at(x, y, *size, 0.0)
    f.finish(pictures=f.some(0, 3), plants=f.some(0, 1) if width > 1.7 else 0)


def furnish_laundry(f: Furnisher) -> None:
    """Place washing machines, a drying rack, shelves and boxes."""
    rng = f.rng
    washer = f.at_wall(kitchen.washing_machine(rng), clearance=0.6)
    if washer is not None and f.chance(0.7):
        f.beside(washer, kitchen.washing_machine(rng, dryer=True), left=f.chance(0.5), gap=0.03)
    if f.chance(0.5):
        f.at_wall(storage.low_shelf(rng, f.style), clearance=0.5)
    if f.chance(0.6):
        f.at_wall(leisure.drying_rack(rng, f.style), clearance=0.4)
    if f.chance(0.4):
        f.at_wall(leisure.ironing_board(rng), clearance=0.3)
    for _ in range(f.some(0, 2)):
        f.in_corner(leisure.cardboard_box(rng))
    if f.chance(0.7):
        f.in_corner(bathing.laundry_basket(rng))
    f.finish(pictures=0, plants=0)

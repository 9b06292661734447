"""Furnishing of kitchens: rows of cabinets and appliances along the walls."""

from ippon.simulation.homes.furniture import decor, kitchen, seating
from ippon.simulation.homes.furniture.model import Model
from ippon.simulation.homes.furniture.style import uniform
from ippon.simulation.homes.rooms.furnisher import Furnisher
from ippon.simulation.homes.rooms.placement import Placed, WallSpan

_DEPTH = 0.65
_WAY = 0.85


def furnish_kitchen(f: Furnisher, *, dining: bool) -> None:
    """Fill one or two walls with counters and appliances; add a table where there is room.

    Args:
        f: Furnisher of the room.
        dining: Whether a table with chairs belongs here.
    """
    kitchen_run(f, second=f.chance(0.7))
    area = f.space.floor.area
    if area > 15.0 and f.chance(0.4):
        _island(f)
    elif dining or f.chance(0.4):
        f.place_to_eat(f.one_of(0.9, 1.2, 1.4), f.one_of(0.8, 0.9))
    if f.chance(0.3):
        f.in_corner(seating.stool(f.rng, f.style))
    f.finish(pictures=f.some(0, 2), plants=f.some(0, 1))


def kitchen_run(f: Furnisher, *, second: bool) -> None:
    """Place counters with sink, stove and refrigerator along the longest free wall."""
    runs = _free_runs(f)
    if not runs:
        return
    side, low, high = runs[0]
    length = min(high - low, uniform(f.rng, 3.0, 4.2))
    at_low = f.chance(0.5)
    start = low if at_low else high - length
    if not _fill(f, side, start, start + length, first=True):
        # A window blocks its place in the row; place it elsewhere.
        f.at_wall(kitchen.fridge(f.rng), clearance=0.7, where="corner")
    if not second:
        return
    for other, lo, hi in _free_runs(f):
        if other != side and hi - lo > 0.8:
            length = min(hi - lo, uniform(f.rng, 1.2, 2.4))
            low, high = f.space.wall_length(other)
            start = lo if lo - low < high - hi else hi - length
            _fill(f, other, start, start + length, first=False)
            return


def _free_runs(f: Furnisher) -> list[tuple[int, float, float]]:
    """Return wall segments where counters fit, the longest first."""
    found: list[tuple[int, float, float]] = []
    for side in range(4):
        width = 0.3
        fits = f.space.positions(side, width, _DEPTH, 0.85, _WAY, 0.0)
        start = previous = None
        for u in [*fits, float("inf")]:
            if previous is None or start is None:
                start = u
            elif u - previous > 0.16:
                found.append((side, start - width / 2, previous + width / 2))
                start = u
            previous = u
    return sorted(found, key=lambda r: -(r[2] - r[1]))


def _fill(f: Furnisher, side: int, low: float, high: float, *, first: bool) -> bool:
    """Fill a segment: the refrigerator at one end, then counters with sink and stove.

    Returns:
        Whether the refrigerator was placed.
    """
    rng, style, space = f.rng, f.style, f.space
    low, high, cooled = low + 0.01, high - 0.01, False
    if first and high - low > 2.0:
        fridge = kitchen.fridge(rng)
        w = fridge.width_m + 0.02
        turned = f.chance(0.5)
        for at_low in (turned, not turned):
            u = low + w / 2 if at_low else high - w / 2
            if space.wall_is_free(side, u - w / 2, u + w / 2, 0.0, fridge.height_m):
                _stand(f, fridge, side, u)
                low, high = (low + w, high) if at_low else (low, high - w)
                cooled = True
                break
    inset: list[Model] = []
    if first:
        inset.append(kitchen.sink_unit(rng, style))
        if f.chance(0.6):
            inset.append(kitchen.hob(rng))
        elif high - low > 1.6:
            _stand(f, kitchen.cooker(rng), side, low + 0.3)
            _over(f, kitchen.range_hood(rng), side, low + 0.3, 1.5)
            low += 0.605
    if high - low > 1.9 and f.chance(0.6):
        _stand(f, kitchen.dishwasher(rng, style), side, high - 0.3)
        high -= 0.605
    if high - low < 0.4:
        return cooled
    width = high - low
    counter = _stand(f, kitchen.counter(rng, style, width), side, 0.5 * (low + high))
    step = width / max(1, len(inset))
    for k, model in enumerate(inset):
        along = -width / 2 + (k + 0.5) * step
        if model.width_m < step + 0.01:
            f.on(counter, model, along=along, z=kitchen.COUNTER_HEIGHT_M)
            if model.label == "stove":
                sign = 1.0 if side in (0, 1) else -1.0
                _over(f, kitchen.range_hood(rng), side, 0.5 * (low + high) + sign * along, 1.5)
    _machines(f, counter, width, inset_count=len(inset))
    _cupboards(f, side, low, high)
    return cooled


def _stand(f: Furnisher, model: Model, side: int, u: float) -> Placed:
    placed = f.space.stand_at_wall(model, side, u, clearance=_WAY, gap=0.0, optional=False)
    f.placed.append(placed)
    return placed


def _over(f: Furnisher, model: Model, side: int, u: float, z: float) -> None:
    """Hang a model above the counter where the wall is free."""
    w, h = model.width_m, model.height_m
    if f.space.wall_is_free(side, u - w / 2, u + w / 2, z, z + h):
        placed = f.space.at_wall(model, side, u, z)
        f.placed.append(placed)
        f.space.spans.append(WallSpan(side=side, low=u - w / 2, high=u + w / 2, z0=z, z1=z + h))


def _machines(f: Furnisher, counter: Placed, width: float, *, inset_count: int) -> None:
    """Place small appliances on a counter between sink and stove."""
    rng = f.rng
    makers = (kitchen.microwave, kitchen.coffee_machine, kitchen.kettle, kitchen.toaster)
    step = width / max(1, inset_count)
    slots = [-width / 2 + k * step for k in range(1, max(1, inset_count))]
    slots += [-width / 2 + 0.18, width / 2 - 0.18]
    order = rng.permutation(len(makers)).tolist()
    inset_half = 0.34
    centres = [-width / 2 + (k + 0.5) * step for k in range(inset_count)]
    for k, slot in zip(order[: f.some(1, 3)], slots, strict=False):
        model = makers[k](rng)
        half = model.width_m / 2
        along = min(max(slot, -width / 2 + half + 0.02), width / 2 - half - 0.02)
        if all(abs(along - c) > inset_half + half for c in centres):
            f.on(counter, model, along=along, z=kitchen.COUNTER_HEIGHT_M)
            centres.append(along)
            inset_half = 0.3


def _cupboards(f: Furnisher, side: int, low: float, high: float) -> None:
    """Hang cabinets above the counter, between hood and windows."""
    if not f.chance(0.8):
        return
    count = int((high - low) / 0.5)
    for k in range(count):
        u = low + (k + 0.5) * (high - low) / count
        model = kitchen.wall_cupboard(f.style, (high - low) / count - 0.004)
        _over(f, model, side, u, 1.48)


def _island(f: Furnisher) -> None:
    """Place an island with bar stools in the middle."""
    model = kitchen.island(f.rng, f.style)
    w, d = model.width_m, model.depth_m
    spots = f.space.free_spots(w + 1.2, d + 1.6, 0.0)
    if not spots:
        return
    x, y = spots[len(spots) // 2]
    placed = f.at(model, x, y - d / 2, 0.0, ignore_clear=False)
    if placed is None:
        return
    for k in range(f.some(2, 3)):
        stool = seating.stool(f.rng, f.style, bar=True)
        sx, sy = placed.to_world(-w / 2 + (k + 0.5) * w / 3, d + 0.08)
        f.at(stool, sx, sy, 0.0)
    if f.chance(0.5):
        f.on(placed, decor.plant(f.rng, height=0.3), along=0.3)

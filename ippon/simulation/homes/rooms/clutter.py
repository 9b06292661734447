"""Small objects on tables, seats, shelves and floors."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ippon.simulation.homes.config import MUG_COLORS
from ippon.simulation.homes.furniture import decor
from ippon.simulation.homes.furniture.model import Model, Surface
from ippon.simulation.homes.furniture.small_objects import SMALL_THINGS, small_thing
from ippon.simulation.homes.furniture.style import chance, pick, uniform
from ippon.simulation.homes.layout.rect import Rect
from ippon.simulation.homes.rooms.placement import Placed, RoomSpace, footprint

# Kind of surface -> objects on it; repeated names are more frequent.
_LEFT_ON: dict[str, tuple[str, ...]] = {
    "table": (
        "mug", "book", "laptop", "remote control", "bowl", "plate", "vase", "flowers", "bottle",
        "keys", "phone", "tissue box", "tablet", "glasses case", "small plant", "book",
    ),
    "desk": (
        "laptop", "mug", "book", "headphones", "phone", "tablet", "alarm clock", "small plant",
        "glasses case", "book", "screwdriver",
    ),
    "counter": (
        "bottle", "pot", "pan", "bowl", "plate", "mug", "apple", "keys", "small plant",
    ),
    "bedside": ("book", "alarm clock", "phone", "mug", "glasses case", "tissue box", "vase"),
    "shelf": (
        "vase", "toy car", "teddy bear", "small plant", "alarm clock", "headphones", "basket",
        "toy elephant", "ball", "bottle", "handbag", "folded clothes", "book",
    ),
    "seat": ("backpack", "handbag", "shirt", "book", "remote control", "scarf", "teddy bear"),
    "bed": ("shirt", "book", "teddy bear", "laptop", "folded clothes", "tablet", "toy elephant"),
    "sink": ("soap dispenser", "toothbrush cup", "soap dispenser"),
    "floor": (
        "shoes", "backpack", "ball", "trash can", "basket", "toy car", "suitcase", "umbrella",
        "guitar", "shoes", "trash can",
    ),
}  # fmt: skip
_FLOOR_ROOMS: dict[str, tuple[str, ...]] = {
    "bathroom": ("toilet paper", "trash can", "basket"),
    "washroom": ("toilet paper", "trash can", "trash can"),
    "kitchen": ("trash can", "basket", "bottle"),
    "hall": ("shoes", "umbrella", "shoes", "backpack", "suitcase"),
}
_RARE = 0.06
"""Share of objects in unusual places."""

HAT_PLACES: tuple[str | None, ...] = (None, "chair", "bed", "sofa", "shelf", "table", "floor")
"""Place of a home's only hat, by seed; successive seeds cycle through the places."""
_MUG_SURFACES = frozenset({"table", "counter"})
_HAT_SURFACES: dict[str, tuple[str, ...]] = {
    "chair": ("chair",),
    "bed": ("bed",),
    "sofa": ("sofa",),
    "shelf": ("shelving", "chest_of_drawers"),
    "table": ("table", "counter"),
}


@dataclass(slots=True, kw_only=True)
class _Patch:
    """A surface with the areas that are occupied."""

    owner: Placed
    surface: Surface
    taken: list[Rect] = field(default_factory=list[Rect])


def scatter(
    rng: np.random.Generator,
    placed: list[Placed],
    spaces: list[RoomSpace],
    hat_place: str | None,
    mugs: Sequence[str] = (),
) -> list[Placed]:
    """Place small objects.

    Args:
        rng: Randomness.
        placed: The furniture of the home.
        spaces: Occupied parts of each room.
        hat_place: One of `HAT_PLACES`.
        mugs: See `HomeConfig.mugs`; one that has no place is left out.

    Returns:
        The objects that were placed.
    """
    patches = [_patch(p, s, placed) for p in placed for s in p.model.surfaces]
    things: list[Placed] = []
    if hat_place is not None:
        things += _leave_hat(rng, patches, spaces, hat_place)
    tops = [p for p in patches if p.owner.model.category in _MUG_SURFACES]
    for color in mugs:
        things += _put_on_one(rng, tops, decor.mug(MUG_COLORS[color]))
    for patch in patches:
        things += _fill(rng, patch)
    for space in spaces:
        things += _on_floor(rng, space)
    return things


def _patch(owner: Placed, surface: Surface, placed: list[Placed]) -> _Patch:
    """Return a patch with the lamps, cushions and machines on it marked as occupied."""
    patch = _Patch(owner=owner, surface=surface)
    z = owner.z + surface.z
    for other in placed:
        if other is not owner and other.room == owner.room and abs(other.z - z) < 0.06:
            patch.taken.append(other.rect.grown(0.01))
    return patch


def _set_down(
    rng: np.random.Generator, patch: _Patch, model: Model, tries: int = 5
) -> Placed | None:
    """Place an object on a free part of a patch."""
    s = patch.surface
    if model.height_m > s.headroom_m:
        return None
    for _ in range(tries):
        yaw = patch.owner.yaw + uniform(rng, -0.6, 0.6)
        if chance(rng, 0.2):
            yaw += uniform(rng, -math.pi, math.pi)
        lx, ly = uniform(rng, s.x0, s.x1), uniform(rng, s.y0, s.y1)
        x, y = patch.owner.to_world(lx, ly)
        rect = footprint(model, x, y, yaw)
        limit = _world_rect(patch).grown(0.05)
        if limit.contains(rect) and not any(rect.overlaps(t) for t in patch.taken):
            patch.taken.append(rect.grown(0.01))
            z = patch.owner.z + s.z
            return Placed(model=model, x=x, y=y, z=z, yaw=yaw, rect=rect, room=patch.owner.room)
    return None


def _world_rect(patch: _Patch) -> Rect:
    s = patch.surface
    ax, ay = patch.owner.to_world(s.x0, s.y0)
    bx, by = patch.owner.to_world(s.x1, s.y1)
    return Rect(min(ax, bx), min(ay, by), max(ax, bx), max(ay, by))


def _make(rng: np.random.Generator, name: str) -> Model:
    if name == "flowers":
        return decor.flowers(rng)
    if name == "small plant":
        return decor.plant(rng, height=uniform(rng, 0.22, 0.42))
    return small_thing(rng, name)


def _fill(rng: np.random.Generator, patch: _Patch) -> list[Placed]:
    s = patch.surface
    area = (s.x1 - s.x0) * (s.y1 - s.y0)
    mean = {"seat": 0.18, "bed": 0.6, "sink": 0.7, "shelf": 0.7}.get(s.kind, 0.8 + 2.0 * area)
    if s.kind == "seat" and s.x1 - s.x0 > 0.8:
        mean = 0.7
    out: list[Placed] = []
    for _ in range(min(int(rng.poisson(mean)), 5)):
        name = pick(rng, _LEFT_ON[s.kind])
        if chance(rng, _RARE):
            name = pick(rng, tuple(n for n in SMALL_THINGS if n != "hat"))
        thing = _set_down(rng, patch, _make(rng, name))
        if thing is not None:
            out.append(thing)
    return out


def _on_floor(rng: np.random.Generator, space: RoomSpace) -> list[Placed]:
    """Place objects on the floor along the walls."""
    names = _FLOOR_ROOMS.get(space.kind, _LEFT_ON["floor"])
    out: list[Placed] = []
    for _ in range(min(int(rng.poisson(0.04 * space.floor.area + 0.4)), 3)):
        model = _make(rng, pick(rng, names))
        placed = _by_the_wall(rng, space, model)
        if placed is not None:
            out.append(placed)
    return out


def _by_the_wall(rng: np.random.Generator, space: RoomSpace, model: Model) -> Placed | None:
    for _ in range(6):
        side = int(rng.integers(4))
        low, high = space.wall_length(side)
        u = uniform(rng, low + 0.15, high - 0.15)
        yaw = uniform(rng, -0.5, 0.5) + 0.5 * math.pi * int(rng.integers(4))
        at = footprint(model, 0.0, 0.0, yaw)
        spot = space.rect_at_wall(side, u, at.width, at.depth, uniform(rng, 0.03, 0.12))
        if side in (1, 3):
            spot = Rect(spot.x0, spot.y0, spot.x0 + at.width, spot.y0 + at.depth)
        if space.is_free(spot):
            space.take(spot)
            return Placed(
                model=model, x=spot.x0 - at.x0, y=spot.y0 - at.y0, z=0.0, yaw=yaw,
                rect=spot, room=space.room,
            )  # fmt: skip
    return None


def _put_on_one(rng: np.random.Generator, options: list[_Patch], model: Model) -> list[Placed]:
    """Place an object on one of several patches; nothing if none has room."""
    for k in rng.permutation(len(options)).tolist():
        thing = _set_down(rng, options[k], model, tries=20)
        if thing is not None:
            return [thing]
    return []


def _leave_hat(
    rng: np.random.Generator, patches: list[_Patch], spaces: list[RoomSpace], place: str
) -> list[Placed]:
    """Place the home's hat; nothing if there is no such place."""
    hat = small_thing(rng, "hat")
    wanted = _HAT_SURFACES.get(place, ())
    options = [p for p in patches if p.owner.model.category in wanted]
    laid = _put_on_one(rng, options, hat)
    if laid:
        return laid
    if place == "floor":
        for k in rng.permutation(len(spaces)).tolist():
            thing = _by_the_wall(rng, spaces[k], hat)
            if thing is not None:
                return [thing]
    return []

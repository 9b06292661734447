"""Generator of complete homes."""

import dataclasses

import numpy as np
from numpy.typing import NDArray

from ippon.errors import SceneError
from ippon.simulation.homes.config import HomeConfig
from ippon.simulation.homes.furniture import storage
from ippon.simulation.homes.furniture.style import Style, make_style, uniform
from ippon.simulation.homes.layout.building_doors import join_building
from ippon.simulation.homes.layout.building_floor import BUILDING_KINDS, plan_building
from ippon.simulation.homes.layout.building_shell import (
    HomePlan,
    PlacedObject,
    build_shell,
    leaf_rect,
)
from ippon.simulation.homes.layout.openings import (
    Opening,
    exterior_openings,
    join_rooms,
    shared_walls,
)
from ippon.simulation.homes.layout.rect import Rect
from ippon.simulation.homes.layout.room_layout import plan_rooms
from ippon.simulation.homes.rooms import kitchen as cooking
from ippon.simulation.homes.rooms import living_areas as living
from ippon.simulation.homes.rooms import private_rooms as private
from ippon.simulation.homes.rooms import public_rooms as public
from ippon.simulation.homes.rooms.clutter import HAT_PLACES, scatter
from ippon.simulation.homes.rooms.furnisher import Furnisher
from ippon.simulation.homes.rooms.placement import Placed, RoomSpace, WallSpan
from ippon.simulation.homes.rooms.robot_access import make_room_for_robot, start_poses
from ippon.simulation.scene import Instance, Room, Scene

_ATTEMPTS = 40
_ESSENTIAL = ("bed", "chair", "plant", "sofa", "toilet", "tv")
_CORRIDOR_M = 12.0
"""Length from which a hall is furnished as a corridor."""


def generate_home(seed: int, *, config: HomeConfig | None = None) -> Scene:
    """Generate the home of a seed; a seed gives the same home on every machine.

    Args:
        seed: Any whole number from 0.
        config: Constraints of the home; the default suits a robot of radius 0.25 m.

    Raises:
        ValueError: The seed is negative.
        SceneError: No home was found that satisfies `config`.
    """
    if seed < 0:
        raise ValueError(f"a home's seed is a whole number from 0; got {seed}")
    config = config or HomeConfig()
    rng = np.random.Generator(np.random.PCG64(np.random.SeedSequence([seed, 20240])))
    for _ in range(_ATTEMPTS):
        scene = _attempt(rng, seed, config)
        if scene is not None:
            return scene
    raise SceneError(f"no home of seed {seed} satisfies the configuration {config}")


def _attempt(rng: np.random.Generator, seed: int, config: HomeConfig) -> Scene | None:
    plan = _plan(rng, seed, config)
    if plan is None:
        return None
    style = make_style(rng)
    shell = build_shell(rng, plan, style)
    spaces = [_space(plan, k) for k in range(len(plan.rooms))]
    placed = [p for s in spaces for p in _furnish(rng, style, plan, s)]
    essential = set(_ESSENTIAL) - ({"bed"} if config.layout == "floor" else set())
    if not essential.issubset(p.model.category for p in placed):
        return None
    if config.small_things:
        placed += scatter(rng, placed, spaces, HAT_PLACES[seed % len(HAT_PLACES)], config.mugs)
    kept = make_room_for_robot(plan, shell, placed, config)
    if kept is None or not essential.issubset(p.model.category for p in kept):
        return None
    things = shell + [
        PlacedObject(category=p.model.category, label=p.model.label, mesh=p.mesh(), room=p.room)
        for p in kept
    ]
    scene = _assemble(plan, things, f"{config.layout}-{seed}")
    poses = start_poses(rng, scene, config)
    if not poses:
        return None
    return dataclasses.replace(scene, start_poses=poses)


def _plan(rng: np.random.Generator, seed: int, config: HomeConfig) -> HomePlan | None:
    """Draw rooms, doors and windows; None if doors cannot connect the rooms."""
    if config.layout == "floor":
        rooms = plan_building(rng, BUILDING_KINDS[seed % len(BUILDING_KINDS)])
        walls = shared_walls(rooms)
        doors = join_building(rng, rooms, walls)
    else:
        rooms = plan_rooms(rng)
        walls = shared_walls(rooms)
        doors = join_rooms(rng, rooms, walls)
    if doors is None:
        return None
    return HomePlan(
        rooms=rooms,
        walls=walls,
        openings=(*doors, *exterior_openings(rng, rooms, walls)),
        thickness_m=round(uniform(rng, 0.1, 0.15), 2),
        ceiling_m=round(uniform(rng, 2.5, 2.8), 2),
    )


def _space(plan: HomePlan, room: int) -> RoomSpace:
    """Return the parts of a room that doors and windows occupy."""
    floor = plan.interior(room)
    space = RoomSpace(room=room, kind=plan.rooms[room].kind, floor=floor, ceiling_m=plan.ceiling_m)
    for o in plan.openings:
        if room not in o.rooms:
            continue
        side = _side_of(plan, room, o)
        space.spans.append(
            WallSpan(side=side, low=o.low - 0.08, high=o.high + 0.08, z0=o.z0, z1=o.z1)
        )
        if o.kind != "window":
            middle = 0.5 * (o.low + o.high)
            reach = min(0.9, 0.45 * min(floor.width, floor.depth))
            space.clear.append(space.rect_at_wall(side, middle, o.width + 0.1, reach))
        if o.leaf_room == room:
            leaf = leaf_rect(plan, o)
            space.solids.append(leaf)
            if o.leaf_along_wall:
                low, high = (leaf.x0, leaf.x1) if o.along_x else (leaf.y0, leaf.y1)
                space.spans.append(WallSpan(side=side, low=low, high=high, z0=0.0, z1=o.z1))
    return space


def _side_of(plan: HomePlan, room: int, o: Opening) -> int:
    """Return the wall of a room with an opening: 0 south, 1 east, 2 north, 3 west."""
    r = plan.rooms[room].rect
    if o.along_x:
        return 0 if o.line == r.y0 else 2
    return 3 if o.line == r.x0 else 1


def _furnish(
    rng: np.random.Generator, style: Style, plan: HomePlan, space: RoomSpace
) -> list[Placed]:
    """Furnish one room by its type."""
    f = Furnisher(rng, style, space)
    kinds = [r.kind for r in plan.rooms]
    first_bedroom = kinds.index("bedroom") == space.room if "bedroom" in kinds else False
    if space.kind == "studio":
        _furnish_studio(f, bathroom="bathroom" not in kinds)
    elif space.kind == "living_room":
        if "kitchen" not in kinds:
            cooking.kitchen_run(f, second=False)
        living.furnish_living_room(f, dining="dining_room" not in kinds)
    elif space.kind == "kitchen":
        cooking.furnish_kitchen(f, dining=len(kinds) > 4)
    elif space.kind == "bedroom":
        private.furnish_bedroom(f, main=first_bedroom)
    elif space.kind == "bathroom":
        private.furnish_bathroom(f, laundry="laundry" not in kinds)
    elif space.kind == "hall" and max(space.floor.width, space.floor.depth) > _CORRIDOR_M:
        public.furnish_corridor(f)
    elif space.kind == "hall":
        private.furnish_hall(f)
    elif space.kind == "laundry":
        private.furnish_laundry(f)
    elif space.kind == "dining_room":
        living.furnish_dining_room(f)
    elif not public.furnish_public_room(f):
        living.furnish_study(f)
    return f.placed


def _furnish_studio(f: Furnisher, *, bathroom: bool) -> None:
    """Furnish a studio: one room for all uses."""
    private.place_bed(f, (1.6, 1.4, 1.2, 0.9))
    if bathroom:
        private.wet_corner(f)
    cooking.kitchen_run(f, second=False)
    living.furnish_living_room(f, dining=True)
    f.at_wall(storage.wardrobe(f.rng, f.style, 1.0), clearance=0.5)


def _assemble(plan: HomePlan, things: list[PlacedObject], name: str) -> Scene:
    """Join all meshes and name rooms and objects."""
    names = _numbered([r.kind for r in plan.rooms])
    nodes = _numbered([t.category for t in things])
    vertices = np.concatenate([t.mesh.vertices for t in things]).astype(np.float32)
    offsets = np.cumsum([0] + [len(t.mesh.vertices) for t in things]).tolist()
    faces = [t.mesh.faces + offsets[k] for k, t in enumerate(things)]
    instances: list[Instance] = []
    for k, (thing, node) in enumerate(zip(things, nodes, strict=True)):
        part = vertices[offsets[k] : offsets[k + 1]].astype(np.float64)
        instances.append(
            Instance(
                node=node,
                category=thing.category,
                label=thing.label,
                aabb_min=_triple(part.min(axis=0)),
                aabb_max=_triple(part.max(axis=0)),
                room=names[thing.room] if thing.room >= 0 else None,
            )
        )
    return Scene(
        name=name,
        source=f"ippon home generator, {name}",
        instances=tuple(instances),
        start_poses=(),
        rooms=tuple(
            Room(name=name, polygon=_corners(plan.interior(k))) for k, name in enumerate(names)
        ),
        vertices=vertices,
        faces=np.concatenate(faces).astype(np.int32),
        face_instance=np.repeat(np.arange(len(things)), [len(f) for f in faces]).astype(np.int32),
        face_colors=np.concatenate([t.mesh.colors for t in things]),
    )


def _numbered(kinds: list[str]) -> list[str]:
    """Return names `<kind>.<n>`, with n counting within each kind."""
    counts: dict[str, int] = {}
    names: list[str] = []
    for kind in kinds:
        names.append(f"{kind}.{counts.get(kind, 0)}")
        counts[kind] = counts.get(kind, 0) + 1
    return names


def _triple(values: NDArray[np.float64]) -> tuple[float, float, float]:
    x, y, z = values.tolist()
    return x, y, z


def _corners(r: Rect) -> NDArray[np.float64]:
    return np.array([[r.x0, r.y0], [r.x1, r.y0], [r.x1, r.y1], [r.x0, r.y1]])

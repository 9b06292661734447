"""Meshes of walls, floors, ceilings, windows and doors."""

import math
from dataclasses import dataclass

import numpy as np

from ippon.simulation.homes.furniture.mesh_builder import Color, Mesh, MeshBuilder
from ippon.simulation.homes.furniture.style import (
    Style,
    chance,
    pick,
    shade,
    uniform,
    vary,
    wall_color,
    wood,
)
from ippon.simulation.homes.layout.openings import Opening, SharedWall
from ippon.simulation.homes.layout.rect import Rect
from ippon.simulation.homes.layout.room_layout import RoomPlan

_OUTSIDE: Color = (206, 200, 190)
_FRAME: Color = (238, 236, 232)
_TILED = ("kitchen", "bathroom", "laundry", "hall")
_LEAF_THICKNESS_M = 0.04


@dataclass(frozen=True, slots=True, kw_only=True)
class PlacedObject:
    """One object of the home, in world coordinates."""

    category: str
    label: str
    mesh: Mesh
    room: int
    """Row of the room plans, -1 for none."""


@dataclass(frozen=True, slots=True, kw_only=True)
class HomePlan:
    """Plan of a home before it is furnished."""

    rooms: tuple[RoomPlan, ...]
    walls: tuple[SharedWall, ...]
    openings: tuple[Opening, ...]
    thickness_m: float
    ceiling_m: float

    def interior(self, room: int) -> Rect:
        """Return the floor of a room between the inner faces of its walls."""
        return self.rooms[room].rect.grown(-0.5 * self.thickness_m)


def build_shell(rng: np.random.Generator, plan: HomePlan, style: Style) -> list[PlacedObject]:
    """Return everything but furniture and small objects."""
    colors = [wall_color(rng, style) for _ in plan.rooms]
    things = [_wall(plan, wall, colors) for wall in plan.walls]
    for k in range(len(plan.rooms)):
        things += [_floor(rng, plan, k, style), _ceiling(plan, k)]
    door = wood(rng, style) if chance(rng, 0.5) else _FRAME
    for opening in plan.openings:
        if opening.kind == "window":
            things.append(_window(rng, plan, opening))
        elif opening.kind == "front_door":
            things.append(_front_door(plan, opening, shade(door, 0.8)))
        elif opening.kind == "door":
            things.append(_door_frame(plan, opening, door))
            if opening.leaf_room >= 0:
                things.append(_door_leaf(plan, opening, door))
    return things


def leaf_rect(plan: HomePlan, opening: Opening) -> Rect:
    """Return the floor area under the open leaf of a door."""
    t, w, k = plan.thickness_m, opening.width, _LEAF_THICKNESS_M
    away = _towards(plan, opening, opening.leaf_room)
    hinge = opening.low if opening.hinge_low else opening.high
    outward = -1.0 if opening.hinge_low else 1.0
    if opening.leaf_along_wall:
        along, across = (hinge, hinge + outward * w), (0.5 * t + 0.02, 0.5 * t + 0.02 + k)
    else:
        along, across = (hinge, hinge + outward * k), (0.5 * t - 0.01, 0.5 * t + w - 0.02)
    a = sorted(along)
    c = sorted(opening.line + away * v for v in across)
    return Rect(a[0], c[0], a[1], c[1]) if opening.along_x else Rect(c[0], a[0], c[1], a[1])


def _towards(plan: HomePlan, opening: Opening, room: int) -> float:
    """Return +1 if the room lies at higher coordinates than the wall, else -1."""
    r = plan.rooms[room].rect
    middle = r.center[1] if opening.along_x else r.center[0]
    return 1.0 if middle > opening.line else -1.0


def _bar(
    b: MeshBuilder,
    wall: SharedWall | Opening,
    span: tuple[float, float],
    across: tuple[float, float],
    z: tuple[float, float],
    color: Color,
    faces: dict[str, Color] | None = None,
) -> None:
    """Add a box given along and across a wall's line."""
    (a0, a1), (c0, c1) = span, (wall.line + across[0], wall.line + across[1])
    if wall.along_x:
        b.box((a0, c0, z[0]), (a1, c1, z[1]), color, faces=faces)
    else:
        b.box((c0, a0, z[0]), (c1, a1, z[1]), color, faces=faces)


def _wall(plan: HomePlan, wall: SharedWall, colors: list[Color]) -> PlacedObject:
    """Return a wall segment with its openings; each side has the colour of its room."""
    t = 0.5 * plan.thickness_m
    first, second = _side_colors(plan, wall, colors)
    sides = ("low_y", "high_y") if wall.along_x else ("low_x", "high_x")
    faces = {sides[0]: first, sides[1]: second}
    # The ends reach into the neighbouring walls, almost to their far face.
    low, high = wall.low - t + 0.001, wall.high + t - 0.001
    holes = sorted(
        (
            o
            for o in plan.openings
            if o.along_x == wall.along_x
            and o.line == wall.line
            and wall.low < 0.5 * (o.low + o.high) < wall.high
        ),
        key=lambda o: o.low,
    )
    b = MeshBuilder()
    start = low
    for o in holes:
        _bar(b, wall, (start, o.low), (-t, t), (0.0, plan.ceiling_m), first, faces)
        if o.z0 > 0.0:
            _bar(b, wall, (o.low, o.high), (-t, t), (0.0, o.z0), first, faces)
        _bar(b, wall, (o.low, o.high), (-t, t), (o.z1, plan.ceiling_m), first, faces)
        start = o.high
    _bar(b, wall, (start, high), (-t, t), (0.0, plan.ceiling_m), first, faces)
    return PlacedObject(category="wall", label="wall", mesh=b.build(), room=wall.first)


def _side_colors(plan: HomePlan, wall: SharedWall, colors: list[Color]) -> tuple[Color, Color]:
    r = plan.rooms[wall.first].rect
    middle = r.center[1] if wall.along_x else r.center[0]
    first = colors[wall.first]
    second = colors[wall.second] if wall.second >= 0 else _OUTSIDE
    return (first, second) if middle < wall.line else (second, first)


def _floor(rng: np.random.Generator, plan: HomePlan, room: int, style: Style) -> PlacedObject:
    """Make a floor of boards or tiles."""
    r, kind = plan.rooms[room].rect, plan.rooms[room].kind
    tiled = kind in _TILED and (kind != "hall" or chance(rng, 0.4))
    base = vary(rng, style.tile_floor if tiled else style.wood_floor, 0.05)
    b = MeshBuilder().box((r.x0, r.y0, -0.05), (r.x1, r.y1, -0.001), shade(base, 0.8))
    across = 0.6 if tiled else uniform(rng, 0.18, 0.24)
    along = 0.6 if tiled else 1.6
    boards_along_x = r.width > r.depth
    lanes = max(1, round((r.depth if boards_along_x else r.width) / across))
    length = r.width if boards_along_x else r.depth
    quads: list[np.ndarray] = []
    tints: list[Color] = []
    for lane in range(lanes):
        a = 0.0 if tiled else -uniform(rng, 0.0, along)
        while a < length - 1e-6:
            u0, u1 = max(a, 0.0), min(a + along, length)
            v = [k * (r.depth if boards_along_x else r.width) / lanes for k in (lane, lane + 1)]
            quads.append(_quad(r, boards_along_x, (u0, u1), (v[0], v[1])))
            tints.append(vary(rng, base, 0.035 if tiled else 0.08))
            a += along
    vertices = np.concatenate(quads)
    rows = 4 * np.arange(len(quads))[:, None]
    faces = np.concatenate([rows + np.array([0, 1, 2]), rows + np.array([0, 2, 3])])
    colors = np.array(tints + tints, dtype=np.uint8)
    b.add_mesh(Mesh(vertices=vertices, faces=faces, colors=colors))
    return PlacedObject(category="floor", label="floor", mesh=b.build(), room=room)


def _quad(r: Rect, along_x: bool, u: tuple[float, float], v: tuple[float, float]) -> np.ndarray:
    corners = [(u[0], v[0]), (u[1], v[0]), (u[1], v[1]), (u[0], v[1])]
    if along_x:
        return np.array([(r.x0 + a, r.y0 + c, 0.0) for a, c in corners])
    return np.array([(r.x0 + c, r.y0 + a, 0.0) for a, c in reversed(corners)])


def _ceiling(plan: HomePlan, room: int) -> PlacedObject:
    r, z = plan.rooms[room].rect, plan.ceiling_m
    b = MeshBuilder().box((r.x0, r.y0, z), (r.x1, r.y1, z + 0.05), (244, 243, 240))
    return PlacedObject(category="ceiling", label="ceiling", mesh=b.build(), room=room)


def _window(rng: np.random.Generator, plan: HomePlan, o: Opening) -> PlacedObject:
    """Return an opaque, sky-coloured pane in a frame, with a sill."""
    t = 0.5 * plan.thickness_m
    glass = vary(rng, pick(rng, ((186, 210, 228), (204, 222, 232), (170, 200, 224))), 0.04)
    b = MeshBuilder()
    _bar(b, o, (o.low, o.high), (-0.01, 0.01), (o.z0, o.z1), glass)
    f, d = 0.05, 0.03
    for z in ((o.z0, o.z0 + f), (o.z1 - f, o.z1)):
        _bar(b, o, (o.low, o.high), (-d, d), z, _FRAME)
    posts = [o.low, o.high - f]
    if o.width > 0.9:
        posts.append(0.5 * (o.low + o.high - f))
    for a in posts:
        _bar(b, o, (a, a + f), (-d, d), (o.z0, o.z1), _FRAME)
    side = _towards(plan, o, o.rooms[0])
    board = sorted((side * 0.02, side * (t + 0.06)))
    _bar(b, o, (o.low, o.high), (board[0], board[1]), (o.z0, o.z0 + 0.02), _FRAME)
    return PlacedObject(category="window", label="window", mesh=b.build(), room=o.rooms[0])


def _front_door(plan: HomePlan, o: Opening, color: Color) -> PlacedObject:
    b = MeshBuilder()
    side = _towards(plan, o, o.rooms[0])
    _bar(b, o, (o.low, o.high), (-0.03, 0.03), (0.0, o.z1), color)
    face = 0.03 * side
    panel = sorted((face, face + 0.012 * side))
    for z in ((0.2, 0.9), (1.15, 1.9)):
        _bar(b, o, (o.low + 0.15, o.high - 0.15), (panel[0], panel[1]), z, shade(color, 0.85))
    knob = sorted((face, face + 0.06 * side))
    _bar(b, o, (o.low + 0.05, o.low + 0.12), (knob[0], knob[1]), (1.0, 1.04), (170, 170, 172))
    return PlacedObject(category="door", label="front door", mesh=b.build(), room=o.rooms[0])


def _door_frame(plan: HomePlan, o: Opening, color: Color) -> PlacedObject:
    """Return a casing around a doorway that leaves its clear width free."""
    t, c = 0.5 * plan.thickness_m + 0.012, 0.06
    b = MeshBuilder()
    for span in ((o.low - c, o.low), (o.high, o.high + c)):
        _bar(b, o, span, (-t, t), (0.0, o.z1 + c), color)
    _bar(b, o, (o.low - c, o.high + c), (-t, t), (o.z1, o.z1 + c), color)
    return PlacedObject(category="door", label="door frame", mesh=b.build(), room=o.rooms[0])


def _door_leaf(plan: HomePlan, o: Opening, color: Color) -> PlacedObject:
    r = leaf_rect(plan, o)
    b = MeshBuilder().box((r.x0, r.y0, 0.01), (r.x1, r.y1, o.z1 - 0.01), color)
    # A panel on both faces and a handle near the free edge make it recognisable as a door.
    thin_x = r.width < r.depth
    m = 0.006
    for z0, z1 in ((0.25, 0.95), (1.15, 1.85)):
        if thin_x:
            b.box((r.x0 - m, r.y0 + 0.14, z0), (r.x1 + m, r.y1 - 0.14, z1), shade(color, 0.92))
        else:
            b.box((r.x0 + 0.14, r.y0 - m, z0), (r.x1 - 0.14, r.y1 + m, z1), shade(color, 0.92))
    x, y = _free_edge(o, r)
    b.box((x - 0.05, y - 0.05, 1.0), (x + 0.05, y + 0.05, 1.03), (170, 170, 172))
    return PlacedObject(category="door", label="door", mesh=b.build(), room=o.leaf_room)


def _free_edge(o: Opening, r: Rect) -> tuple[float, float]:
    """Return a point of the leaf near the edge away from its hinge."""
    if o.leaf_along_wall:
        hinge = o.low if o.hinge_low else o.high
        ends = (r.x0, r.x1) if o.along_x else (r.y0, r.y1)
    else:
        hinge = o.line
        ends = (r.y0, r.y1) if o.along_x else (r.x0, r.x1)
    far = max(ends, key=lambda e: abs(e - hinge))
    far -= math.copysign(0.07, far - hinge)
    x, y = r.center
    return (far, y) if o.leaf_along_wall == o.along_x else (x, far)

"""Placement of furniture in a room: single pieces and groups."""

import math

import numpy as np

from ippon.simulation.homes.furniture import decor, seating, tables
from ippon.simulation.homes.furniture.model import Model
from ippon.simulation.homes.furniture.style import (
    Style,
    accent,
    chance,
    fabric,
    pick,
    shade,
    uniform,
)
from ippon.simulation.homes.layout.rect import Rect
from ippon.simulation.homes.rooms.placement import Placed, RoomSpace, WallSpan, footprint


class Furnisher:
    """Furnishes one room; `placed` holds the pieces in order."""

    def __init__(self, rng: np.random.Generator, style: Style, space: RoomSpace) -> None:
        self.rng = rng
        self.style = style
        self.space = space
        self.placed: list[Placed] = []

    def chance(self, probability: float) -> bool:
        """Return True with this probability."""
        return chance(self.rng, probability)

    def sides(self, *, longest_first: bool = False) -> list[int]:
        """Return the four walls in random order, or the longest first."""
        order = self.rng.permutation(4).tolist()
        if longest_first:
            order.sort(key=lambda s: -(np.diff(self.space.wall_length(s))[0]))
        return order

    def at_wall(
        self,
        model: Model,
        *,
        clearance: float = 0.6,
        sides: list[int] | None = None,
        where: str = "any",
        gap: float = 0.015,
        height_m: float | None = None,
        optional: bool = True,
    ) -> Placed | None:
        """Place a model with its back at a wall.

        Args:
            model: What to place.
            clearance: Free floor in front of it, metres.
            sides: Walls to try, in order; all in random order by default.
            where: "any", "middle" of the wall, or "corner".
            gap: Distance between wall and back, metres.
            height_m: Height up to which the wall must be free; the model's own by default.
            optional: Whether it may be removed to make room for the robot.

        Returns:
            The placement, or None where it does not fit.
        """
        height = model.height_m if height_m is None else height_m
        for side in self.sides() if sides is None else sides:
            fits = self.space.positions(side, model.width_m, model.depth_m, height, clearance, gap)
            if not fits:
                continue
            low, high = self.space.wall_length(side)
            if where == "middle":
                u = min(fits, key=lambda v: abs(v - 0.5 * (low + high)))
            elif where == "corner":
                u = min(fits, key=lambda v: min(v - low, high - v))
            else:
                u = fits[int(self.rng.integers(len(fits)))]
            placed = self.space.stand_at_wall(
                model, side, u, clearance=clearance, gap=gap, optional=optional
            )
            self.placed.append(placed)
            return placed
        return None

    def at(
        self,
        model: Model,
        x: float,
        y: float,
        yaw: float,
        *,
        z: float = 0.0,
        optional: bool = True,
        solid: bool = True,
        ignore_clear: bool = True,
    ) -> Placed | None:
        """Place a model's origin at (x, y) if its footprint is free."""
        rect = footprint(model, x, y, yaw)
        if solid and not self.space.is_free(rect, ignore_clear=ignore_clear):
            return None
        placed = Placed(
            model=model, x=x, y=y, z=z, yaw=yaw, rect=rect, room=self.space.room, optional=optional
        )
        if solid:
            self.space.take(rect)
        self.placed.append(placed)
        return placed

    def beside(self, neighbour: Placed, make: Model, *, left: bool, gap: float) -> Placed | None:
        """Place a model at the same wall as its neighbour, left or right of it."""
        if neighbour.side < 0:
            return None
        sign = (-1.0 if left else 1.0) * (1.0 if neighbour.side in (0, 1) else -1.0)
        offset = sign * (0.5 * (neighbour.model.width_m + make.width_m) + gap)
        u = (neighbour.x if neighbour.side in (0, 2) else neighbour.y) + offset
        low, high = self.space.wall_length(neighbour.side)
        w, d, side = make.width_m, make.depth_m, neighbour.side
        rect = self.space.rect_at_wall(side, u, w, d, 0.015)
        inside = low <= u - w / 2 and u + w / 2 <= high
        free = self.space.wall_is_free(side, u - w / 2, u + w / 2, 0.0, make.height_m)
        if not (inside and free and self.space.is_free(rect)):
            return None
        placed = self.space.stand_at_wall(make, side, u, clearance=0.0, gap=0.015, optional=True)
        self.placed.append(placed)
        return placed

    def on(
        self, below: Placed, model: Model, *, along: float = 0.0, z: float | None = None
    ) -> Placed:
        """Place a model on another, backs aligned, shifted by `along` of the other's width."""
        x, y = below.to_world(along, 0.0)
        top = below.z + below.model.mesh.vertices[:, 2].max() if z is None else z
        rect = footprint(model, x, y, below.yaw)
        placed = Placed(
            model=model, x=x, y=y, z=float(top), yaw=below.yaw, rect=rect, room=self.space.room
        )
        self.placed.append(placed)
        return placed

    def hang(
        self,
        model: Model,
        z: float,
        *,
        over: Placed | None = None,
        sides: list[int] | None = None,
    ) -> Placed | None:
        """Hang a model with its lower edge at `z`, above a piece or on any free wall."""
        w, h = model.width_m, float(model.mesh.vertices[:, 2].max())
        tries = [over.side] if over is not None else (sides or self.sides())
        for side in tries:
            if side < 0:
                continue
            low, high = self.space.wall_length(side)
            if high - low < w + 0.1:
                continue
            if over is not None:
                options = [over.x if side in (0, 2) else over.y]
            else:
                options = self.rng.uniform(low + w / 2, high - w / 2, 6).tolist()
            for u in options:
                if u - w / 2 < low or u + w / 2 > high:
                    continue
                if self.space.wall_is_free(side, u - w / 2 - 0.05, u + w / 2 + 0.05, z, z + h):
                    span = WallSpan(side=side, low=u - w / 2, high=u + w / 2, z0=z, z1=z + h)
                    self.space.spans.append(span)
                    placed = self.space.at_wall(model, side, u, z)
                    self.placed.append(placed)
                    return placed
        return None

    def in_corner(self, model: Model, *, optional: bool = True) -> Placed | None:
        """Place a slim model in a corner, else at any wall."""
        return self.at_wall(model, clearance=0.0, where="corner", gap=0.03, optional=optional)

    def dining_group(self, width: float, depth: float, *, optional: bool = True) -> Placed | None:
        """Place a table with chairs where there is room, near the middle of the room."""
        rng, style, space = self.rng, self.style, self.space
        round_top = abs(width - depth) < 0.06
        turned = self.chance(0.5)
        for swap in (turned, not turned):
            w, d = (depth, width) if swap else (width, depth)
            spots = space.free_spots(w + 0.9, d + 0.9, 0.05)
            if not spots:
                continue
            cx, cy = space.floor.center
            spots.sort(key=lambda p: abs(p[0] - cx) + abs(p[1] - cy))
            x, y = spots[int(rng.integers(min(len(spots), 1 + len(spots) // 3)))]
            yaw = -0.5 * math.pi if swap else 0.0
            model = (
                tables.round_table(rng, style, width / 2)
                if round_top
                else tables.dining_table(rng, style, width, depth)
            )
            ox, oy = (x - depth / 2, y) if swap else (x, y - depth / 2)
            table = self.at(model, ox, oy, yaw, optional=optional, ignore_clear=False)
            if table is not None:
                self.chairs_round(table, width, depth)
                space.clear.append(table.rect.grown(0.45))
                return table
        return None

    def place_to_eat(self, width: float, depth: float) -> Placed | None:
        """Place a table with chairs: at full size, else smaller, else with one side at a wall."""
        for w, d in ((width, depth), (1.2, 0.8), (0.9, 0.9), (0.8, 0.7)):
            if w <= width:
                table = self.dining_group(w, d)
                if table is not None:
                    return table
        for w, d in ((1.2, 0.75), (0.9, 0.65)):
            model = tables.dining_table(self.rng, self.style, w, d)
            table = self.at_wall(model, clearance=0.75)
            if table is not None:
                self.chairs_round(table, w, d)
                return table
        return None

    def chairs_round(self, table: Placed, width: float, depth: float) -> None:
        """Place chairs at the four edges of a table, slightly displaced and rotated."""
        rng = self.rng
        state = rng.integers(0, 2**31)
        per_side = max(1, int(width / 0.62))
        places = [
            (-width / 2 + (k + 0.5) * width / per_side, edge, turn)
            for k in range(per_side)
            for edge, turn in ((0.0, 0.0), (depth, math.pi))
        ]
        if depth > 0.7:
            places += [
                (-width / 2, depth / 2, -0.5 * math.pi),
                (width / 2, depth / 2, 0.5 * math.pi),
            ]
        taken = [p for p in places if self.chance(0.92)] or places[:1]
        for px, py, turn in taken:
            chair = seating.chair(np.random.default_rng(int(state)), self.style)
            out = chair.depth_m - uniform(rng, 0.04, 0.2)
            bx, by = px - out * -math.sin(turn), py - out * math.cos(turn)
            x, y = table.to_world(bx, by)
            yaw = table.yaw + turn + uniform(rng, -0.12, 0.12)
            rect = footprint(chair, x, y, yaw)
            if self.space.floor.contains(rect) and not any(
                rect.overlaps(s) for s in self.space.solids if s != table.rect
            ):
                self.at(chair, x, y, yaw, solid=False)
                self.space.take(rect)

    def chair_before(self, desk: Placed, chair: Model, along: float = 0.0) -> None:
        """Place a chair in front of a desk, facing it, if there is room."""
        pull = uniform(self.rng, -0.15, 0.12)
        out = desk.model.depth_m + chair.depth_m + pull
        x, y = desk.to_world(along + uniform(self.rng, -0.15, 0.15), out)
        yaw = desk.yaw + math.pi + uniform(self.rng, -0.4, 0.4)
        rect = footprint(chair, x, y, yaw)
        if self.space.floor.contains(rect) and not any(
            rect.overlaps(s) for s in self.space.solids if s != desk.rect
        ):
            self.at(chair, x, y, yaw, solid=False)
            self.space.take(rect)

    def cushions(self, seat: Placed, count: int) -> None:
        """Place cushions against the back of a sofa or bed."""
        surface = seat.model.surfaces[0]
        color = accent(self.rng)
        for k in range(count):
            share = (k + uniform(self.rng, 0.25, 0.75)) / count
            x = surface.x0 + 0.2 + share * (surface.x1 - surface.x0 - 0.4)
            wx, wy = seat.to_world(x, surface.y0 - 0.03)
            tint = color if self.chance(0.6) else fabric(self.rng, self.style)
            model = seating.cushion(self.rng, tint)
            self.at(model, wx, wy, seat.yaw, z=surface.z, solid=False)

    def pillows(self, bed: Placed, width: float) -> None:
        """Place pillows at the head of a bed."""
        linen = shade((240, 238, 232), uniform(self.rng, 0.9, 1.02))
        top = bed.model.surfaces[0].z - 0.05
        for x in (-0.25 * width, 0.25 * width) if width > 1.3 else (0.0,):
            wx, wy = bed.to_world(x, 0.1)
            self.at(seating.cushion(self.rng, linen, "pillow"), wx, wy, bed.yaw, z=top, solid=False)

    def rug_at(self, x: float, y: float, width: float, depth: float, yaw: float) -> None:
        """Place a carpet centred at (x, y), if it fits into the room."""
        model = decor.rug(self.rng, self.style, width, depth)
        c, s = math.cos(yaw), math.sin(yaw)
        ox, oy = x + s * depth / 2, y - c * depth / 2
        if self.space.floor.contains(footprint(model, ox, oy, yaw).grown(0.02)):
            self.at(model, ox, oy, yaw, solid=False)

    def finish(self, *, pictures: int, plants: int, lamp: bool = True) -> None:
        """Add curtains, radiators, pictures, plants and a lamp."""
        rng, space = self.rng, self.space
        windows = [s for s in space.spans if s.z0 > 0.05 and s.z1 > 1.9 and s.high - s.low > 0.9]
        for window in windows[:3]:
            self._dress(window)
        for _ in range(pictures):
            self.hang(decor.picture(rng), uniform(rng, 1.25, 1.5))
        for _ in range(plants):
            self.in_corner(decor.plant(rng, height=uniform(rng, 0.7, 1.7)))
        if lamp:
            x, y = space.floor.center
            self.at(decor.ceiling_lamp(rng, space.ceiling_m), x, y, 0.0, solid=False)

    def _dress(self, window: WallSpan) -> None:
        """Hang curtains beside a window and a radiator below it where the wall is free."""
        rng, space = self.rng, self.space
        if self.chance(0.6):
            width, top = uniform(rng, 0.22, 0.4), min(2.35, space.ceiling_m - 0.1)
            model = decor.curtain(rng, self.style, width, top)
            for u in (window.low - 0.4 * width, window.high + 0.4 * width):
                rect = space.rect_at_wall(window.side, u, width, 0.12)
                others = [s for s in space.spans if s is not window and s.side == window.side]
                blocked = any(s.low < u + width / 2 and u - width / 2 < s.high for s in others)
                if not blocked and space.is_free(rect, ignore_clear=True):
                    space.take(rect)
                    self.placed.append(space.at_wall(model, window.side, u, 0.0))
        if window.z0 > 0.7 and self.chance(0.5):
            model = decor.radiator(rng)
            u = 0.5 * (window.low + window.high)
            rect = space.rect_at_wall(window.side, u, model.width_m, 0.1)
            if space.is_free(rect, ignore_clear=True):
                space.take(rect)
                self.placed.append(space.at_wall(model, window.side, u, 0.0))

    def free_floor(self, rect: Rect) -> bool:
        """Tell whether a rectangle of floor is free of objects."""
        return self.space.is_free(rect, ignore_clear=True)

    def some(self, low: int, high: int) -> int:
        """Return a random integer, both bounds included."""
        return int(self.rng.integers(low, high + 1))

    def one_of(self, *options: float) -> float:
        """Return one of several lengths, with equal probability."""
        return pick(self.rng, options)

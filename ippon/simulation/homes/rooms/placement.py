"""Floor and walls of one room while it is furnished: occupied and free parts."""

import math
from dataclasses import dataclass, field

import numpy as np

from ippon.simulation.homes.furniture.mesh_builder import Mesh
from ippon.simulation.homes.furniture.model import Model
from ippon.simulation.homes.layout.rect import Rect

_STEP_M = 0.1
_TURNS = (0.0, 0.5 * math.pi, math.pi, -0.5 * math.pi)
"""Yaw of a model with its back at the south, east, north or west wall."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Placed:
    """A model with its pose."""

    model: Model
    x: float
    y: float
    z: float
    yaw: float
    rect: Rect
    room: int
    side: int = -1
    """Wall at which it stands: 0 south, 1 east, 2 north, 3 west, -1 none."""
    optional: bool = True
    """Whether it may be removed to make room for the robot."""

    def mesh(self) -> Mesh:
        """Return the triangles in world coordinates."""
        return self.model.mesh.moved(self.x, self.y, self.z, self.yaw)

    def to_world(self, x: float, y: float) -> tuple[float, float]:
        """Map a point of the model's frame to the world."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return self.x + c * x - s * y, self.y + s * x + c * y


def footprint(model: Model, x: float, y: float, yaw: float) -> Rect:
    """Return the bounding rectangle of a model at a pose."""
    v = model.mesh.moved(x, y, 0.0, yaw).vertices
    return Rect(
        float(v[:, 0].min()), float(v[:, 1].min()), float(v[:, 0].max()), float(v[:, 1].max())
    )


@dataclass(slots=True, kw_only=True)
class WallSpan:
    """An occupied part of a wall: a door, a window, or a piece of furniture."""

    side: int
    low: float
    high: float
    z0: float
    z1: float


@dataclass(slots=True, kw_only=True)
class RoomSpace:
    """Occupied parts of one room."""

    room: int
    kind: str
    floor: Rect
    ceiling_m: float
    solids: list[Rect] = field(default_factory=list[Rect])
    """Floor under furniture."""
    clear: list[Rect] = field(default_factory=list[Rect])
    """Floor to keep free: in front of doors, seats and cabinets."""
    spans: list[WallSpan] = field(default_factory=list[WallSpan])

    def wall_length(self, side: int) -> tuple[float, float]:
        """Return the bounds of a wall along its own axis."""
        f = self.floor
        return (f.x0, f.x1) if side in (0, 2) else (f.y0, f.y1)

    def rect_at_wall(
        self, side: int, u: float, width: float, depth: float, gap: float = 0.0
    ) -> Rect:
        """Return the rectangle of an object centred at `u` along a wall, its back `gap` from it."""
        f, h = self.floor, 0.5 * width
        if side == 0:
            return Rect(u - h, f.y0 + gap, u + h, f.y0 + gap + depth)
        if side == 1:
            return Rect(f.x1 - gap - depth, u - h, f.x1 - gap, u + h)
        if side == 2:
            return Rect(u - h, f.y1 - gap - depth, u + h, f.y1 - gap)
        return Rect(f.x0 + gap, u - h, f.x0 + gap + depth, u + h)

    def pose_at_wall(self, side: int, u: float, gap: float) -> tuple[float, float, float]:
        """Return x, y and yaw of a model at `u` along a wall, its back `gap` from it."""
        f = self.floor
        x, y = ((u, f.y0 + gap), (f.x1 - gap, u), (u, f.y1 - gap), (f.x0 + gap, u))[side]
        return x, y, _TURNS[side]

    def is_free(self, rect: Rect, *, ignore_clear: bool = False) -> bool:
        """Tell whether furniture may stand on a rectangle."""
        return (
            self.floor.contains(rect)
            and not any(rect.overlaps(s) for s in self.solids)
            and (ignore_clear or not any(rect.overlaps(c) for c in self.clear))
        )

    def wall_is_free(self, side: int, low: float, high: float, z0: float, z1: float) -> bool:
        """Tell whether a part of a wall is free."""
        return not any(
            s.side == side and s.low < high - 1e-6 and low < s.high - 1e-6
            and s.z0 < z1 - 1e-6 and z0 < s.z1 - 1e-6
            for s in self.spans
        )  # fmt: skip

    def positions(
        self, side: int, width: float, depth: float, height: float, clearance: float, gap: float
    ) -> list[float]:
        """Return the positions along a wall with free floor of `clearance` metres in front."""
        low, high = self.wall_length(side)
        span = high - low - width
        if span < -1e-9:
            return []
        count = int(max(span, 0.0) / _STEP_M) + 1
        found: list[float] = []
        for u in np.linspace(low + width / 2, high - width / 2, max(count, 2)).tolist():
            u0, u1 = u - width / 2, u + width / 2
            if not self.wall_is_free(side, u0, u1, 0.0, height):
                continue
            if not self.is_free(self.rect_at_wall(side, u, width, depth, gap)):
                continue
            front = self.rect_at_wall(side, u, width - 0.02, clearance, gap + depth)
            if clearance > 0.0 and not self.is_free(front, ignore_clear=True):
                continue
            found.append(u)
        return found

    def take(self, rect: Rect, clearance: Rect | None = None) -> None:
        """Mark a rectangle as occupied, and another to be kept free."""
        self.solids.append(rect)
        if clearance is not None:
            self.clear.append(clearance)

    def stand_at_wall(
        self, model: Model, side: int, u: float, *, clearance: float, gap: float, optional: bool
    ) -> Placed:
        """Place a model at a wall, at one of `positions`."""
        w, d = model.width_m, model.depth_m
        rect = self.rect_at_wall(side, u, w, d, gap)
        front = self.rect_at_wall(side, u, w, clearance, gap + d) if clearance > 0 else None
        self.take(rect, front)
        self.spans.append(
            WallSpan(side=side, low=u - w / 2, high=u + w / 2, z0=0.0, z1=model.height_m)
        )
        return self.at_wall(model, side, u, 0.0, gap=gap, optional=optional)

    def at_wall(
        self,
        model: Model,
        side: int,
        u: float,
        z: float,
        *,
        gap: float = 0.0,
        optional: bool = True,
    ) -> Placed:
        """Return the placement of a model at a wall without marking floor as occupied."""
        x, y, yaw = self.pose_at_wall(side, u, gap)
        return Placed(
            model=model, x=x, y=y, z=z, yaw=yaw, rect=footprint(model, x, y, yaw),
            room=self.room, side=side, optional=optional,
        )  # fmt: skip

    def free_spots(self, width: float, depth: float, margin: float) -> list[tuple[float, float]]:
        """Return centres of free rectangles of this size, at least `margin` from the walls."""
        f = self.floor
        xs = np.arange(f.x0 + width / 2 + margin, f.x1 - width / 2 - margin + 1e-9, 0.15).tolist()
        ys = np.arange(f.y0 + depth / 2 + margin, f.y1 - depth / 2 - margin + 1e-9, 0.15).tolist()
        return [
            (x, y)
            for x in xs
            for y in ys
            if self.is_free(Rect(x - width / 2, y - depth / 2, x + width / 2, y + depth / 2))
        ]

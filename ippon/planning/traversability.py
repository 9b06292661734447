"""Where the robot can stand and drive: a grid of the floor that follows the map."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ippon.geometry import Float64Array, yaw_of
from ippon.mapping.arrays import MapArrays
from ippon.planning.clearance import (
    NO_SITE,
    OBSTACLE,
    OPEN,
    UNSEEN,
    BodyLimits,
    FloorGrid,
    can_turn,
    clearance_at,
    room_facing,
    update_sites,
)
from ippon.planning.columns import (
    COLUMN_BLOCKED,
    COLUMN_CLEAR,
    FLOOR_ABSENT,
    FLOOR_SEEN,
    ColumnBands,
    changed_block_columns,
    read_column_blocks,
)
from ippon.planning.looks import paste
from ippon.robot import RobotProfile

DRIVEN: Final = 1
"""Mark of cells that the robot has stood on."""
CONTACT: Final = 2
"""Mark of cells that count as blocked because the robot touched something there."""
SWEPT: Final = 4
"""Mark of cells that the body has covered with room to spare: a contact was not there."""
_BLIND_MAX_M: Final = 1.5
"""A camera that sees no floor within this does not show where the robot can begin to drive."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TraversabilityConfig:
    """How careful the robot is about what it has not seen and what is close."""

    margin_m: float = 0.02
    """Room beside the body that every move must leave; more closes narrow doors, less squeezes
    through gaps that the map shows a few centimetres too wide."""
    squeeze_margin_m: float = -0.04
    """The same, once nothing else is left to see: the map is up to half a voxel off, and a door
    that it shows a little too narrow may be wide enough. Less squeezes more, and touches more."""
    start_margin_m: float = 0.2
    """The robot starts on floor that it cannot see; a disc this much wider than the body counts
    as floor, and all that the camera cannot see however low it is tilted. More trusts more unseen
    floor."""
    min_seen: float = 0.5
    """Fraction of the body's height that must be known free; more waits for better views."""
    unseen_overlap_m: float = 0.15
    """How far the body may reach over unseen floor; more passes more gaps in the map."""
    clearance_max_m: float = 1.5
    """Obstacles farther away than this do not matter to a path."""
    slow_clearance_m: float = 0.25
    """The robot slows down with less room beside it than this; more drives more carefully."""
    slow_fraction: float = 0.4
    """Fraction of the top speed that is left when something all but touches."""
    contact_length_m: float = 0.25
    """How far ahead of the body the triangle reaches that is closed after a contact."""
    contact_half_angle_rad: float = 0.45
    """Half the opening angle of that triangle; more closes a wider region."""

    def __post_init__(self) -> None:
        """Reject values that would close or open everything."""
        if self.squeeze_margin_m > self.margin_m:
            raise ValueError("squeeze_margin_m must not exceed margin_m")
        if not (0.0 <= self.margin_m <= 0.5 and 0.0 < self.min_seen <= 1.0):
            raise ValueError(
                f"margin_m must lie in 0 to 0.5 and min_seen in 0 to 1; got {self.margin_m}, "
                f"{self.min_seen}"
            )
        if not 0.0 < self.slow_fraction <= 1.0 or self.slow_clearance_m <= 0.0:
            raise ValueError("slow_fraction must lie in (0, 1] and slow_clearance_m above 0")


class Traversability:
    """The floor as the planner sees it, kept up to date block by block."""

    def __init__(self, config: TraversabilityConfig, robot: RobotProfile) -> None:
        self.config = config
        self._robot = robot
        self.limits = _limits_of(config, robot)
        self.margin_m = config.margin_m
        """Room beside the body that every move must leave now."""
        self._revision = -1
        self._bands: ColumnBands | None = None
        self._columns: NDArray[np.uint8] = np.zeros((0, 0), dtype=np.uint8)
        self._marks: NDArray[np.uint8] = np.zeros((0, 0), dtype=np.uint8)
        self._grid: FloorGrid | None = None
        self._floor_z = 0.0
        self._started = False
        self._reread = False

    @property
    def grid(self) -> FloorGrid:
        """The floor; raises before the first `update`."""
        assert self._grid is not None, "update() comes first"
        return self._grid

    @property
    def floor_z_m(self) -> float:
        """Height of the floor that the robot stands on."""
        return self._floor_z

    def update(
        self, arrays: MapArrays, T_world_base: Float64Array
    ) -> tuple[int, int, int, int] | None:
        """Take over what changed in the map.

        Args:
            arrays: The map.
            T_world_base: Where the robot stands.

        Returns:
            Cells (i0, i1, j0, j1) whose distances may have changed, None when nothing did; all of
            them after the grid has grown or the robot has changed floors.
        """
        everything = self._follow_map(arrays, float(T_world_base[2, 3]))
        assert self._bands is not None
        grid = self.grid
        blocks = changed_block_columns(arrays, self._bands, self._revision)
        if arrays.revision.size:
            self._revision = max(self._revision, int(arrays.revision.max()))
        read_column_blocks(
            arrays, self._bands, blocks, self.config.min_seen, grid.origin, self._columns
        )
        self._mark_driven(T_world_base)
        window = np.array([1 << 30, -1, 1 << 30, -1], dtype=np.int64)
        box = (0, grid.kind.shape[0], 0, grid.kind.shape[1])
        if not (everything or self._reread):
            box = self._touched_box(blocks, T_world_base)
        _combine_kernel(self._columns, self._marks, np.array(box), grid.kind, window)
        self._reread = False
        if everything:
            window[:] = box
        return self._refresh(window)

    def _start_radius_m(self, voxel_size: float) -> float:
        """Return the radius of the disc of floor that the robot starts on unseen."""
        radius = self._robot.radius_m + self.config.start_margin_m
        blind = self._robot.floor_in_view_m + voxel_size
        return max(radius, blind) if blind <= _BLIND_MAX_M else radius

    def mark_contact(self, T_world_base: Float64Array) -> None:
        """Close the triangular region ahead of a robot that touched something.

        Where an obstacle of the map is so close before the robot that it explains the contact, only
        the rim of the body towards it is closed: the map was a few centimetres off there, and a
        triangle ahead would close the door that the robot brushed against. Where the body has been
        nothing is closed, so that the way back stays open.
        """
        if self._grid is None:
            return
        v = self._grid.voxel_size
        x, y, yaw = T_world_base[0, 3], T_world_base[1, 3], yaw_of(T_world_base)
        radius = self._extent_m(0.0)
        half_angle = self.config.contact_half_angle_rad
        outer = radius + max(self.config.contact_length_m, v)
        i, j, cx, cy = self._cells_around(x, y, outer / math.cos(half_angle))
        open_yet = self._marks[i, j] & (CONTACT | SWEPT) == 0
        open_yet &= self._grid.kind[i, j] != OBSTACLE
        away = np.hypot(cx - x, cy - y)
        bearing = np.arctan2(cy - y, cx - x)
        touched = self._touched_obstacle(T_world_base)
        rim = np.zeros_like(open_yet)
        if touched is not None:
            radius = self._extent_m(touched - yaw)
            from_touch = np.hypot(
                cx - x - radius * math.cos(touched), cy - y - radius * math.sin(touched)
            )
            rim = open_yet & (from_touch <= 1.2 * v) & (away >= radius - 0.3 * v)
        if not rim.any():
            radius = self._extent_m(0.0)
            ahead, aside = away * np.cos(bearing - yaw), away * np.abs(np.sin(bearing - yaw))
            rim = open_yet & (away >= radius + 0.25 * v) & (ahead > 0.0) & (ahead <= outer)
            # At least one cell wide, however narrow the triangle is where it begins.
            rim &= aside <= np.maximum(ahead * math.tan(half_angle), 0.75 * v)
        self._marks[i[rim], j[rim]] |= CONTACT

    def relax(self) -> bool:
        """Open what contacts closed and squeeze through gaps; tell whether that is anything new."""
        new = bool((self._marks & CONTACT).any()) or self.margin_m > self.config.squeeze_margin_m
        self._marks &= 255 - CONTACT
        self.margin_m = self.config.squeeze_margin_m
        self._reread = True
        return new

    def _touched_obstacle(self, T_world_base: Float64Array) -> float | None:
        """Return the direction of the obstacle that the robot ran into, None for none."""
        grid = self.grid
        x, y = float(T_world_base[0, 3]), float(T_world_base[1, 3])
        reach = self._robot.radius_m + 0.75 * grid.voxel_size
        i, j, cx, cy = self._cells_around(x, y, reach)
        away = np.hypot(cx - x, cy - y)
        off = np.arctan2(cy - y, cx - x) - yaw_of(T_world_base)
        beside = away - self._extents_m(off)
        beside[(grid.kind[i, j] != OBSTACLE) | (np.cos(off) < -0.2)] = np.inf
        if beside.size == 0 or beside.min() > 0.75 * grid.voxel_size:
            return None
        n = np.unravel_index(int(np.argmin(beside)), beside.shape)
        return math.atan2(cy[n] - y, cx[n] - x)

    def clearance(self, x: float, y: float) -> float:
        """Return metres from a point of the floor to the nearest obstacle."""
        return clearance_at(self.grid, float(x), float(y))

    def room_facing(self, x: float, y: float, yaw: float) -> float:
        """Return the room of the body with a heading, as `clearance` of a round one; metres."""
        return room_facing(self.grid, self.limits, float(x), float(y), float(yaw))

    def can_turn(
        self, at: Float64Array, start: float, end: float, margin: float, leave: float
    ) -> bool:
        """Tell whether the body can turn at a (2,) point; see `clearance.can_turn`."""
        x, y = float(at[0]), float(at[1])
        return can_turn(self.grid, self.limits, x, y, start, end, margin, leave)

    def _follow_map(self, arrays: MapArrays, z: float) -> bool:
        """Match the extent of the map and the height of the floor; tell whether either is new."""
        v = arrays.voxel_size
        # A pose that trembles is no other floor.
        apart = max(0.5 * self._robot.max_step_m, 0.25 * v)
        new_floor = self._bands is None or abs(z - self._floor_z) > apart
        if new_floor:
            self._floor_z = z
            self._bands = ColumnBands.of(self._robot, z, v)
        origin = arrays.origin_block[:2] * 8
        shape = (arrays.directory.shape[0] * 8, arrays.directory.shape[1] * 8)
        old = self._grid
        same = old is not None and old.kind.shape == shape and bool((old.origin == origin).all())
        if not same:
            marks = np.zeros(shape, dtype=np.uint8)
            if old is not None:
                paste(self._marks, old.origin - origin, marks)
            self._marks = marks
            self._columns = np.zeros(shape, dtype=np.uint8)
            self._grid = FloorGrid(
                voxel_size=v,
                origin=origin.copy(),
                kind=np.zeros(shape, dtype=np.uint8),
                obstacle=np.full((*shape, 2), NO_SITE, dtype=np.int16),
                unseen=np.full((*shape, 2), NO_SITE, dtype=np.int16),
                cutoff=max(2, math.ceil(self.config.clearance_max_m / v)),
            )
        if new_floor or not same:
            self._revision = -1
        return new_floor or not same

    def _touched_box(
        self, blocks: NDArray[np.int64], T_world_base: Float64Array
    ) -> tuple[int, int, int, int]:
        """Cells whose kind may have changed: those of the blocks, and the marks by the robot."""
        grid = self.grid
        reach = math.ceil((self._robot.radius_m + 1.0) / grid.voxel_size)
        at = np.floor(T_world_base[:2, 3] / grid.voxel_size).astype(np.int64) - grid.origin
        low, high = at - reach, at + reach + 1
        if len(blocks):
            low = np.minimum(low, blocks.min(axis=0) * 8 - grid.origin - 1)
            high = np.maximum(high, blocks.max(axis=0) * 8 - grid.origin + 9)
        nx, ny = grid.kind.shape
        return (
            min(nx, max(0, int(low[0]))),
            max(0, min(nx, int(high[0]))),
            min(ny, max(0, int(low[1]))),
            max(0, min(ny, int(high[1]))),
        )

    def _refresh(self, window: NDArray[np.int64]) -> tuple[int, int, int, int] | None:
        if window[1] < window[0]:
            return None
        grid = self.grid
        reach = grid.cutoff
        box = (
            max(0, int(window[0]) - reach),
            min(grid.kind.shape[0], int(window[1]) + reach),
            max(0, int(window[2]) - reach),
            min(grid.kind.shape[1], int(window[3]) + reach),
        )
        update_sites(grid.kind, OBSTACLE, box, reach, grid.obstacle)
        update_sites(grid.kind, UNSEEN, box, reach, grid.unseen)
        return box

    def _cells_around(self, x: float, y: float, radius: float):
        grid = self.grid
        v = grid.voxel_size
        low = np.floor((np.array([x, y]) - radius) / v).astype(np.int64) - grid.origin
        high = np.floor((np.array([x, y]) + radius) / v).astype(np.int64) - grid.origin + 1
        low = np.clip(low, 0, grid.kind.shape)
        high = np.clip(high, 0, grid.kind.shape)
        i, j = np.meshgrid(np.arange(low[0], high[0]), np.arange(low[1], high[1]), indexing="ij")
        return i, j, (i + grid.origin[0] + 0.5) * v, (j + grid.origin[1] + 0.5) * v

    def _mark_driven(self, T_world_base: Float64Array) -> None:
        """Mark the floor under the body, and at first as much round it as the robot trusts."""
        x, y, yaw = float(T_world_base[0, 3]), float(T_world_base[1, 3]), yaw_of(T_world_base)
        v = self.grid.voxel_size
        if not self._started:
            self._mark_disc((x, y), self._start_radius_m(v), DRIVEN)
            self._started = True
        c, s = math.cos(yaw), math.sin(yaw)
        for dx, dy, radius in self._robot.outline:
            centre = (x + c * dx - s * dy, y + s * dx + c * dy)
            self._mark_disc(centre, radius, DRIVEN)
            self._mark_disc(centre, radius - 0.75 * v, SWEPT)

    def _mark_disc(self, centre: tuple[float, float], radius_m: float, mark: int) -> None:
        i, j, cx, cy = self._cells_around(centre[0], centre[1], radius_m)
        inside = np.hypot(cx - centre[0], cy - centre[1]) <= radius_m
        if mark == SWEPT:
            self._marks[i[inside], j[inside]] &= 255 - CONTACT
        self._marks[i[inside], j[inside]] |= mark

    def _extents_m(self, bearing: Float64Array) -> Float64Array:
        """Return how far the body reaches in directions of the base frame, radians; metres."""
        discs = self._robot.outline
        return np.max([x * np.cos(bearing) + y * np.sin(bearing) + r for x, y, r in discs], axis=0)

    def _extent_m(self, bearing: float) -> float:
        return float(self._extents_m(np.array(bearing, dtype=np.float64)))


def _limits_of(config: TraversabilityConfig, robot: RobotProfile) -> BodyLimits:
    """Return how close a robot's body may come to things."""

    def to_unseen(radius: float) -> float:
        return max(0.5 * radius, radius - config.unseen_overlap_m)

    limits = BodyLimits(
        radius=robot.radius_m,
        unseen_radius=to_unseen(robot.radius_m),
        slow_clearance=config.slow_clearance_m,
        slow_fraction=config.slow_fraction,
        speed=robot.max_linear_m_s,
    )
    if robot.is_round:
        return limits
    # Driven either way: an edge of the roadmap is for both directions.
    discs = sorted({(k * x, k * y, r, to_unseen(r)) for x, y, r in robot.outline for k in (1, -1)})
    return limits._replace(
        half_width=robot.half_width_m,
        unseen_half_width=to_unseen(robot.half_width_m),
        discs=np.array(discs, dtype=np.float64),
    )


@njit(cache=True, nogil=True)
def _combine_kernel(columns, marks, box, kind, window):
    nx, ny = columns.shape
    for i in range(box[0], box[1]):
        for j in range(box[2], box[3]):
            floor, absent = 0, 0
            for a in range(max(0, i - 1), min(nx, i + 2)):
                for b in range(max(0, j - 1), min(ny, j + 2)):
                    floor += 1 if columns[a, b] & FLOOR_SEEN else 0
                    absent += 1 if columns[a, b] & FLOOR_ABSENT else 0
            value = columns[i, j] & 3
            # A floor seen from afar has holes of single voxels, and a ray that slips through the
            # floor's edge empties one: neighbours decide. Three make an edge, and the column before
            # it counts as the drop: nobody squeezes past that by half a voxel.
            if value == COLUMN_BLOCKED or absent >= 3 or marks[i, j] & CONTACT:
                now = OBSTACLE
            elif marks[i, j] & DRIVEN or (value == COLUMN_CLEAR and floor >= 3):
                now = OPEN
            else:
                now = UNSEEN
            if now != kind[i, j]:
                kind[i, j] = now
                window[0] = min(window[0], i)
                window[1] = max(window[1], i + 1)
                window[2] = min(window[2], j)
                window[3] = max(window[3], j + 1)

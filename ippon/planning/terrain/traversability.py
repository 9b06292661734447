"""Traversability of the floor: a grid that is updated from the map, contacts and driven poses."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ippon.command import Command
from ippon.compiling import njit
from ippon.geometry import Float64Array, yaw_of
from ippon.mapping.arrays import MapArrays
from ippon.planning.terrain.body_limits import body_limits_of
from ippon.planning.terrain.clearance import clearance_at, clearance_at_pose
from ippon.planning.terrain.floor_grid import (
    BEYOND_CUTOFF,
    OBSTACLE,
    OPEN,
    UNSEEN,
    FloorGrid,
    update_nearest_offsets,
)
from ippon.planning.terrain.motion_check import can_turn, free_turn
from ippon.planning.terrain.obstacle_columns import (
    COLUMN_BLOCKED,
    COLUMN_CLEAR,
    COLUMN_UNSEEN,
    DROP_COLUMNS,
    FLOOR_ABSENT,
    FLOOR_SEEN,
    HeightBands,
    changed_block_columns,
    classify_columns,
    height_tolerance_m,
)
from ippon.planning.terrain.traversal_record import CONTACT, DRIVEN, TraversalRecord
from ippon.robot import RobotProfile


@dataclass(frozen=True, slots=True, kw_only=True)
class TraversabilityConfig:
    """Margins to obstacles and to unseen floor."""

    margin_m: float = 0.02
    """Free space beside the body that every move must leave; more closes narrow doors, less drives
    through gaps that the map shows a few centimetres too wide."""
    comfort_m: float = 0.05
    """Free space beside the body, above the margin, that viewpoints and straight edges leave, since
    a voxel is up to half its edge off the surface. More leaves tighter places to the local planner,
    which keeps to their middle."""
    squeeze_margin_m: float = -0.04
    """`margin_m` before a search gives up: the map is up to half a voxel off, and a door that it
    shows too narrow may be wide enough. Less tries narrower gaps and touches more."""
    start_margin_m: float = 0.2
    """The robot starts on floor that it cannot see: a disc this much wider than the body counts as
    floor, and so does all floor below the camera's lowest view. More trusts more unseen floor."""
    min_seen: float = 0.5
    """Fraction of the body's height that must be known free; more needs better views."""
    unseen_overlap_m: float = 0.15
    """How far the body may reach over unseen floor; more passes more gaps in the map."""
    clearance_max_m: float = 1.5
    """Distances to obstacles are computed up to this, for a wide body up to what it needs; more
    costs time."""
    slow_clearance_m: float = 0.25
    """The robot slows down with less free space beside it than this; more drives more slowly."""
    slow_fraction: float = 0.4
    """Fraction of the top speed that remains when an obstacle almost touches the body."""
    contact_length_m: float = 0.25
    """Length of the triangle ahead of the body that is closed after a contact; more closes more."""
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
    """The floor grid, updated block by block, with the body's limits and the current margin."""

    def __init__(self, config: TraversabilityConfig, robot: RobotProfile) -> None:
        self.config = config
        self._robot = robot
        self.limits = body_limits_of(
            robot,
            unseen_overlap_m=config.unseen_overlap_m,
            slow_clearance_m=config.slow_clearance_m,
            slow_fraction=config.slow_fraction,
        )
        self.margin_m = config.margin_m
        """Free space beside the body that every move must leave now, metres."""
        self._revision = -1
        self._bands: HeightBands | None = None
        self._columns: NDArray[np.uint8] = np.zeros((0, 0), dtype=np.uint8)
        self._record = TraversalRecord(
            robot,
            start_margin_m=config.start_margin_m,
            contact_length_m=config.contact_length_m,
            contact_half_angle_rad=config.contact_half_angle_rad,
        )
        self._grid = _empty_grid()
        self._floor_z = 0.0
        self._reread = False
        self._recheck = False

    @property
    def grid(self) -> FloorGrid:
        """The floor; it has no cells before the first `update`."""
        return self._grid

    @property
    def floor_z_m(self) -> float:
        """Height of the floor that the robot stands on."""
        return self._floor_z

    @property
    def everywhere(self) -> tuple[int, int, int, int]:
        """All cells (i0, i1, j0, j1)."""
        nx, ny = self._grid.kind.shape
        return 0, nx, 0, ny

    def update(
        self, arrays: MapArrays, T_world_base: Float64Array
    ) -> tuple[int, int, int, int] | None:
        """Update the grid where the map has changed.

        Args:
            arrays: The map.
            T_world_base: Pose of the robot.

        Returns:
            Cells (i0, i1, j0, j1) whose distances may have changed, None when nothing did; all of
            them after the grid has grown, the robot has changed floors or the margin has grown.
        """
        bands, everything = self._follow_map(arrays, float(T_world_base[2, 3]))
        grid = self.grid
        blocks = changed_block_columns(arrays, bands, self._revision)
        if arrays.revision.size:
            self._revision = max(self._revision, int(arrays.revision.max()))
        classify_columns(arrays, bands, blocks, self.config.min_seen, grid.origin, self._columns)
        self._record.record_pose(grid, T_world_base)
        window = np.array([1 << 30, -1, 1 << 30, -1], dtype=np.int64)
        box = self.everywhere
        everything = everything or self._recheck
        if not (everything or self._reread):
            box = self._touched_box(blocks, T_world_base)
        _combine_kernel(self._columns, self._record.cells, np.array(box), grid.kind, window)
        self._reread = self._recheck = False
        if everything:
            window[:] = box
        return self._refresh(window)

    def note_height(self, z_m: float) -> None:
        """Take over the height of the base in a frame; see `TraversalRecord.note_height`."""
        self._record.note_height(z_m)

    def mark_contact(self, T_world_base: Float64Array, motion: Command | None = None) -> None:
        """Close the region of a contact; see `TraversalRecord.mark_contact`."""
        self._record.mark_contact(self._grid, T_world_base, motion)

    def mark_unreachable(self, xy: tuple[float, float]) -> None:
        """Close the cells around a point; see `TraversalRecord.mark_unreachable`."""
        self._record.mark_unreachable(self._grid, xy)
        self._reread = True

    def relax(self) -> bool:
        """Reopen cells closed by contacts and reduce the margin; return whether any changed."""
        reopened = self._record.reopen_contacts()
        self._reread = self._reread or reopened
        return self.squeeze() or reopened

    def squeeze(self) -> bool:
        """Reduce the margin; return whether it was larger."""
        larger = self.margin_m > self.config.squeeze_margin_m
        self.margin_m = self.config.squeeze_margin_m
        return larger

    def restore(self) -> None:
        """Leave the full margin again, and close the cells of contacts that `relax` reopened.

        If any was reduced or reopened, the next `update` returns every cell.
        """
        reopened = self._record.close_reopened()
        self._recheck = self._recheck or reopened or self.margin_m < self.config.margin_m
        self.margin_m = self.config.margin_m

    def clearance(self, x: float, y: float) -> float:
        """Return the distance from a point to the nearest obstacle, metres."""
        return clearance_at(self.grid, float(x), float(y))

    def clearance_at_pose(self, x: float, y: float, yaw: float) -> float:
        """Return the clearance of the body at a pose, metres; see `clearance.clearance_at_pose`."""
        return clearance_at_pose(self.grid, self.limits, float(x), float(y), float(yaw))

    def can_turn(
        self, at: Float64Array, start: float, end: float, margin: float, leave: float
    ) -> bool:
        """Return whether the body can turn at a (2,) point; see `motion_check.can_turn`."""
        x, y = float(at[0]), float(at[1])
        return can_turn(self.grid, self.limits, x, y, start, end, margin, leave)

    def free_turn(self, T_world_base: Float64Array) -> tuple[float, float]:
        """Return how far the body can turn where it stands, right and left, radians.

        See `motion_check.free_turn`. The margin of moves is not asked for.
        """
        x, y, yaw = float(T_world_base[0, 3]), float(T_world_base[1, 3]), yaw_of(T_world_base)
        leave = self.clearance_at_pose(x, y, yaw)
        return free_turn(self.grid, self.limits, x, y, yaw, min(self.margin_m, 0.0), leave)

    @property
    def _farthest_m(self) -> float:
        """Distance up to which obstacles matter, metres: to a wide body also farther away."""
        config = self.config
        beside_m = max(config.margin_m + config.comfort_m, config.slow_clearance_m)
        return max(config.clearance_max_m, self.limits.radius + beside_m)

    def _follow_map(self, arrays: MapArrays, z: float) -> tuple[HeightBands, bool]:
        """Match extent and floor height; return the bands, and whether any changed."""
        v = arrays.voxel_size
        apart = height_tolerance_m(self._robot, v)
        bands = self._bands
        new_floor = bands is None or abs(z - self._floor_z) > apart
        if bands is None or new_floor:
            self._floor_z = z
            self._bands = bands = HeightBands.of(self._robot, z, v)
        origin = arrays.origin_block[:2] * 8
        shape = (arrays.directory.shape[0] * 8, arrays.directory.shape[1] * 8)
        old = self._grid
        same = old.cutoff > 0 and old.kind.shape == shape and bool((old.origin == origin).all())
        if not same:
            self._record.resize(shape, old.origin - origin)
            self._columns = np.zeros(shape, dtype=np.uint8)
            self._grid = FloorGrid(
                voxel_size=v,
                origin=origin.copy(),
                kind=np.zeros(shape, dtype=np.uint8),
                obstacle=np.full((*shape, 2), BEYOND_CUTOFF, dtype=np.int16),
                unseen=np.full((*shape, 2), BEYOND_CUTOFF, dtype=np.int16),
                cutoff=max(2, math.ceil(self._farthest_m / v)),
            )
        if new_floor:
            self._record.stand_on(z)
            # Only columns with blocks at the new height are read again.
            self._columns[:] = COLUMN_UNSEEN
        if new_floor or not same:
            self._revision = -1
        return bands, new_floor or not same

    def _touched_box(
        self, blocks: NDArray[np.int64], T_world_base: Float64Array
    ) -> tuple[int, int, int, int]:
        """Return the cells whose kind may have changed: in the blocks, and near the robot."""
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
        update_nearest_offsets(grid.kind, OBSTACLE, box, reach, grid.obstacle)
        update_nearest_offsets(grid.kind, UNSEEN, box, reach, grid.unseen)
        return box


def _empty_grid() -> FloorGrid:
    """Return a grid without cells: nothing is known of the floor."""
    return FloorGrid(
        voxel_size=1.0,
        origin=np.zeros(2, dtype=np.int64),
        kind=np.zeros((0, 0), dtype=np.uint8),
        obstacle=np.zeros((0, 0, 2), dtype=np.int16),
        unseen=np.zeros((0, 0, 2), dtype=np.int16),
        cutoff=0,
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
            # Distant floor has holes of single voxels, so neighbours decide.
            if value == COLUMN_BLOCKED or absent >= DROP_COLUMNS or marks[i, j] & CONTACT:
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

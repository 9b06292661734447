"""What the body has shown of the floor: where it stood, what it swept over, what it ran into."""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ippon.geometry import Float64Array, yaw_of
from ippon.planning.clearance import OBSTACLE, FloorGrid
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


class FloorMarks:
    """Marks of the cells of a `FloorGrid`; they stay while the map changes and grows."""

    def __init__(
        self,
        robot: RobotProfile,
        *,
        start_margin_m: float,
        contact_length_m: float,
        contact_half_angle_rad: float,
    ) -> None:
        """Begin with no cells; see `TraversabilityConfig` for what the numbers mean."""
        self._robot = robot
        self._start_margin_m = start_margin_m
        self._contact_length_m = contact_length_m
        self._half_angle_rad = contact_half_angle_rad
        self._started = False
        self.cells: NDArray[np.uint8] = np.zeros((0, 0), dtype=np.uint8)
        """(X, Y) `DRIVEN`, `CONTACT` and `SWEPT`, added up; cells of the grid."""

    def fit(self, shape: tuple[int, int], offset: NDArray[np.int64]) -> None:
        """Follow the grid's extent.

        Args:
            shape: Cells along x and y from now on.
            offset: (2,) cell that what was cell (0, 0) becomes.
        """
        cells = np.zeros(shape, dtype=np.uint8)
        paste(self.cells, offset, cells)
        self.cells = cells

    def note_body(self, grid: FloorGrid, T_world_base: Float64Array) -> None:
        """Mark the floor under the body, and at first as much round it as the robot trusts."""
        x, y, yaw = float(T_world_base[0, 3]), float(T_world_base[1, 3]), yaw_of(T_world_base)
        v = grid.voxel_size
        if not self._started:
            self._mark_disc(grid, (x, y), self._start_radius_m(v), DRIVEN)
            self._started = True
        c, s = math.cos(yaw), math.sin(yaw)
        for dx, dy, radius in self._robot.outline:
            centre = (x + c * dx - s * dy, y + s * dx + c * dy)
            self._mark_disc(grid, centre, radius, DRIVEN)
            self._mark_disc(grid, centre, radius - 0.75 * v, SWEPT)

    def mark_contact(self, grid: FloorGrid, T_world_base: Float64Array) -> None:
        """Close the triangular region ahead of a robot that touched something.

        Where an obstacle of the map is so close before the robot that it explains the contact, only
        the rim of the body towards it is closed: the map was a few centimetres off there, and a
        triangle ahead would close the door that the robot brushed against. Where the body has been
        nothing is closed, so that the way back stays open.
        """
        v = grid.voxel_size
        x, y, yaw = T_world_base[0, 3], T_world_base[1, 3], yaw_of(T_world_base)
        nose = self._extent_m(0.0)
        outer = nose + max(self._contact_length_m, v)
        i, j, cx, cy = _cells_around(grid, x, y, outer / math.cos(self._half_angle_rad))
        open_yet = self.cells[i, j] & (CONTACT | SWEPT) == 0
        open_yet &= grid.kind[i, j] != OBSTACLE
        away = np.hypot(cx - x, cy - y)
        touched = self._touched_obstacle(grid, T_world_base)
        rim = np.zeros_like(open_yet)
        if touched is not None:
            radius = self._extent_m(touched - yaw)
            from_touch = np.hypot(
                cx - x - radius * math.cos(touched), cy - y - radius * math.sin(touched)
            )
            rim = open_yet & (from_touch <= 1.2 * v) & (away >= radius - 0.3 * v)
        if not rim.any():
            bearing = np.arctan2(cy - y, cx - x)
            ahead, aside = away * np.cos(bearing - yaw), away * np.abs(np.sin(bearing - yaw))
            rim = open_yet & (away >= nose + 0.25 * v) & (ahead > 0.0) & (ahead <= outer)
            # At least one cell wide, however narrow the triangle is where it begins.
            rim &= aside <= np.maximum(ahead * math.tan(self._half_angle_rad), 0.75 * v)
        self.cells[i[rim], j[rim]] |= CONTACT

    def forget_contacts(self) -> bool:
        """Open what contacts closed; tell whether there was anything."""
        closed = bool((self.cells & CONTACT).any())
        self.cells &= 255 - CONTACT
        return closed

    def _touched_obstacle(self, grid: FloorGrid, T_world_base: Float64Array) -> float | None:
        """Return the direction of the obstacle that the robot ran into, None for none."""
        x, y = float(T_world_base[0, 3]), float(T_world_base[1, 3])
        reach = self._robot.radius_m + 0.75 * grid.voxel_size
        i, j, cx, cy = _cells_around(grid, x, y, reach)
        away = np.hypot(cx - x, cy - y)
        off = np.arctan2(cy - y, cx - x) - yaw_of(T_world_base)
        beside = away - self._extents_m(off)
        beside[(grid.kind[i, j] != OBSTACLE) | (np.cos(off) < -0.2)] = np.inf
        if beside.size == 0 or beside.min() > 0.75 * grid.voxel_size:
            return None
        n = np.unravel_index(int(np.argmin(beside)), beside.shape)
        return math.atan2(cy[n] - y, cx[n] - x)

    def _start_radius_m(self, voxel_size: float) -> float:
        """Return the radius of the disc of floor that the robot starts on unseen."""
        radius = self._robot.radius_m + self._start_margin_m
        blind = self._robot.floor_in_view_m + voxel_size
        return max(radius, blind) if blind <= _BLIND_MAX_M else radius

    def _mark_disc(
        self, grid: FloorGrid, centre: tuple[float, float], radius_m: float, mark: int
    ) -> None:
        i, j, cx, cy = _cells_around(grid, centre[0], centre[1], radius_m)
        inside = np.hypot(cx - centre[0], cy - centre[1]) <= radius_m
        if mark == SWEPT:
            self.cells[i[inside], j[inside]] &= 255 - CONTACT
        self.cells[i[inside], j[inside]] |= mark

    def _extents_m(self, bearing: Float64Array) -> Float64Array:
        """Return how far the body reaches in directions of the base frame, radians; metres."""
        discs = self._robot.outline
        return np.max([x * np.cos(bearing) + y * np.sin(bearing) + r for x, y, r in discs], axis=0)

    def _extent_m(self, bearing: float) -> float:
        return float(self._extents_m(np.array(bearing, dtype=np.float64)))


def _cells_around(
    grid: FloorGrid, x: float, y: float, radius: float
) -> tuple[NDArray[np.int64], NDArray[np.int64], Float64Array, Float64Array]:
    """Return the square of cells that a circle lies in, as far as the grid goes.

    Returns:
        Their i and j and the world x and y of their centres, metres, each (N, M).
    """
    v = grid.voxel_size
    low = np.floor((np.array([x, y]) - radius) / v).astype(np.int64) - grid.origin
    high = np.floor((np.array([x, y]) + radius) / v).astype(np.int64) - grid.origin + 1
    low = np.clip(low, 0, grid.kind.shape)
    high = np.clip(high, 0, grid.kind.shape)
    i, j = np.meshgrid(np.arange(low[0], high[0]), np.arange(low[1], high[1]), indexing="ij")
    return i, j, (i + grid.origin[0] + 0.5) * v, (j + grid.origin[1] + 0.5) * v

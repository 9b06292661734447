"""The floor cells that the body has covered, and those closed after a contact."""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ippon.command import Command
from ippon.frame import FLOORS_APART_M
from ippon.geometry import Float64Array, yaw_of
from ippon.planning.array_overlap import copy_overlap
from ippon.planning.terrain.floor_grid import OBSTACLE, FloorGrid
from ippon.robot import RobotProfile, disc_centres

DRIVEN: Final = 1
"""Mark of cells that the body has covered."""
CONTACT: Final = 2
"""Mark of cells that are closed after a contact."""
SWEPT: Final = 4
"""Mark of cells well inside an earlier footprint, where no contact can have been."""
REOPENED: Final = 8
"""Mark of cells that were closed after a contact and are open again until a search ends."""
_WELL_INSIDE: Final = 0.75
"""Depth inside the footprint, in cells, from which a cell is well inside."""
_STANDS_M_S: Final = 0.02
"""A robot commanded to drive no faster than this turns on the spot."""
_AGAIN_M: Final = 0.3
"""Distance within which a second contact that closes nothing is the same contact again."""
_UNREACHABLE_M: Final = 0.1
"""Radius that is closed around a point that could not be reached."""
_BLIND_MAX_M: Final = 1.5
"""Farthest nearest visible floor for which the blind floor before the robot counts as free."""


class TraversalRecord:
    """Marks of the cells of a `FloorGrid` that persist while the map changes and grows.

    Each floor of a building has its own: the robot returns to those of a floor that it left.
    """

    def __init__(
        self,
        robot: RobotProfile,
        *,
        start_margin_m: float,
        contact_length_m: float,
        contact_half_angle_rad: float,
    ) -> None:
        """Begin with no cells; see `TraversabilityConfig` for the parameters."""
        self._robot = robot
        self._start_margin_m = start_margin_m
        self._contact_length_m = contact_length_m
        self._half_angle_rad = contact_half_angle_rad
        self._started = False
        self._floor_z_m: float | None = None
        self._stood_z_m: float | None = None
        """Height that the robot stood at last; `_floor_z_m` is that where its floor began."""
        self._taken_to_z_m: float | None = None
        """Height that the robot was taken to at once, as by a lift; None once it has left it."""
        self._others: list[tuple[float, NDArray[np.uint8]]] = []
        """Height and marks of the floors that the robot has left."""
        self._nothing_closed_at: tuple[float, float] | None = None
        """Where the robot was at the last contact that closed no cell."""
        self.cells: NDArray[np.uint8] = np.zeros((0, 0), dtype=np.uint8)
        """(X, Y) bits `DRIVEN`, `CONTACT`, `SWEPT` and `REOPENED` of the grid's cells on the
        present floor."""

    def resize(self, shape: tuple[int, int], offset: NDArray[np.int64]) -> None:
        """Adopt the extent of the grid.

        Args:
            shape: New number of cells along x and y.
            offset: (2,) new index of the old cell (0, 0).
        """
        self.cells = _moved(self.cells, shape, offset)
        self._others = [(z, _moved(cells, shape, offset)) for z, cells in self._others]

    def note_height(self, z_m: float) -> None:
        """Take over the height of the base, also of frames that nothing is planned for.

        A robot that climbs is higher in each frame by a little; one that is taken is at once.
        """
        before, self._stood_z_m = self._stood_z_m, z_m
        if before is not None and abs(z_m - before) > FLOORS_APART_M:
            self._taken_to_z_m = z_m
        elif self._taken_to_z_m is not None and abs(z_m - self._taken_to_z_m) > FLOORS_APART_M:
            self._taken_to_z_m = None

    def stand_on(self, floor_z_m: float) -> None:
        """Take up the marks of the floor at a height, none for a floor that is new.

        A robot that was taken to a new floor, as by a lift, begins there as on the first one. One
        that climbs to it does not: unseen floor beside stairs may be a drop.
        """
        self.note_height(floor_z_m)
        here, was_taken = self._floor_z_m, self._taken_to_z_m is not None
        if here is None:
            self._floor_z_m = floor_z_m
        elif abs(floor_z_m - here) > FLOORS_APART_M:
            self._others.append((here, self.cells))
            new = (floor_z_m, np.zeros_like(self.cells))
            known = [one for one in self._others if abs(one[0] - floor_z_m) <= FLOORS_APART_M]
            self._floor_z_m, self.cells = min(
                known, key=lambda one: abs(one[0] - floor_z_m), default=new
            )
            self._others = [one for one in self._others if one[1] is not self.cells]
            self._started = self._started and (bool(known) or not was_taken)

    def record_pose(self, grid: FloorGrid, T_world_base: Float64Array) -> None:
        """Mark the floor under the body, and where the robot begins a margin around it."""
        x, y, yaw = float(T_world_base[0, 3]), float(T_world_base[1, 3]), yaw_of(T_world_base)
        v = grid.voxel_size
        if not self._started:
            self._mark_disc(grid, (x, y), self._start_radius_m(v), DRIVEN)
            self._started = True
        outline = self._robot.outline
        for (cx, cy), (_, _, radius) in zip(
            disc_centres(outline, np.array([[x, y, yaw]]))[0].tolist(), outline, strict=True
        ):
            centre = (cx, cy)
            self._mark_disc(grid, centre, radius, DRIVEN)
            self._mark_disc(grid, centre, radius - _WELL_INSIDE * v, SWEPT)

    def mark_contact(
        self, grid: FloorGrid, T_world_base: Float64Array, motion: Command | None = None
    ) -> None:
        """Close the region of a contact: a triangle ahead of the robot (Sec. Traversability).

        If a mapped obstacle is close enough to explain the contact, only the rim of the body
        towards it is closed: the map is a few centimetres off there, and a triangle would close the
        door that the robot brushed against. If the robot drove backwards, the triangle lies behind
        it; if a long body turned on the spot, the cells that its outline approached are closed.
        Cells that the body has covered stay open, so that the robot can return; but where it has
        touched something twice and all cells are of that kind, those that it does not stand on are
        closed, too: it would drive against the same thing for ever.

        Args:
            grid: The floor.
            T_world_base: Pose of the robot.
            motion: The last command; None for straight ahead.
        """
        v = grid.voxel_size
        x, y, yaw = float(T_world_base[0, 3]), float(T_world_base[1, 3]), yaw_of(T_world_base)
        backwards = motion is not None and motion.linear_m_s < 0.0
        nose = self._extent_m(math.pi if backwards else 0.0)
        outer = nose + max(self._contact_length_m, v)
        i, j, cx, cy = _cells_around(grid, x, y, outer / math.cos(self._half_angle_rad))
        dx, dy = cx - x, cy - y
        heading = yaw + math.pi if backwards else yaw
        ahead = dx * math.cos(heading) + dy * math.sin(heading)
        away = np.hypot(dx, dy)
        beside, nx, ny = self._from_body(dx, dy, yaw)
        turn = 0.0 if motion is None else self._turn_of(motion)
        touched = np.where(grid.kind[i, j] == OBSTACLE, beside, np.inf)
        if not turn:
            touched[ahead < -0.2 * away] = np.inf
        not_closed = (self.cells[i, j] & CONTACT == 0) & (grid.kind[i, j] != OBSTACLE)
        open_yet = not_closed & (self.cells[i, j] & SWEPT == 0)
        closed, rim = np.zeros_like(open_yet), np.zeros_like(open_yet)
        if touched.min(initial=np.inf) <= 0.75 * v:
            at = np.unravel_index(int(np.argmin(touched)), touched.shape)
            px, py = dx[at] - beside[at] * nx[at], dy[at] - beside[at] * ny[at]
            rim = np.hypot(dx - px, dy - py) <= 1.2 * v
            closed = open_yet & rim & (beside >= -0.3 * v)
        if not closed.any() and turn:
            # Cells that the outline approaches during the turn.
            comes = turn * (dx * ny - dy * nx) > 0.3 * away
            closed = open_yet & comes & (away > self._robot.half_width_m)
            closed &= (beside >= 0.0) & (beside <= v)
        elif not closed.any():
            aside = np.abs(dy * math.cos(heading) - dx * math.sin(heading))
            triangle = (away >= nose + 0.25 * v) & (ahead > 0.0) & (ahead <= outer)
            # At least one cell wide at the tip of the triangle.
            triangle &= aside <= np.maximum(ahead * math.tan(self._half_angle_rad), 0.75 * v)
            closed = open_yet & triangle
            if not closed.any() and self._is_again(x, y):
                rim &= beside >= -_WELL_INSIDE * v
                closed = not_closed & (rim if (not_closed & rim).any() else triangle)
        self._nothing_closed_at = None if closed.any() else (x, y)
        self.cells[i[closed], j[closed]] |= CONTACT

    def mark_unreachable(self, grid: FloorGrid, xy: tuple[float, float]) -> None:
        """Close the cells around a point that the robot's own navigation could not reach.

        Args:
            grid: The floor.
            xy: World x and y, metres.
        """
        self._mark_disc(grid, xy, max(_UNREACHABLE_M, grid.voxel_size), CONTACT)

    def reopen_contacts(self) -> bool:
        """Reopen the cells of this floor closed by contacts; return whether there were any."""
        return _remark(self.cells, CONTACT, REOPENED)

    def close_reopened(self) -> bool:
        """Close the reopened cells of all floors again; return whether there were any.

        Those that the body has covered since stay open.
        """
        closed = _remark(self.cells, REOPENED, CONTACT)
        for _, cells in self._others:
            closed |= _remark(cells, REOPENED, CONTACT)
        return closed

    def _is_again(self, x: float, y: float) -> bool:
        """Return whether the last contact was here, too, and closed nothing."""
        last = self._nothing_closed_at
        return last is not None and math.dist(last, (x, y)) <= _AGAIN_M

    def _turn_of(self, motion: Command) -> float:
        """Return the sign of a long body's turn on the spot; 0 if it does not turn on the spot."""
        if self._robot.is_round or abs(motion.linear_m_s) > _STANDS_M_S:
            return 0.0
        return float(np.sign(motion.yaw_rate_rad_s))

    def _from_body(
        self, dx: Float64Array, dy: Float64Array, yaw: float
    ) -> tuple[Float64Array, Float64Array, Float64Array]:
        """Return the signed distance of points from the body, and the direction away from it.

        Args:
            dx: World x from the base's centre, metres; likewise dy.
            dy: See dx.
            yaw: Heading of the base, radians.

        Returns:
            Metres, negative inside, and the unit vector's x and y, each of the shape of `dx`.
        """
        outline = self._robot.outline
        centres = disc_centres(outline, np.array([[0.0, 0.0, yaw]]))[0]
        beside = np.full(dx.shape, np.inf)
        nx, ny = np.zeros(dx.shape), np.zeros(dx.shape)
        for (x, y), (_, _, radius) in zip(centres, outline, strict=True):
            ex, ey = dx - x, dy - y
            away = np.hypot(ex, ey)
            nearer = away - radius < beside
            beside[nearer] = away[nearer] - radius
            scale = np.maximum(away[nearer], 1e-9)
            nx[nearer], ny[nearer] = ex[nearer] / scale, ey[nearer] / scale
        return beside, nx, ny

    def _start_radius_m(self, voxel_size: float) -> float:
        """Return the radius of the unseen disc of floor that the robot starts on, metres."""
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
        if mark == DRIVEN:
            self.cells[i[inside], j[inside]] &= 255 - REOPENED
        self.cells[i[inside], j[inside]] |= mark

    def _extent_m(self, bearing: float) -> float:
        """Return the extent of the body in a direction of the base frame (radians), metres."""
        c, s = math.cos(bearing), math.sin(bearing)
        return max(x * c + y * s + radius for x, y, radius in self._robot.outline)


def _remark(cells: NDArray[np.uint8], mark: int, other: int) -> bool:
    """Replace a mark of cells by another; return whether any had it."""
    marked = cells & mark > 0
    cells[marked] = (cells[marked] & (255 - mark)) | other
    return bool(marked.any())


def _moved(
    cells: NDArray[np.uint8], shape: tuple[int, int], offset: NDArray[np.int64]
) -> NDArray[np.uint8]:
    """Return cells on a grid of another extent; their cell (0, 0) goes to `offset`."""
    moved = np.zeros(shape, dtype=np.uint8)
    copy_overlap(cells, offset, moved)
    return moved


def _cells_around(
    grid: FloorGrid, x: float, y: float, radius: float
) -> tuple[NDArray[np.int64], NDArray[np.int64], Float64Array, Float64Array]:
    """Return the square of cells around a circle, clipped to the grid.

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

"""Grid of the floor positions at which a robot's body fits, drawn from the triangles of a home."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from ippon.compiling import njit
from ippon.errors import SceneError
from ippon.robot import RobotProfile
from ippon.simulation.scene import Scene

_ndimage: Any = ndimage
"""Untyped, because the return types of its functions depend on arguments."""

CELL_M = 0.05
FINE_CELL_M = 0.025
"""Edge of cells for scoring; at 5 cm, gaps that the body just fits through come out closed."""

_MARGIN_M = 0.3
_MAX_CELLS = 16_000_000
"""100 m by 100 m at `FINE_CELL_M`; the box of a large building is larger than its floor."""
_FLOOR_GAP_M = 0.15
"""Gaps between floors that a base rolls over, such as a sill in a doorway."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NavigationGrid:
    """Cells of the floor, indexed [x, y]; the centre of cell (0, 0) is `origin`."""

    origin: tuple[float, float]
    """World x and y of the centre of cell (0, 0), metres."""
    cell_m: float
    clearance_m: NDArray[np.float64]
    """(X, Y) metres from a cell to the nearest obstacle or drop."""
    free: NDArray[np.bool_]
    """(X, Y) whether the body's centre may be in the cell."""
    region: NDArray[np.int32]
    """(X, Y) number of the connected free region, 0 where not free."""

    def cell_at(self, x: float, y: float) -> tuple[int, int]:
        """Return the cell of a point; it may lie outside the grid."""
        return (
            int(np.floor((x - self.origin[0]) / self.cell_m + 0.5)),
            int(np.floor((y - self.origin[1]) / self.cell_m + 0.5)),
        )

    def point_at(self, i: int, j: int) -> tuple[float, float]:
        """Return the centre of a cell in metres."""
        return self.origin[0] + i * self.cell_m, self.origin[1] + j * self.cell_m

    def points_of(self, cells: NDArray[np.intp]) -> NDArray[np.float64]:
        """Return (N, 2) centres of (N, 2) cells in metres."""
        return np.asarray(cells, np.float64) * self.cell_m + np.array(self.origin)

    def contains(self, i: int, j: int) -> bool:
        """Tell whether the grid has this cell."""
        return 0 <= i < self.free.shape[0] and 0 <= j < self.free.shape[1]

    def nearest_free(self, x: float, y: float, within_m: float = 0.3) -> tuple[int, int] | None:
        """Return the free cell nearest to a point, None if none is within `within_m`."""
        i, j = self.cell_at(x, y)
        reach = int(np.ceil(within_m / self.cell_m)) + 1
        i0, j0 = max(i - reach, 0), max(j - reach, 0)
        window = self.free[i0 : max(i + reach + 1, 0), j0 : max(j + reach + 1, 0)]
        cells = np.argwhere(window) + np.array([i0, j0])
        if len(cells) == 0:
            return None
        distance = np.hypot(*(self.points_of(cells) - (x, y)).T)
        best = int(np.argmin(distance))
        if distance[best] > within_m:
            return None
        return int(cells[best, 0]), int(cells[best, 1])


def navigation_grid(
    scene: Scene,
    *,
    radius_m: float,
    height_m: float,
    max_step_m: float,
    floor_z_m: float = 0.0,
    cell_m: float = CELL_M,
) -> NavigationGrid:
    """Return the navigation grid of a home.

    A cell is blocked if a triangle crosses it between `max_step_m` and `height_m` above the floor,
    or if the floor is missing. A cell is free if no blocked cell is within `radius_m`.

    Args:
        scene: The home.
        radius_m: Radius of the body.
        height_m: Height of the body.
        max_step_m: Highest step, up or down.
        floor_z_m: Height of the floor.
        cell_m: Edge of a cell.

    Raises:
        SceneError: The home has no floor at that height, or is too large.
    """
    triangles = scene.vertices[scene.faces].astype(np.float64)
    triangles[..., 2] -= floor_z_m
    return grid_of_triangles(
        triangles, radius_m=radius_m, height_m=height_m, max_step_m=max_step_m, cell_m=cell_m
    )


def grid_of_triangles(
    triangles: NDArray[np.float64],
    *,
    radius_m: float,
    height_m: float,
    max_step_m: float,
    cell_m: float = CELL_M,
) -> NavigationGrid:
    """Return the grid of (T, 3, 3) triangles whose floor is at z = 0; see `navigation_grid`."""
    cells = FloorCells.under(triangles, max_step_m, cell_m)
    taken = cells.cells_between(triangles, max_step_m, height_m)
    return cells.grid(taken | ~cells.floor(triangles, max_step_m), radius_m)


@dataclass(frozen=True, slots=True, kw_only=True)
class FloorCells:
    """Raster of the floor of a home, independent of a body."""

    low: tuple[float, float]
    """World x and y of the low corner of cell (0, 0), metres."""
    shape: tuple[int, int]
    cell_m: float

    @classmethod
    def under(
        cls, triangles: NDArray[np.float64], max_step_m: float, cell_m: float
    ) -> "FloorCells":
        """Return the raster under all triangles at floor level.

        Raises:
            SceneError: There are none, or the raster would be too large.
        """
        z = triangles[..., 2]
        at_floor = (z.min(axis=1) <= max_step_m) & (z.max(axis=1) >= -max_step_m)
        if not at_floor.any():
            raise SceneError("the home has no floor at the height of its start poses")
        xy = triangles[at_floor][..., :2].reshape(-1, 2)
        low = xy.min(axis=0) - _MARGIN_M
        nx, ny = (int(n) for n in np.ceil((xy.max(axis=0) + _MARGIN_M - low) / cell_m))
        if nx * ny > _MAX_CELLS:
            raise SceneError(
                f"the home is {nx * cell_m:.0f} by {ny * cell_m:.0f} m, too large for a floor grid"
            )
        return cls(low=(float(low[0]), float(low[1])), shape=(nx, ny), cell_m=cell_m)

    def cells_between(
        self, triangles: NDArray[np.float64], z_low: float, z_high: float
    ) -> NDArray[np.bool_]:
        """Return (X, Y), the cells that the part of a triangle between two heights overlaps."""
        out = np.zeros(self.shape, np.uint8)
        _draw_kernel(triangles, *self.low, self.cell_m, z_low, z_high, out)
        return out > 0

    def floor(self, triangles: NDArray[np.float64], max_step_m: float) -> NDArray[np.bool_]:
        """Return (X, Y), the cells with a floor within a step of z = 0, narrow gaps closed."""
        floor = self.cells_between(triangles, -max_step_m, max_step_m)
        gap = max(1, round(_FLOOR_GAP_M / self.cell_m / 2))
        return _closed(floor, 2 * gap + 1) | floor

    def grid(self, blocked: NDArray[np.bool_], radius_m: float) -> NavigationGrid:
        """Return the navigation grid of a body with a radius, given the blocked cells."""
        blocked = blocked.copy()
        blocked[0, :] = blocked[-1, :] = blocked[:, 0] = blocked[:, -1] = True
        distance: NDArray[np.float64] = _ndimage.distance_transform_edt(~blocked)
        clearance = distance * self.cell_m
        free = clearance > radius_m
        region, _ = _ndimage.label(free, structure=np.ones((3, 3)))
        half = 0.5 * self.cell_m
        return NavigationGrid(
            origin=(self.low[0] + half, self.low[1] + half),
            cell_m=self.cell_m,
            clearance_m=clearance,
            free=free,
            region=region.astype(np.int32),
        )


def robot_grid(scene: Scene, robot: RobotProfile) -> NavigationGrid:
    """Return the grid of a home for one robot, on the floor of the first start pose.

    It is computed for the width of the body: a long body may pass where it cannot turn.
    """
    return navigation_grid(
        scene,
        radius_m=robot.inscribed_radius_m,
        height_m=robot.height_m,
        max_step_m=robot.max_step_m,
        floor_z_m=scene.start_poses[0].z if scene.start_poses else 0.0,
        cell_m=FINE_CELL_M,
    )


def _closed(cells: NDArray[np.bool_], side: int) -> NDArray[np.bool_]:
    """Return (X, Y) cells closed by a square: one axis after the other, which takes a tenth."""
    out: NDArray[np.uint8] = cells.astype(np.uint8)
    for filter1d in (_ndimage.maximum_filter1d, _ndimage.minimum_filter1d):
        for axis in (0, 1):
            out = filter1d(out, side, axis=axis, mode="constant", cval=0)
    return out > 0


@njit(cache=True, nogil=True)
def _clip_kernel(polygon, count, level, keep_above, out):
    """Clip a convex polygon (count, 3) at a height; return the number of corners kept."""
    kept = 0
    for k in range(count):
        a, b = polygon[k], polygon[(k + 1) % count]
        da, db = a[2] - level, b[2] - level
        if not keep_above:
            da, db = -da, -db
        if da >= 0.0:
            for m in range(3):
                out[kept, m] = a[m]
            kept += 1
        if (da > 0.0 and db < 0.0) or (da < 0.0 and db > 0.0):
            t = da / (da - db)
            for m in range(3):
                out[kept, m] = a[m] + t * (b[m] - a[m])
            kept += 1
    return kept


@njit(cache=True, nogil=True)
def _overlaps_kernel(polygon, count, x, y, half):
    """Tell whether a convex polygon (count, 2+) and a square overlap, by separating axes."""
    for k in range(count):
        ax, ay = polygon[k, 0], polygon[k, 1]
        nx = polygon[(k + 1) % count, 1] - ay
        ny = ax - polygon[(k + 1) % count, 0]
        reach = half * (abs(nx) + abs(ny))
        center = (x - ax) * nx + (y - ay) * ny
        least, most = 0.0, 0.0
        for m in range(count):
            d = (polygon[m, 0] - ax) * nx + (polygon[m, 1] - ay) * ny
            least, most = min(least, d), max(most, d)
        if center - reach >= most + 1e-12 or center + reach <= least - 1e-12:
            return False
    return True


@njit(allocates=True, cache=True, nogil=True)
def _draw_kernel(triangles, x0, y0, cell, z_low, z_high, out):
    """Mark every cell that a triangle's part between two heights overlaps."""
    a = np.empty((9, 3))
    b = np.empty((9, 3))
    half = 0.5 * cell
    for t in range(len(triangles)):
        tri = triangles[t]
        lowest = min(tri[0, 2], tri[1, 2], tri[2, 2])
        highest = max(tri[0, 2], tri[1, 2], tri[2, 2])
        if highest < z_low or lowest > z_high:
            continue
        for k in range(3):
            a[k] = tri[k]
        count = _clip_kernel(a, 3, z_low, True, b)
        count = _clip_kernel(b, count, z_high, False, a)
        if count == 0:
            continue
        i0 = max(int(np.floor((a[:count, 0].min() - x0) / cell)), 0)
        i1 = min(int(np.floor((a[:count, 0].max() - x0) / cell)), out.shape[0] - 1)
        j0 = max(int(np.floor((a[:count, 1].min() - y0) / cell)), 0)
        j1 = min(int(np.floor((a[:count, 1].max() - y0) / cell)), out.shape[1] - 1)
        for i in range(i0, i1 + 1):
            for j in range(j0, j1 + 1):
                if out[i, j] == 0:
                    x, y = x0 + (i + 0.5) * cell, y0 + (j + 0.5) * cell
                    if _overlaps_kernel(a, count, x, y, half):
                        out[i, j] = 1

"""Lengths of the ways from the robot to places of its map, without a plan and without moving."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ippon.geometry import Float64Array
from ippon.mapping.arrays import MapArrays
from ippon.planning.taut_paths import taut_field
from ippon.planning.terrain.reachability import reachable_cells
from ippon.planning.terrain.traversability import Traversability, TraversabilityConfig
from ippon.robot import RobotProfile


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ReachedFloor:
    """Copy of the floor that the robot can reach, so that any thread may measure ways on it."""

    is_reached: NDArray[np.bool_]
    """(X, Y) cells that the body can drive to from where it stands."""
    origin: NDArray[np.int64]
    """(2,) index of cell (0, 0)."""
    cell_m: float
    start_xy: tuple[float, float]
    """The robot, world, metres."""

    def ways(self) -> "FloorWays":
        """Compute the length of the way to every cell."""
        cells = np.argwhere(self.is_reached)
        lengths = np.full(self.is_reached.shape, math.inf)
        if len(cells):
            away = np.linalg.norm(self._centres(cells) - self.start_xy, axis=1)
            first = int(away.argmin())
            field, _ = taut_field(self.is_reached, cells[first : first + 1])
            lengths = field * self.cell_m + float(away[first])
        return FloorWays(floor=self, lengths_m=lengths)

    def _centres(self, cells: NDArray[np.int64]) -> Float64Array:
        return np.asarray((cells + self.origin + 0.5) * self.cell_m, dtype=np.float64)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FloorWays:
    """Lengths of the shortest ways over the floor that the robot can reach."""

    floor: ReachedFloor
    lengths_m: Float64Array
    """(X, Y) metres from the robot; infinite without a way."""

    def to_any(self, points_xy: Float64Array, within_m: float = 0.0) -> float | None:
        """Return the length of the way to the nearest of some points.

        Args:
            points_xy: (N, 2) world, metres.
            within_m: A way may end this far from a point, beside the table on which a thing lies;
                the rest counts as straight.

        Returns:
            Metres; None where no way leads there.
        """
        floor = self.floor
        reach = math.ceil(within_m / floor.cell_m)
        steps = np.arange(-reach, reach + 1)
        offsets = np.stack(np.meshgrid(steps, steps, indexing="ij"), axis=-1).reshape(-1, 2)
        away = np.linalg.norm(offsets, axis=1) * floor.cell_m
        offsets, away = offsets[away <= within_m], away[away <= within_m]
        at = np.floor(points_xy / floor.cell_m).astype(np.int64) - floor.origin
        cells = at[:, None, :] + offsets
        inside = ((cells >= 0) & (cells < self.lengths_m.shape)).all(axis=-1)
        lengths = np.full(inside.shape, math.inf)
        lengths[inside] = self.lengths_m[cells[inside][:, 0], cells[inside][:, 1]]
        best = float((lengths + away).min(initial=math.inf))
        return best if math.isfinite(best) else None


class FloorSurvey:
    """Reads the floor from the map, apart from the planner: a question changes no plan."""

    def __init__(self, config: TraversabilityConfig, robot: RobotProfile) -> None:
        self._floor = Traversability(config, robot)

    def read(self, arrays: MapArrays, T_world_base: Float64Array) -> ReachedFloor:
        """Return the floor that the robot can reach; reads only what changed since the last call.

        Args:
            arrays: The map.
            T_world_base: Pose of the robot.
        """
        floor, (x, y) = self._floor, T_world_base[:2, 3].tolist()
        floor.update(arrays, T_world_base)
        reached = reachable_cells(floor.grid, floor.limits, x, y, floor.margin_m, 0.0)
        return ReachedFloor(
            is_reached=reached > 0,
            origin=floor.grid.origin.copy(),
            cell_m=floor.grid.voxel_size,
            start_xy=(x, y),
        )

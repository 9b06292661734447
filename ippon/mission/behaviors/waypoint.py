"""A point on the floor that the operator sends the robot to."""

import dataclasses
import math
from typing import Protocol, runtime_checkable

import numpy as np

from ippon.geometry import Float64Array, yaw_of
from ippon.guidance.levels import Level
from ippon.mapping.arrays import MapArrays
from ippon.planning.plan import NodeKind, Plan, Viewpoint
from ippon.planning.visibility.region_weights import RegionWeights


@runtime_checkable
class Steerable(Protocol):
    """A planner that takes an operator's wishes: places to go to, and to look at or not."""

    def path_to_point(self, T_world_base: Float64Array, xy: Float64Array) -> Float64Array | None:
        """Return (K, 2) points from the robot to as near `xy` (2,) as it can stand, or None."""
        ...

    def set_regions(self, regions: RegionWeights | None) -> None:
        """Weigh what viewpoints look at."""
        ...

    def preview(self, map_arrays: MapArrays, *, cues: bool) -> Viewpoint | None:
        """Tell what would be chosen on such a map; nothing changes by it."""
        ...


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Waypoint:
    """Where the operator wants the robot to be."""

    xy: tuple[float, float]

    def plan(self, base: Plan, T_world_base: Float64Array, way: Float64Array) -> Plan:
        """Return the plan of a step with the way to this point in place of the planner's choice.

        Args:
            base: What the planner chose.
            T_world_base: Where the robot stands.
            way: (K, 2) points from the robot to the end.
        """
        z = float(T_world_base[2, 3])
        target = Viewpoint(
            position_world=(float(way[-1, 0]), float(way[-1, 1]), z),
            yaw_rad=self._heading(way, T_world_base),
            tilt_rad=0.0,
            gain=0.0,
            termination=0.0,
            level=Level.AVERAGE,
            kind=NodeKind.MINIMAL,
            path_gain=0.0,
            path_cost_s=way_length(way),
        )
        path = np.column_stack([way, np.full(len(way), z)])
        return dataclasses.replace(base, target=target, path_world=path, exhausted=False)

    def _heading(self, way: Float64Array, T_world_base: Float64Array) -> float:
        """Look on in the direction of arrival; a step aside is no reason to turn."""
        for a, b in zip(way[-2::-1], way[:0:-1], strict=True):
            if np.linalg.norm(b - a) > 0.1:
                return math.atan2(b[1] - a[1], b[0] - a[0])
        return yaw_of(T_world_base)


def way_length(way: Float64Array) -> float:
    """Return the length of a (K, 2) polyline in metres."""
    return float(np.linalg.norm(np.diff(way, axis=0), axis=1).sum())

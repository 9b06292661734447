"""Thinning out a full roadmap where the robot no longer is: it was sampled densely there."""

import math
from typing import Final

import numpy as np

from ippon.geometry import Float64Array
from ippon.planning.roadmap.roadmap import Roadmap
from ippon.planning.roadmap.sampling import SamplingConfig
from ippon.planning.visibility.viewpoints import Viewpoints

_STEPS: Final = 5
"""A roadmap that is full all the same is looked through no more often than this."""


class Thinning:
    """Says now and then which viewpoints of a full roadmap others can stand in for."""

    def __init__(
        self, config: SamplingConfig, least_room: int, road: Roadmap, views: Viewpoints
    ) -> None:
        """Take what is thinned out; the roadmap is full with room for no more than `least_room`."""
        self._config = config
        self._least_room = least_room
        self._road = road
        self._views = views
        self._since = 0

    def crowded(self, voxels: Float64Array, target: int | None, x: float, y: float) -> list[int]:
        """Return the nodes to remove in this step.

        Args:
            voxels: (M, 3) centres of OOI voxels, metres; viewpoints beside them stay.
            target: Node that the robot is on its way to, None for none; it stays.
            x: Robot, metres; viewpoints near it stay.
            y: See x.
        """
        config, road = self._config, self._road
        self._since += 1
        if road.room > self._least_room or self._since < _STEPS:
            return []
        self._since = 0
        nodes = road.nodes
        xy = road.xy[nodes]
        worth: Float64Array = self._views.potential[nodes].astype(np.float64)
        worth[np.hypot(xy[:, 0] - x, xy[:, 1] - y) <= config.local_radius_m] = math.inf
        worth[nodes == target] = math.inf
        if len(voxels):
            away = np.linalg.norm(xy[:, None] - voxels[None, :, :2], axis=2).min(axis=1)
            worth[away <= config.object_reach_m] = math.inf
        return [int(nodes[row]) for row in crowded_rows(xy, worth, config.spacing_m)]


def crowded_rows(xy: Float64Array, worth: Float64Array, apart_m: float) -> list[int]:
    """List the places that have a better one nearby.

    Args:
        xy: (N, 2) places, metres.
        worth: (N,) of two that are close the one with more stays, the first of equals; infinite
            for what stays in any case.
        apart_m: Those that stay are at least so far from each other.

    Returns:
        Rows of `xy` to remove.
    """
    gone = np.zeros(len(xy), dtype=np.bool_)
    for row in np.argsort(-worth, kind="stable"):
        if not gone[row]:
            close = np.hypot(*(xy - xy[row]).T) < apart_m
            close[row] = False
            gone |= close & np.isfinite(worth)
    return np.flatnonzero(gone).tolist()

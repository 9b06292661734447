"""Thinning out a full roadmap: it was sampled densely where the robot has been."""

import math

import numpy as np
from numpy.typing import NDArray

from ippon.geometry import Float64Array
from ippon.planning.roadmap.roadmap import Roadmap
from ippon.planning.roadmap.sampling import SamplingConfig


class Thinning:
    """Finds, every few steps, the viewpoints of a full roadmap that others can replace."""

    def __init__(self, config: SamplingConfig, min_room: int, roadmap: Roadmap) -> None:
        """Begin; the roadmap counts as full with room for no more than `min_room` nodes."""
        self._config = config
        self._min_room = min_room
        self._roadmap = roadmap
        self._since = 0

    def crowded(
        self,
        voxels: Float64Array,
        worth: NDArray[np.float32],
        target: int | None,
        x: float,
        y: float,
    ) -> list[int]:
        """Return the nodes to remove in this step.

        Args:
            voxels: (M, 3) centres of OOI voxels, metres; viewpoints beside them stay.
            worth: (capacity,) what each viewpoint might show; the one with more stays.
            target: Node that the robot drives to, None for none; it stays.
            x: Robot, metres; viewpoints near it stay.
            y: See x.
        """
        config, roadmap = self._config, self._roadmap
        self._since += 1
        if roadmap.room > self._min_room or self._since < config.thinning_interval_steps:
            return []
        self._since = 0
        nodes = roadmap.nodes
        xy = roadmap.xy[nodes]
        rank: Float64Array = worth[nodes].astype(np.float64)
        rank[np.hypot(xy[:, 0] - x, xy[:, 1] - y) <= config.local_radius_m] = math.inf
        rank[nodes == target] = math.inf
        if len(voxels):
            away = np.linalg.norm(xy[:, None] - voxels[None, :, :2], axis=2).min(axis=1)
            rank[away <= config.object_reach_m] = math.inf
        return [int(nodes[row]) for row in crowded_rows(xy, rank, config.spacing_m)]


def crowded_rows(xy: Float64Array, worth: Float64Array, apart_m: float) -> list[int]:
    """List the places that have a better one nearby.

    Args:
        xy: (N, 2) places, metres.
        worth: (N,) of two close places the one with more stays, the first of equals; infinite for
            a place that must stay.
        apart_m: Least distance between the places that remain.

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

"""Adds viewpoints to the roadmap, step by step."""

import numpy as np
from numpy.typing import NDArray

from ippon.geometry import Float64Array
from ippon.planning.connection import Connector
from ippon.planning.roadmap import Roadmap
from ippon.planning.sampling import (
    STANDABLE,
    SamplingConfig,
    cell_centre,
    cover,
    draw_place,
    open_places,
    tight_places,
)
from ippon.planning.traversability import Traversability


class Sampler:
    """Draws places round objects first, then round the robot, then everywhere."""

    def __init__(
        self,
        config: SamplingConfig,
        most: int,
        road: Roadmap,
        floor: Traversability,
        connector: Connector,
        seed: int,
    ) -> None:
        """Take what viewpoints are added to; `most` of them in a step."""
        self._config = config
        self._most = most
        self._road = road
        self._floor = floor
        self._connector = connector
        self._rng = np.random.default_rng(seed)

    def add(self, voxels: Float64Array, reachable: NDArray[np.uint8], x: float, y: float) -> bool:
        """Add viewpoints where there is room; tell whether there was none left.

        Args:
            voxels: (M, 3) centres of OOI voxels, metres.
            reachable: (X, Y) from `reachable_cells`.
            x: Robot, metres.
            y: Robot, metres.
        """
        config, grid = self._config, self._floor.grid
        near = np.zeros_like(reachable)
        cover(near, grid, np.array([[x, y]]), config.local_radius_m, 1)
        objects = np.zeros_like(reachable)
        cover(objects, grid, voxels[:, :2], config.object_reach_m, 1)
        left = self._most
        room = self._floor.limits.radius + self._floor.margin_m
        tight = tight_places(objects, reachable, grid, config.object_spacing_m, room)
        if tight.any():
            reachable = np.where(tight, np.uint8(STANDABLE), reachable)
        for mask, spacing, share in (
            (objects, config.object_spacing_m, left // 2),
            (near, config.local_spacing_m, left),
            (np.ones_like(reachable), config.spacing_m, left),
        ):
            for _ in range(min(share, left)):
                if mask is not objects and not self._road.room:
                    break
                xy = self._road.xy[self._road.nodes]
                places = np.argwhere(open_places(reachable * mask, grid, xy, spacing))
                if not len(places) or not self._add_one(places):
                    break
                left -= 1
        return left > 0

    def add_at(self, place: Float64Array) -> None:
        """Add a viewpoint at a place (2,) where the robot can stand, unless one is there."""
        self.add_here(float(place[0]), float(place[1]), 0.05)

    def add_here(self, x: float, y: float, apart_m: float) -> int | None:
        """Add a viewpoint where the robot stands, unless one is there; None when none was added."""
        return None if len(self._road.near(x, y, apart_m, 1)) else self._add(x, y)

    def _add_one(self, places: NDArray[np.int64]) -> bool:
        grid = self._floor.grid
        i, j = draw_place(places, grid, self._rng, self._config.choices)
        return self._add(*cell_centre(grid, i, j)) is not None

    def _add(self, x: float, y: float) -> int | None:
        node = self._road.add_node(x, y)
        if node is not None:
            self._connector.connect(node)
        return node

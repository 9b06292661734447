"""Adding viewpoints to the roadmap, step by step."""

import numpy as np
from numpy.typing import NDArray

from ippon.geometry import Float64Array
from ippon.planning.deadline import UNLIMITED, Deadline
from ippon.planning.roadmap.connection import Connector
from ippon.planning.roadmap.narrow_passages import NarrowPassageConfig, find_narrow_passages
from ippon.planning.roadmap.roadmap import Roadmap
from ippon.planning.roadmap.sampling import (
    SamplingConfig,
    draw_cell,
    mark_discs,
    open_cells,
    tight_cells,
)
from ippon.planning.terrain.floor_grid import cell_centre
from ippon.planning.terrain.motion_check import can_stand
from ippon.planning.terrain.reachability import STANDABLE
from ippon.planning.terrain.traversability import Traversability


class ViewpointSampler:
    """Samples viewpoints near objects first, then near the robot, then everywhere."""

    def __init__(
        self,
        config: SamplingConfig,
        passages: NarrowPassageConfig,
        most: int,
        roadmap: Roadmap,
        floor: Traversability,
        connector: Connector,
        seed: int,
    ) -> None:
        """Begin; at most `most` viewpoints are added in a step."""
        self._config = config
        self._passages = passages
        self._most = most
        self._roadmap = roadmap
        self._floor = floor
        self._connector = connector
        self._rng = np.random.default_rng(seed)
        self._since_passages = passages.interval_steps

    def add(
        self,
        voxels: Float64Array,
        reachable: NDArray[np.uint8],
        x: float,
        y: float,
        deadline: Deadline = UNLIMITED,
    ) -> bool:
        """Add viewpoints; return whether the floor is saturated, with no place for another one.

        Args:
            voxels: (M, 3) centres of OOI voxels, metres.
            reachable: (X, Y) from `reachable_cells`.
            x: Robot, metres.
            y: Robot, metres.
            deadline: Ends the sampling after the first viewpoint.
        """
        config, grid = self._config, self._floor.grid
        near = np.zeros_like(reachable)
        mark_discs(near, grid, np.array([[x, y]]), config.local_radius_m, 1)
        objects = np.zeros_like(reachable)
        mark_discs(objects, grid, voxels[:, :2], config.object_reach_m, 1)
        left = self._most
        if len(voxels):
            room = self._floor.limits.radius + self._floor.margin_m
            tight = tight_cells(objects, reachable, grid, config.object_spacing_m, room)
            reachable = np.where(tight, np.uint8(STANDABLE), reachable)
        for mask, spacing, share in (
            (objects, config.object_spacing_m, left // 2 if len(voxels) else 0),
            (near, config.local_spacing_m, left),
            (np.ones_like(reachable), config.spacing_m, left),
        ):
            for _ in range(min(share, left)):
                if mask is not objects and not self._roadmap.room:
                    break
                xy = self._roadmap.xy[self._roadmap.nodes]
                places = np.argwhere(open_cells(reachable * mask, grid, xy, spacing))
                if not len(places):
                    break
                if left < self._most and deadline.passed():
                    return False
                if not self._add_one(places):
                    break
                left -= 1
        return left > 0

    def add_at(self, place: Float64Array) -> None:
        """Add a viewpoint at a place (2,) where the robot can stand, unless one is there."""
        self.add_here(float(place[0]), float(place[1]), 0.05)

    def add_here(self, x: float, y: float, apart_m: float) -> int | None:
        """Add a viewpoint where the robot stands, unless one is there; return it.

        Returns:
            None if none was added: one is there, the roadmap is full, or a long body has no space
            to turn.
        """
        floor, here = self._floor, np.array([x, y])
        if len(floor.limits.discs) and not can_stand(
            floor.grid, floor.limits, here, floor.margin_m
        ):
            return None
        return None if len(self._roadmap.near(x, y, apart_m, 1)) else self._add(x, y)

    def add_narrow_passages(
        self, reachable: NDArray[np.uint8], deadline: Deadline = UNLIMITED
    ) -> None:
        """Every few steps, add straight edges for a long body through narrow passages.

        Args:
            reachable: (X, Y) from `reachable_cells`.
            deadline: Once it has passed, the search waits up to `patience_steps`.
        """
        floor, roadmap, config = self._floor, self._roadmap, self._passages
        self._since_passages += 1
        waited = self._since_passages
        if not len(floor.limits.discs) or waited < config.interval_steps:
            return
        if waited < config.patience_steps and deadline.passed():
            return
        self._since_passages = 0
        for ends in find_narrow_passages(
            config, floor.grid, floor.limits, reachable, floor.margin_m
        ):
            beside = [roadmap.near(x, y, config.joined_m, 20) for x, y in ends]
            if any(roadmap.has_edge(int(a), int(b)) for a in beside[0] for b in beside[1]):
                continue
            a, b = (self._add(float(x), float(y)) for x, y in ends)
            if a is not None and b is not None:
                self._connector.connect_pair(a, b)

    def _add_one(self, places: NDArray[np.int64]) -> bool:
        grid = self._floor.grid
        i, j = draw_cell(
            places, grid, self._rng, self._config.choices, self._config.ample_clearance_m
        )
        return self._add(*cell_centre(grid, i, j)) is not None

    def _add(self, x: float, y: float) -> int | None:
        node = self._roadmap.add_node(x, y)
        if node is not None:
            self._connector.connect(node)
        return node

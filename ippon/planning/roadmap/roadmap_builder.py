"""Growing the tree of viewpoints over the floor: added, joined, thinned out, entered."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from ippon.geometry import Float64Array, yaw_of
from ippon.planning.config import PlannerConfig
from ippon.planning.deadline import Deadline
from ippon.planning.roadmap.connection import COMFORT_M, Connector
from ippon.planning.roadmap.local_planner import LocalPlanner
from ippon.planning.roadmap.roadmap import Roadmap
from ippon.planning.roadmap.root_connection import RootConnector
from ippon.planning.roadmap.shortest_tree import RootEdges, ShortestTree
from ippon.planning.roadmap.thinning import Thinning
from ippon.planning.roadmap.viewpoint_sampler import ViewpointSampler
from ippon.planning.selection.target_choice import TargetChoice
from ippon.planning.terrain.floor_grid import cell_centres
from ippon.planning.terrain.reachability import STANDABLE, reachable_cells
from ippon.planning.terrain.traversability import Traversability
from ippon.planning.visibility.viewpoints import Viewpoints
from ippon.robot import RobotProfile

WAYPOINT_REACH_M: Final = 0.75
"""A point that an operator chose may lie this far from where the robot can stand: on a table."""


class RoadmapBuilder:
    """Keeps the roadmap in shape, and the cheapest tree over it from where the robot is."""

    def __init__(
        self,
        config: PlannerConfig,
        robot: RobotProfile,
        seed: int,
        *,
        floor: Traversability,
        road: Roadmap,
        views: Viewpoints,
        choice: TargetChoice,
    ) -> None:
        """Take what is kept in shape.

        Args:
            config: How the tree is grown.
            robot: Body and speed.
            seed: Of the samples.
            floor: Where the robot can drive.
            road: The roadmap; empty.
            views: What its nodes show; told of those that are removed, as `choice` is.
            choice: The node that the robot is on its way to.
        """
        self._turn_rate = robot.max_yaw_rate_rad_s
        self._floor = floor
        self._road = road
        self._views = views
        self._choice = choice
        queries = LocalPlanner(config.local_planner, floor, seed)
        self._connector = Connector(road, floor, queries, robot)
        self._entry = RootConnector(road, floor, queries, robot)
        self._sampler = ViewpointSampler(
            config.sampling, config.samples_per_step, road, floor, self._connector, seed
        )
        self._thinning = Thinning(config.sampling, config.samples_per_step, road, views)

    def follow(self, box: tuple[int, int, int, int]) -> None:
        """Drop nodes and edges that the floor no longer allows where it changed.

        Args:
            box: Cells (i0, i1, j0, j1) that changed.
        """
        self._forget(self._connector.follow(box))

    def reachable(self, x: float, y: float) -> NDArray[np.uint8]:
        """Return (X, Y) from `reachable_cells` for a robot at (x, y) metres."""
        floor = self._floor
        return reachable_cells(floor.grid, floor.limits, x, y, floor.margin_m, COMFORT_M)

    def lay_out(
        self,
        voxels: Float64Array,
        reachable: NDArray[np.uint8],
        x: float,
        y: float,
        deadline: Deadline,
    ) -> bool:
        """Add viewpoints, and remove some where they are too many.

        Args:
            voxels: (M, 3) centres of OOI voxels, metres.
            reachable: See `reachable`.
            x: Robot, metres.
            y: Robot, metres.
            deadline: Ends the adding after the first one.

        Returns:
            Whether there was no place left for another one.
        """
        crowded = self._thinning.crowded(voxels, self._choice.node, x, y)
        if crowded:
            self._connector.thin_out(crowded)
            self._forget(crowded)
        saturated = self._sampler.add(voxels, reachable, x, y, deadline)
        self._sampler.add_narrow_passages(reachable, deadline)
        return saturated

    def add_here(self, x: float, y: float, apart_m: float) -> int | None:
        """See `ViewpointSampler.add_here`."""
        return self._sampler.add_here(x, y, apart_m)

    def add_at(self, place: Float64Array) -> None:
        """See `ViewpointSampler.add_at`."""
        self._sampler.add_at(place)

    def grow(
        self, reachable: NDArray[np.uint8], x: float, y: float, yaw: float, deadline: Deadline
    ) -> tuple[RootEdges, ShortestTree]:
        """Find the cheapest ways from the robot, and join one node that none led to.

        Args:
            reachable: See `reachable`.
            x: Robot, metres.
            y: Robot, metres.
            yaw: Its heading, radians.
            deadline: Ends the looking for ways where no straight move is free.

        Returns:
            The moves into the roadmap that the tree begins with, and the tree.
        """
        root_edges = self._entry.root_edges(
            x, y, yaw, self._choice.node, self._choice.path, deadline
        )
        tree = self._road.shortest_tree(root_edges, yaw, self._turn_rate)
        if self._connector.bridge(tree, reachable, deadline=deadline):
            tree = self._road.shortest_tree(root_edges, yaw, self._turn_rate)
        return root_edges, tree

    def path_to_point(
        self, T_world_base: Float64Array, xy: Float64Array, deadline: Deadline
    ) -> Float64Array | None:
        """Find the way to a point that the operator chose, over the roadmap that there is.

        Args:
            T_world_base: Where the robot stands.
            xy: (2,) world x and y, metres.
            deadline: See `grow`.

        Returns:
            (K, 2) points from the robot to where it can stand nearest to `xy`; None when that is
            farther than `WAYPOINT_REACH_M` away, or nothing leads there.
        """
        x, y = float(T_world_base[0, 3]), float(T_world_base[1, 3])
        reachable = self.reachable(x, y)
        cells = np.argwhere(reachable == STANDABLE)
        if not len(cells):
            return None
        places = cell_centres(self._floor.grid, cells)
        apart = np.hypot(*(places - xy).T)
        if apart.min() > WAYPOINT_REACH_M:
            return None
        root_edges, tree = self.grow(reachable, x, y, yaw_of(T_world_base), deadline)
        return self._entry.path_to_point(
            places[int(np.argmin(apart))], T_world_base, root_edges, tree
        )

    def _forget(self, nodes: list[int]) -> None:
        """Drop what is known of removed nodes: others will have their numbers."""
        for node in nodes:
            self._views.forget(node)
            self._choice.forget(node)

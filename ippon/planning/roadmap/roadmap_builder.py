"""The roadmap in each step: sample, connect, thin out, recheck, and find the best paths."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from ippon.geometry import Float64Array, yaw_of
from ippon.planning.deadline import UNLIMITED, Deadline
from ippon.planning.roadmap.connection import ConnectionConfig, Connector
from ippon.planning.roadmap.local_planner import LocalPlanner, LocalPlannerConfig
from ippon.planning.roadmap.narrow_passages import NarrowPassageConfig
from ippon.planning.roadmap.roadmap import Roadmap
from ippon.planning.roadmap.root_connection import RootConnector
from ippon.planning.roadmap.sampling import SamplingConfig
from ippon.planning.roadmap.shortest_tree import RootEdges, ShortestTree
from ippon.planning.roadmap.thinning import Thinning
from ippon.planning.roadmap.viewpoint_sampler import ViewpointSampler
from ippon.planning.terrain.floor_grid import cell_centres
from ippon.planning.terrain.reachability import STANDABLE, reachable_cells
from ippon.planning.terrain.traversability import Traversability
from ippon.robot import RobotProfile

_MOST_ROUNDS: Final = 40
"""Rounds in which a roadmap that lacks a path to the operator's point grows at most."""
_NO_VOXELS: Final[Float64Array] = np.zeros((0, 3))


class RoadmapBuilder:
    """Maintains the roadmap, and finds the shortest-path tree over it from the robot."""

    def __init__(
        self,
        sampling: SamplingConfig,
        passages: NarrowPassageConfig,
        connection: ConnectionConfig,
        local_planner: LocalPlannerConfig,
        robot: RobotProfile,
        seed: int,
        *,
        samples_per_step: int,
        floor: Traversability,
        roadmap: Roadmap,
    ) -> None:
        """Begin with an empty roadmap.

        Args:
            sampling: Density of the viewpoints.
            passages: Search for narrow passages.
            connection: Which nodes are connected.
            local_planner: How nodes are connected that no straight move joins.
            robot: Body and speed.
            seed: Seed of the samples and of the local planner.
            samples_per_step: Viewpoints added in a step at most.
            floor: Where the robot can drive.
            roadmap: The roadmap to maintain; empty.
        """
        self._config = connection
        self._turn_rate = robot.max_yaw_rate_rad_s
        self._floor = floor
        self._roadmap = roadmap
        self._local_planner = local = LocalPlanner(local_planner, floor, seed)
        self._connector = Connector(connection, roadmap, floor, local, robot)
        self._root = RootConnector(connection, roadmap, floor, local, robot)
        self._sampler = ViewpointSampler(
            sampling, passages, samples_per_step, roadmap, floor, self._connector, seed
        )
        self._thinning = Thinning(sampling, samples_per_step, roadmap)

    def update_floor(self, box: tuple[int, int, int, int]) -> list[int]:
        """Recheck nodes and edges where the floor changed.

        Args:
            box: Cells (i0, i1, j0, j1) that changed.

        Returns:
            Nodes that were removed; new nodes may take their numbers.
        """
        return self._connector.update_floor(box)

    def reachable(self, x: float, y: float) -> NDArray[np.uint8]:
        """Return (X, Y) from `reachable_cells` for a robot at (x, y) metres."""
        floor = self._floor
        comfort_m = floor.config.comfort_m
        return reachable_cells(floor.grid, floor.limits, x, y, floor.margin_m, comfort_m)

    def thin_out(
        self,
        voxels: Float64Array,
        worth: NDArray[np.float32],
        target: int | None,
        x: float,
        y: float,
    ) -> list[int]:
        """Remove viewpoints of a full roadmap that others can replace; see `Thinning`.

        Args:
            voxels: (M, 3) centres of OOI voxels, metres.
            worth: (capacity,) what each viewpoint might show; the one with more stays.
            target: Node that the robot drives to, None for none.
            x: Robot, metres.
            y: Robot, metres.

        Returns:
            Nodes that were removed; new nodes may take their numbers.
        """
        crowded = self._thinning.crowded(voxels, worth, target, x, y)
        if crowded:
            self._connector.thin_out(crowded)
        return crowded

    def sample(
        self,
        voxels: Float64Array,
        reachable: NDArray[np.uint8],
        x: float,
        y: float,
        deadline: Deadline,
    ) -> bool:
        """Add viewpoints and narrow passages.

        Args:
            voxels: (M, 3) centres of OOI voxels, metres.
            reachable: See `reachable`.
            x: Robot, metres.
            y: Robot, metres.
            deadline: Ends the sampling after the first viewpoint.

        Returns:
            Whether the floor is saturated: there is no place left for another viewpoint.
        """
        saturated = self._sampler.add(voxels, reachable, x, y, deadline)
        self._sampler.add_narrow_passages(reachable, deadline)
        return saturated

    def add_here(self, x: float, y: float, apart_m: float) -> int | None:
        """See `ViewpointSampler.add_here`."""
        return self._sampler.add_here(x, y, apart_m)

    def add_at(self, place: Float64Array) -> None:
        """See `ViewpointSampler.add_at`."""
        self._sampler.add_at(place)

    def shortest_tree(
        self,
        reachable: NDArray[np.uint8],
        x: float,
        y: float,
        yaw: float,
        deadline: Deadline,
        *,
        target: int | None,
        path: Float64Array | None,
    ) -> tuple[RootEdges, ShortestTree]:
        """Find the best paths from the robot, and connect one node that none of them reaches.

        Args:
            reachable: See `reachable`.
            x: Robot, metres.
            y: Robot, metres.
            yaw: Its heading, radians.
            deadline: Ends the local planner's queries.
            target: Node that the robot drives to, None for none.
            path: (K, 2) path to it, None for none.

        Returns:
            The edges from the robot into the roadmap, and the tree that begins with them.
        """
        root_edges = self._root.edges(x, y, yaw, target, path, deadline)
        tree = self._roadmap.shortest_tree(root_edges, yaw, self._turn_rate)
        if self._connector.bridge(tree, reachable, deadline=deadline):
            tree = self._roadmap.shortest_tree(root_edges, yaw, self._turn_rate)
        return root_edges, tree

    def path_to_point(
        self,
        T_world_base: Float64Array,
        xy: Float64Array,
        deadline: Deadline,
        *,
        target: int | None,
        path: Float64Array | None,
    ) -> Float64Array | None:
        """Find a path to a point that the operator chose; the roadmap grows until there is one.

        Args:
            T_world_base: Pose of the robot.
            xy: (2,) world x and y, metres.
            deadline: See `shortest_tree`.
            target: See `shortest_tree`.
            path: See `shortest_tree`.

        Returns:
            (K, 2) points from the robot to the place nearest to `xy` where it can stand; None if
            that is farther away than `ConnectionConfig.waypoint_reach_m`, or cannot be reached.
        """
        x, y = float(T_world_base[0, 3]), float(T_world_base[1, 3])
        reachable = self.reachable(x, y)
        cells = np.argwhere(reachable == STANDABLE)
        if not len(cells):
            return None
        places = cell_centres(self._floor.grid, cells)
        apart = np.hypot(*(places - xy).T)
        if apart.min() > self._config.waypoint_reach_m:
            return None
        goal, yaw = places[int(np.argmin(apart))], yaw_of(T_world_base)
        rounds, saturated = 0, False
        while True:
            root_edges, tree = self.shortest_tree(
                reachable, x, y, yaw, deadline, target=target, path=path
            )
            found = self._root.path_to_point(goal, T_world_base, root_edges, tree)
            if found is not None:
                return found
            rounds += 1
            complete = saturated and not self._local_planner.unfinished
            if complete or rounds == _MOST_ROUNDS:
                return self._root.detour_to_point(goal, T_world_base, root_edges, tree)
            saturated = self.sample(_NO_VOXELS, reachable, x, y, UNLIMITED)

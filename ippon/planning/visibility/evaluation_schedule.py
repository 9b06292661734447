"""Evaluating viewpoints in the order of what they promise."""

import numpy as np

from ippon.geometry import Float64Array
from ippon.mapping.arrays import MapArrays
from ippon.planning.deadline import Deadline
from ippon.planning.roadmap.roadmap import Roadmap
from ippon.planning.roadmap.shortest_tree import ShortestTree
from ippon.planning.visibility.evaluation_order import promise, waits
from ippon.planning.visibility.viewpoints import Viewpoints


class Evaluations:
    """Brings the viewpoints of the roadmap up to date, a few in each step."""

    def __init__(self, most: int, road: Roadmap, views: Viewpoints) -> None:
        """Take what is evaluated; `most` of them in a step."""
        self._most = most
        self._road = road
        self._views = views
        self._oldest_waits = False

    def step(
        self,
        arrays: MapArrays,
        tree: ShortestTree,
        voxels: Float64Array,
        deadline: Deadline,
        *,
        target: int | None,
        standing: bool,
    ) -> int:
        """Bring the most promising viewpoints up to date; at least one, however late it is.

        Args:
            arrays: The map.
            tree: Cheapest ways to the viewpoints.
            voxels: (M, 3) centres of OOI voxels, metres.
            deadline: Ends it after the first one.
            target: Viewpoint that the robot is on its way to, None for none.
            standing: The robot has come to it.

        Returns:
            How many were evaluated.
        """
        nodes = tree.order
        stale = self._views.stale(nodes, self._road.xy, arrays.voxel_size)
        if standing:
            # Looks alone change nothing in the map, but they use up what there is to see.
            stale |= nodes == target
        nodes = nodes[stale]
        if not len(nodes):
            return 0
        worth = promise(nodes, self._road.nodes, self._road.xy, self._views, voxels, target=target)
        worth /= tree.cost[nodes] + 1.0
        chosen = nodes[np.argsort(-worth, kind="stable")[: self._most - 1]]
        # One place in each step is for whoever waited longest, so that nobody waits for ever.
        oldest = int(nodes[np.argmin(self._views.evaluated[nodes])])
        due = [oldest] if self._oldest_waits else []
        evaluated: set[int] = set()
        for node in dict.fromkeys([*due, *chosen.tolist(), oldest]):
            if evaluated and deadline.passed():
                break
            self._views.evaluate(node, self._road.xy[node], arrays)
            evaluated.add(node)
        self._oldest_waits = oldest not in evaluated
        return len(evaluated)

    def promising_left(self, arrays: MapArrays, tree: ShortestTree, min_potential: float) -> bool:
        """Tell whether a viewpoint waits to be evaluated that might be worth going to.

        Args:
            arrays: The map.
            tree: Cheapest ways to the viewpoints.
            min_potential: Those that showed less before it changed are not, object voxels.
        """
        stale = self._views.stale(tree.order, self._road.xy, arrays.voxel_size)
        return waits(tree.order[stale], self._views, min_potential)

"""Viewpoints and tree of a plan, from the planner's arrays."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ippon.geometry import Float64Array
from ippon.guidance.levels import Level
from ippon.planning.plan import NodeKind, TreeView, Viewpoint
from ippon.planning.roadmap.shortest_tree import ShortestTree
from ippon.planning.selection.look_target import LookTarget
from ippon.planning.selection.node_selection import Scores
from ippon.planning.visibility.viewpoint_store import ViewpointStore


class TreeExporter:
    """Writes viewpoints and the tree of one step as `Viewpoint` and `TreeView`."""

    def __init__(
        self,
        viewpoints: ViewpointStore,
        xy: Float64Array,
        floor_z_m: float,
        tree: ShortestTree,
        scores: Scores,
        *,
        min_gain: float,
    ) -> None:
        self._viewpoints = viewpoints
        self._xy = xy
        self._floor_z_m = floor_z_m
        self._tree = tree
        self._scores = scores
        self._min_gain = min_gain

    def _kinds(self, nodes: NDArray[np.int64]) -> NDArray[np.uint8]:
        """Return the (N,) `NodeKind` of (N,) nodes."""
        minimal = self._viewpoints.potential[nodes] < self._min_gain
        kinds = np.where(minimal, NodeKind.MINIMAL, NodeKind.EXPLORING)
        kinds[self._scores.terminating[nodes]] = NodeKind.TERMINATING
        return kinds.astype(np.uint8)

    def _facing(self, nodes: NDArray[np.int64], kinds: NDArray[np.uint8]) -> Float64Array:
        """Return (N, 2) yaw and tilt: to frame the object, of the highest gain, or ahead."""
        yaws = np.where(
            kinds == NodeKind.MINIMAL, self._tree.heading[nodes], self._viewpoints.yaw[nodes]
        )
        facing = np.column_stack([yaws, self._viewpoints.tilt[nodes]])
        for k in np.flatnonzero(kinds == NodeKind.TERMINATING):
            facing[k] = self._viewpoints.framing(int(nodes[k]))
        return facing

    def _viewpoint(self, node: int) -> Viewpoint:
        """Return a node with its gain and the cost of the path to it."""
        nodes = np.array([node])
        kinds = self._kinds(nodes)
        yaw, tilt = self._facing(nodes, kinds)[0]
        x, y = self._xy[node]
        far_evidence_nat, cued = self._viewpoints.far_evidence_at(node)
        return Viewpoint(
            position_world=(float(x), float(y), self._floor_z_m),
            yaw_rad=float(yaw),
            tilt_rad=float(tilt),
            gain=float(self._viewpoints.gain[node]),
            termination=float(self._viewpoints.termination[node]),
            level=Level(int(self._viewpoints.level[node])),
            kind=NodeKind(int(kinds[0])),
            path_gain=float(self._scores.path_gain[node]),
            path_cost_s=float(self._scores.path_cost[node]),
            far_evidence_nat=far_evidence_nat,
            cued=cued,
        )

    def target(self, node: int | None, look: LookTarget | None) -> Viewpoint | None:
        """Return a node with the orientation of a closer look at it; None for no node."""
        if node is None:
            return None
        viewpoint = self._viewpoint(node)
        if look is None:
            return viewpoint
        return replace(viewpoint, yaw_rad=look.yaw_rad, tilt_rad=look.tilt_rad)

    def tree_view(self, x: float, y: float, yaw: float, tilt: float) -> TreeView:
        """Return the tree as arrays, with the robot as row 0."""
        tree = self._tree
        nodes = tree.order
        row = np.zeros(len(tree.cost) + 1, dtype=np.int32)
        row[nodes] = np.arange(1, len(nodes) + 1)
        parents = np.where(tree.parent[nodes] < 0, 0, row[tree.parent[nodes]])
        kinds = self._kinds(nodes)
        facing = self._facing(nodes, kinds)
        viewpoints, z = self._viewpoints, self._floor_z_m

        def column(root: float, values: NDArray, dtype: type) -> NDArray:
            return np.concatenate([[root], values]).astype(dtype)

        positions = np.column_stack([self._xy[nodes], np.full(len(nodes), z)])
        return TreeView(
            positions_world=np.vstack([[x, y, z], positions]).astype(np.float32),
            parents=column(-1, parents, np.int32),
            yaws_rad=column(yaw, facing[:, 0], np.float32),
            tilts_rad=column(tilt, facing[:, 1], np.float32),
            gains=column(0.0, viewpoints.gain[nodes], np.float32),
            terminations=column(0.0, viewpoints.termination[nodes], np.float32),
            path_costs_s=column(0.0, self._scores.path_cost[nodes], np.float32),
            levels=column(int(Level.AVERAGE), viewpoints.level[nodes], np.uint8),
            kinds=column(NodeKind.MINIMAL, kinds, np.uint8),
        )

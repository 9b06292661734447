"""The target: the viewpoint that the robot drives to."""

import math

import numpy as np

from ippon.geometry import Float64Array
from ippon.mapping.arrays import MapArrays
from ippon.planning.deadline import Deadline
from ippon.planning.roadmap.roadmap import Roadmap
from ippon.planning.roadmap.shortest_tree import ShortestTree
from ippon.planning.selection.look_target import LookTarget
from ippon.planning.selection.node_selection import (
    Scores,
    SelectionConfig,
    holding_termination_min,
    score_nodes,
    select,
)
from ippon.planning.selection.target_hysteresis import (
    ReturnCounter,
    TargetProgress,
    credit_passed_gain,
    retention_of,
    update_target_progress,
)
from ippon.planning.visibility.viewpoint_store import ViewpointStore


class TargetSelector:
    """Selects the target (Sec. Node Selection), with hysteresis."""

    def __init__(
        self,
        config: SelectionConfig,
        roadmap: Roadmap,
        viewpoints: ViewpointStore,
        turn_rate: float,
    ) -> None:
        """Begin without a target; `turn_rate` is the robot's, radians per second."""
        self._config = config
        self._roadmap = roadmap
        self._viewpoints = viewpoints
        self._turn_rate = turn_rate
        self._progress: TargetProgress | None = None
        self._returns = ReturnCounter(config)
        self.node: int | None = None
        """The target, None for none."""
        self.path: Float64Array | None = None
        """(K, 2) path of the robot to it when it was last planned, metres; None for none."""

    def reset(self) -> None:
        """Drop the target and its hysteresis."""
        self._drop()
        self._returns = ReturnCounter(self._config)

    def forget(self, node: int) -> None:
        """Forget a node that was removed, also as the target: a new node may take its number."""
        self._returns.forget(node)
        if self.node == node:
            self._drop()

    def standing_at(self, x: float, y: float) -> Float64Array | None:
        """Return the position (2,) of the target if the robot has reached it, else None."""
        if self.node is None:
            return None
        at = self._roadmap.xy[self.node]
        return at if math.hypot(at[0] - x, at[1] - y) <= self._config.reached_m else None

    def choose(
        self, arrays: MapArrays, tree: ShortestTree, termination_min: float, deadline: Deadline
    ) -> tuple[int | None, Scores]:
        """Select a node; a stale one is evaluated again before it is selected.

        Args:
            arrays: The map.
            tree: Shortest paths to the viewpoints.
            termination_min: T_min.
            deadline: Once it has passed, a stale node is selected by its last evaluation.

        Returns:
            The node, None if none has enough gain, and the scores that it was selected by. It
            becomes the target by `set_target`.
        """
        for _ in range(self._config.max_reevaluations):
            scores = self.score(tree, termination_min, self._viewpoints)
            node = self._select(scores)
            if node is None:
                return None, scores
            one = np.array([node])
            fresh = not self._viewpoints.stale(one, self._roadmap.xy, arrays.voxel_size)[0]
            if fresh or deadline.passed():
                return node, scores
            self._viewpoints.evaluate(node, self._roadmap.xy[node], arrays)
        scores = self.score(tree, termination_min, self._viewpoints)
        return self._select(scores), scores

    def set_target(
        self, chosen: int | None, scores: Scores, look: LookTarget | None, xy: tuple[float, float]
    ) -> None:
        """Set the target to the selected node, or to the viewpoint of a closer look.

        Args:
            chosen: What `choose` returned.
            scores: What `choose` returned.
            look: The closer look, None for none.
            xy: Position of the robot, metres.
        """
        followed = chosen if look is None else None
        self._progress = update_target_progress(
            scores, self._viewpoints.gain, followed, self._progress
        )
        if look is None:
            self._returns.note(self.node, chosen, xy)
        self.node = chosen if look is None else look.node

    def score(
        self, tree: ShortestTree, termination_min: float, viewpoints: ViewpointStore
    ) -> Scores:
        """Return the scores of every node of the tree.

        Args:
            tree: Shortest paths to the viewpoints.
            termination_min: T_min.
            viewpoints: Their evaluations.
        """
        n, config = len(tree.cost), self._config
        eligible = viewpoints.potential[:n] >= config.min_gain
        yaw = viewpoints.yaw[:n].copy()
        enough = holding_termination_min(config, termination_min)
        for node in np.flatnonzero(viewpoints.termination[:n] > enough):
            yaw[node] = viewpoints.framing(int(node))[0]
        scores = score_nodes(
            config,
            tree,
            gain=viewpoints.gain[:n],
            by_heading=viewpoints.by_heading[:n],
            termination=viewpoints.termination[:n],
            yaw=yaw,
            eligible=eligible,
            termination_min=termination_min,
            turn_rate=self._turn_rate,
            current=self.node,
        )
        if self._progress is None or self._progress.node != self.node:
            return scores
        return credit_passed_gain(config, scores, viewpoints.gain, self._progress)

    def _drop(self) -> None:
        self.node = self.path = self._progress = None

    def _select(self, scores: Scores) -> int | None:
        if self.node is None:
            return select(scores, None)
        retention = retention_of(
            self._config,
            scores,
            self.node,
            returns=self._returns.count,
            remaining=self._remaining(scores),
        )
        return select(scores, self.node, retention.factor)

    def _remaining(self, scores: Scores) -> float:
        """Return the fraction of the gain of the path to the target that is left.

        It is 1 for a target without progress, and for far evidence: that is checked from nearby,
        even if little unknown space is left there.
        """
        progress = self._progress
        if progress is None or progress.node != self.node:
            return 1.0
        nat, cued = self._viewpoints.far_evidence_at(progress.node)
        return 1.0 if nat > 0.0 or cued else progress.remaining(scores)

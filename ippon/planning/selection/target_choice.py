"""The viewpoint that the robot is on its way to: chosen, held on to, given up."""

import math
from typing import Final

import numpy as np

from ippon.geometry import Float64Array
from ippon.mapping.arrays import MapArrays
from ippon.planning.deadline import Deadline
from ippon.planning.roadmap.roadmap import Roadmap
from ippon.planning.roadmap.shortest_tree import ShortestTree
from ippon.planning.selection.look_target import Look
from ippon.planning.selection.node_selection import (
    Commitment,
    Patience,
    Scores,
    SelectionConfig,
    commit,
    held,
    score_nodes,
    select,
    with_passing,
)
from ippon.planning.visibility.viewpoints import Viewpoints

_ARRIVED_M: Final = 0.2
"""A robot that is this near to its target stands there."""
_MOST_GLANCES: Final = 4
"""Targets whose surroundings changed that are evaluated again before one is chosen."""


class TargetChoice:
    """Chooses the target (Sec. Node Selection), and remembers what its way promised."""

    def __init__(
        self, config: SelectionConfig, road: Roadmap, views: Viewpoints, turn_rate: float
    ) -> None:
        """Begin without a target; `turn_rate` is the robot's, radians a second."""
        self._config = config
        self._road = road
        self._views = views
        self._turn_rate = turn_rate
        self._commitment: Commitment | None = None
        self._patience = Patience()
        self.node: int | None = None
        """The target, None for none."""
        self.path: Float64Array | None = None
        """(K, 2) the robot's way to it when that was planned last, metres; None for none."""

    def reset(self) -> None:
        """Begin anew: other things are worth going to."""
        self._drop()
        self._patience = Patience()

    def forget(self, node: int) -> None:
        """Drop what is known of a removed node: another will have its number."""
        if self.node == node:
            self._drop()

    def standing_at(self, x: float, y: float) -> Float64Array | None:
        """Return the position (2,) of the target when the robot has come to it."""
        if self.node is None:
            return None
        at = self._road.xy[self.node]
        return at if math.hypot(at[0] - x, at[1] - y) <= _ARRIVED_M else None

    def choose(
        self, arrays: MapArrays, tree: ShortestTree, termination_min: float, deadline: Deadline
    ) -> tuple[int | None, Scores]:
        """Select the target; one whose surroundings changed is looked at again first.

        One that there is no time left for is the first that the next step looks at.

        Args:
            arrays: The map.
            tree: Cheapest ways to the viewpoints.
            termination_min: T_min.
            deadline: Ends the looking again.

        Returns:
            The node, None when none is worth it, and the scores that it was chosen by. It becomes
            the target by `settle`.
        """
        stay = self._patience.stay_factor(self._config)
        for _ in range(_MOST_GLANCES):
            scores = self.score(tree, termination_min, self._views)
            node = self._select(scores, stay)
            if node is None:
                return None, scores
            one = np.array([node])
            fresh = not self._views.stale(one, self._road.xy, arrays.voxel_size)[0]
            if fresh or deadline.passed():
                return node, scores
            self._views.evaluate(node, self._road.xy[node], arrays)
        scores = self.score(tree, termination_min, self._views)
        return self._select(scores, stay), scores

    def settle(
        self, chosen: int | None, scores: Scores, look: Look | None, xy: tuple[float, float]
    ) -> None:
        """Take for the target what was chosen, or what is to be looked at closer instead.

        Args:
            chosen: What `choose` returned, likewise scores.
            scores: See chosen.
            look: The closer look, None for none.
            xy: Where the robot is, metres.
        """
        followed = chosen if look is None else None
        self._commitment = commit(scores, self._views.gain, followed, self._commitment)
        if look is None:
            self._patience.note(self.node, chosen, xy)
        self.node = chosen if look is None else look.node

    def score(self, tree: ShortestTree, termination_min: float, views: Viewpoints) -> Scores:
        """Weigh every node of the tree.

        Args:
            tree: Cheapest ways to the viewpoints.
            termination_min: T_min.
            views: What the viewpoints show.
        """
        n, config = len(tree.cost), self._config
        eligible = views.potential[:n] >= config.min_gain
        yaw = views.yaw[:n].copy()
        for node in np.flatnonzero(views.termination[:n] > held(config, termination_min)):
            yaw[node] = views.frames_object(int(node))[0]
        scores = score_nodes(
            config,
            tree,
            gain=views.gain[:n],
            by_heading=views.by_heading[:n],
            termination=views.termination[:n],
            yaw=yaw,
            eligible=eligible,
            termination_min=termination_min,
            turn_rate=self._turn_rate,
            current=self.node,
        )
        if self._commitment is None or self._commitment.node != self.node:
            return scores
        return with_passing(config, scores, views.gain, self._commitment)

    def _drop(self) -> None:
        self.node = self.path = self._commitment = None

    def _select(self, scores: Scores, stay: float) -> int | None:
        return select(self._config, scores, self.node, stay, self._left(scores))

    def _left(self, scores: Scores) -> float:
        """Share of what the way to the target promised that is left, 1 where that says nothing."""
        commitment = self._commitment
        if commitment is None or commitment.node != self.node:
            return 1.0
        nat, cued = self._views.far_evidence_at(commitment.node)
        # What images show from afar is looked at from nearby, however little is unseen there.
        return 1.0 if nat > 0.0 or cued else commitment.left(scores)

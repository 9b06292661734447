"""The order in which viewpoints are evaluated, a few in each step."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ippon.geometry import Float64Array
from ippon.mapping.arrays import MapArrays
from ippon.planning.deadline import Deadline
from ippon.planning.roadmap.roadmap import Roadmap
from ippon.planning.roadmap.shortest_tree import ShortestTree
from ippon.planning.visibility.viewpoint_store import ViewpointStore

_TARGET_PRIORITY = 1e7
_OBJECT_PRIORITY = 1e6


@dataclass(frozen=True, slots=True, kw_only=True)
class ViewpointEvaluationConfig:
    """Number and order of the evaluations in a step.

    The priority of a viewpoint is the gain that its evaluation may show, in voxels, divided by the
    travel time to it. The target comes first, then viewpoints near an object.
    """

    per_step: int = 4
    """Viewpoints evaluated in a step at most, about 1 ms each; more follows the map sooner and
    takes longer."""
    potential_weight: float = 0.2
    """Weight of the potential gain beside the gain; more evaluates viewpoints sooner whose level is
    low now."""
    neighbour_m: float = 2.0
    """A viewpoint without an evaluation is assumed to have the highest potential gain of those
    within this distance; more assumes larger gains behind walls."""
    first_gain: float = 100.0
    """Assumed gain, in voxels, while no viewpoint was evaluated, and least potential gain assumed
    of viewpoints that were evaluated for another goal; more evaluates those sooner."""
    object_range_m: float = 1.0
    """Viewpoints within this distance of an object voxel come before others; more checks more
    viewpoints for termination first."""
    arrival_s: float = 1.0
    """Added to the travel time that the priority is divided by; more prefers larger gains to near
    viewpoints."""

    def __post_init__(self) -> None:
        """Reject values that evaluate nothing or divide by zero."""
        if self.per_step < 2:
            raise ValueError(
                "per_step must be at least 2, one for the viewpoint that has waited longest; got "
                f"{self.per_step}"
            )
        if self.arrival_s <= 0.0 or self.potential_weight < 0.0 or self.first_gain < 0.0:
            raise ValueError(
                "arrival_s must be above 0, potential_weight and first_gain at least 0; got "
                f"{self.arrival_s}, {self.potential_weight}, {self.first_gain}"
            )


class EvaluationScheduler:
    """Evaluates the stale viewpoints of the roadmap, those of highest priority first."""

    def __init__(
        self, config: ViewpointEvaluationConfig, roadmap: Roadmap, viewpoints: ViewpointStore
    ) -> None:
        self._config = config
        self._roadmap = roadmap
        self._viewpoints = viewpoints
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
        """Evaluate the stale viewpoints of highest priority, and the one that has waited longest.

        Args:
            arrays: The map.
            tree: Shortest paths to the viewpoints.
            voxels: (M, 3) centres of OOI voxels, metres.
            deadline: Ends the step after one evaluation.
            target: Viewpoint that the robot drives to, None for none.
            standing: The robot has reached the target.

        Returns:
            Number of evaluations, at least one if any viewpoint is stale.
        """
        nodes = tree.order
        stale = self._viewpoints.stale(nodes, self._roadmap.xy, arrays.voxel_size)
        if standing:
            # Images from there reduce the gain without a change of the map.
            stale |= nodes == target
        nodes = nodes[stale]
        if not len(nodes):
            return 0
        config = self._config
        priority = evaluation_priority(
            config, nodes, self._roadmap.nodes, self._roadmap.xy, self._viewpoints, voxels,
            target=target,
        )  # fmt: skip
        priority /= tree.cost[nodes] + config.arrival_s
        chosen = nodes[np.argsort(-priority, kind="stable")[: config.per_step - 1]]
        # The last place of each step is for the oldest evaluation, so that none waits for ever.
        oldest = int(nodes[np.argmin(self._viewpoints.evaluated[nodes])])
        due = [oldest] if self._oldest_waits else []
        evaluated: set[int] = set()
        for node in dict.fromkeys([*due, *chosen.tolist(), oldest]):
            if evaluated and deadline.passed():
                break
            self._viewpoints.evaluate(node, self._roadmap.xy[node], arrays)
            evaluated.add(node)
        self._oldest_waits = oldest not in evaluated
        return len(evaluated)

    def any_worth_evaluating(
        self, arrays: MapArrays, tree: ShortestTree, min_potential: float
    ) -> bool:
        """Return whether a stale viewpoint may have a gain.

        Args:
            arrays: The map.
            tree: Shortest paths to the viewpoints.
            min_potential: Potential gain of the last evaluation below which a viewpoint does not
                count; one without an evaluation for this goal does.
        """
        stale = self._viewpoints.stale(tree.order, self._roadmap.xy, arrays.voxel_size)
        nodes = tree.order[stale]
        fresh = self._viewpoints.evaluated[nodes] < 0
        fresh |= self._viewpoints.for_other_goal[nodes]
        return bool((fresh | (self._viewpoints.potential[nodes] >= min_potential)).any())


def evaluation_priority(
    config: ViewpointEvaluationConfig,
    nodes: NDArray[np.int64],
    alive: NDArray[np.int64],
    xy: Float64Array,
    viewpoints: ViewpointStore,
    voxels: Float64Array,
    *,
    target: int | None,
) -> Float64Array:
    """Return the gain that the evaluation of each viewpoint may show.

    Args:
        config: Weights.
        nodes: (N,) viewpoints to rate.
        alive: (A,) all viewpoints that exist.
        xy: (capacity, 2) positions, metres.
        viewpoints: Their last evaluations.
        voxels: (M, 3) centres of OOI voxels, metres.
        target: Viewpoint that the robot drives to, None for none.

    Returns:
        (N,) expected object voxels, far more for the target and for viewpoints near an object.
    """
    out = viewpoints.gain[nodes].astype(np.float64)
    out = out + config.potential_weight * viewpoints.potential[nodes]
    fresh = viewpoints.evaluated[nodes] < 0
    known = alive[viewpoints.evaluated[alive] >= 0]
    if fresh.any():
        guess = np.full(int(fresh.sum()), config.first_gain)
        if len(known):
            potential = viewpoints.potential[known]
            of_other = viewpoints.for_other_goal[known]
            potential[of_other] = np.maximum(potential[of_other], config.first_gain)
            apart = np.linalg.norm(xy[nodes[fresh], None] - xy[None, known], axis=2)
            near = np.where(apart < config.neighbour_m, potential, 0.0)
            guess = 1.0 + near.max(axis=1)
        out[fresh] = guess
    other = viewpoints.for_other_goal[nodes]
    least = config.potential_weight * config.first_gain
    out[other] = np.maximum(out[other], least)
    if len(voxels):
        apart = np.linalg.norm(xy[nodes, None] - voxels[None, :, :2], axis=2)
        out[apart.min(axis=1) <= config.object_range_m] += _OBJECT_PRIORITY
    if target is not None:
        out[nodes == target] += _TARGET_PRIORITY
    return out

"""Scores of the viewpoints, and the one to go to (Sec. Node Selection)."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ippon.compiling import njit
from ippon.geometry import Float64Array
from ippon.planning.roadmap.shortest_tree import ShortestTree


@dataclass(frozen=True, slots=True, kw_only=True)
class SelectionConfig:
    """When a viewpoint is worth going to, and when another one replaces the target."""

    min_gain: float = 1.5
    """Gain, in voxels at the average level, below which a viewpoint counts as explored; more ends a
    search earlier."""
    passing_weight: float = 0.5
    """Fraction of the gain of viewpoints along the path that counts: the camera looks ahead there,
    and views of neighbours overlap. 1 is the paper's sum; more prefers longer paths."""
    look_s: float = 4.0
    """Added to the cost of a viewpoint that explores; more prefers large gains to small gains near
    the robot."""
    settle_s: float = 1.0
    """Added to the cost of a viewpoint that ends the search: the time to stop and look. It keeps
    the ratio finite at the robot; more prefers fuller views to near ones."""
    cost_power: float = 1.6
    """Power of the cost that the gain is divided by; more finishes near regions first, since it
    costs time to return to them. 1 is the paper's ratio."""
    framing_cap: float = 1.5
    """Object voxels above this many times T_min do not count in T(n) / C(P_n); more drives farther
    for a fuller view of the object. Infinity is the paper's rule."""
    hold: float = 0.6
    """The target stays a terminating one while its T(n) exceeds this fraction of T_min: voxels that
    are hard to recognise appear and disappear. More gives up such a target sooner."""
    stay_factor: float = 1.3
    """Factor by which the score of another viewpoint must exceed that of the target; more changes
    the target less often and corrects a bad choice later."""
    stay_power: float = 0.6
    """That factor grows with the travel time left to the target, by (time + look_s) to this power:
    a path that is often left half way costs time and shows little. 0 switches it off."""
    fade_power: float = 4.0
    """`stay_power` is multiplied by the fraction of the path's gain that is left, to this power: a
    gain is often seen from half way. More leaves such a path sooner; 0 drives to its end."""
    patience: float = 1.2
    """Factor on `stay_factor` for each return to a target that was given up, while the robot has
    not moved on; more ends an alternation of two targets sooner. 1 switches it off."""
    max_returns: int = 30
    """Returns that `patience` counts at most."""
    moved_on_m: float = 0.5
    """Distance after which returns are counted from 0; more counts returns for longer."""
    reached_m: float = 0.2
    """Distance from the target within which the robot has reached it; more counts images taken
    farther away as images from the target."""
    max_reevaluations: int = 4
    """Stale candidates for the target that are evaluated again in a step at most; more takes longer
    and relies less on outdated gains."""

    def __post_init__(self) -> None:
        """Reject weights without meaning."""
        if (
            min(self.stay_factor, self.patience) < 1.0
            or min(self.settle_s, self.look_s) <= 0.0
            or not 0.0 <= self.passing_weight <= 1.0
        ):
            raise ValueError(
                "stay_factor and patience must be at least 1, settle_s and look_s above 0, "
                f"passing_weight in 0 to 1; got {self.stay_factor}, {self.patience}, "
                f"{self.settle_s}, {self.look_s}, {self.passing_weight}"
            )
        if not 0.0 < self.cost_power < math.inf:
            raise ValueError(f"cost_power must be above 0; got {self.cost_power}")
        if not (0.0 <= self.stay_power < math.inf and 0.0 <= self.fade_power < math.inf):
            raise ValueError(
                "stay_power and fade_power must not be negative; got "
                f"{self.stay_power}, {self.fade_power}"
            )
        if self.framing_cap < 1.0 or not 0.0 < self.hold <= 1.0:
            raise ValueError(
                "framing_cap must be at least 1 and hold in (0, 1]; got "
                f"{self.framing_cap}, {self.hold}"
            )
        if self.max_reevaluations < 1 or self.max_returns < 0:
            raise ValueError(
                "max_reevaluations must be at least 1 and max_returns at least 0; got "
                f"{self.max_reevaluations}, {self.max_returns}"
            )


class Scores(NamedTuple):
    """Gain, cost and their ratio for the path to each node."""

    path_gain: NDArray[np.float64]
    """(N,) G(P_n)."""
    path_cost: NDArray[np.float64]
    """(N,) C(P_n) in seconds, the turn to the final heading included."""
    ratio: NDArray[np.float64]
    """(N,) G(P_n) / C(P_n)^cost_power, or T(n) / C(P_n) for terminating nodes; -1 for nodes that
    are not eligible."""
    terminating: NDArray[np.bool_]
    """(N,) nodes that end the search."""


def score_nodes(
    config: SelectionConfig,
    tree: ShortestTree,
    *,
    gain: NDArray[np.float32],
    by_heading: NDArray[np.float32],
    termination: NDArray[np.float32],
    yaw: Float64Array,
    eligible: NDArray[np.bool_],
    termination_min: float,
    turn_rate: float,
    current: int | None = None,
) -> Scores:
    """Return the scores of every node of the tree.

    Args:
        config: Weights.
        tree: Shortest paths.
        gain: (N,) G(n).
        by_heading: (N, A) gain of each candidate heading, evenly spaced from just above 0.
        termination: (N,) T(n).
        yaw: (N,) final heading of each node.
        eligible: (N,) nodes that may be chosen.
        termination_min: T_min; nodes above it terminate.
        turn_rate: Radians per second.
        current: The present target, None for none.
    """
    n = len(tree.cost)
    path_gain = np.zeros(n)
    path_cost = np.full(n, np.inf)
    _path_kernel(
        tree, gain, by_heading, yaw, config.passing_weight, turn_rate, path_gain, path_cost
    )
    reached = np.isfinite(path_cost)
    enough = np.full(n, termination_min)
    if current is not None:
        enough[current] = holding_termination_min(config, termination_min)
    terminating = reached & (termination > enough)
    framed = np.minimum(termination, config.framing_cap * termination_min)
    ratio = np.full(n, -1.0)
    explores = reached & eligible & ~terminating
    ratio[explores] = gain_ratio(config, path_gain[explores], path_cost[explores])
    ratio[terminating] = framed[terminating] / (path_cost[terminating] + config.settle_s)
    return Scores(path_gain, path_cost, ratio, terminating)


def gain_ratio(config: SelectionConfig, gain: Float64Array, cost: Float64Array) -> Float64Array:
    """Return the score of exploring paths with (N,) gains and (N,) costs in seconds."""
    return gain / (cost + config.look_s) ** config.cost_power


def max_gain_per_s(config: SelectionConfig, scores: Scores) -> float:
    """Return the highest gain per second of any exploring path, 0 if there is none."""
    explores = (scores.ratio > 0.0) & ~scores.terminating
    seconds = scores.path_cost[explores] + config.look_s
    return float((scores.path_gain[explores] / seconds).max(initial=0.0))


def holding_termination_min(config: SelectionConfig, termination_min: float) -> float:
    """Return the T(n) above which the present target stays a terminating one.

    Args:
        config: Weights.
        termination_min: T_min. One voxel is enough only if T_min asks for no more.
    """
    return min(termination_min, max(1.0, config.hold * termination_min))


def select(scores: Scores, current: int | None, retention: float = 1.0) -> int | None:
    """Return the node of the highest score, eq. (5); terminating nodes come before others.

    Args:
        scores: Scores of every node.
        current: The present target, None for none.
        retention: Factor by which another node's score must exceed that of the target.

    Returns:
        The node, None if none is eligible.
    """
    group = scores.terminating if scores.terminating.any() else scores.ratio > 0.0
    if not group.any():
        return None
    ratio = np.where(group, scores.ratio, -1.0)
    best = int(np.argmax(ratio))
    if current is None or not group[current]:
        return best
    return current if ratio[best] < retention * ratio[current] else best


@njit(allocates=True, cache=True, nogil=True)
def _path_kernel(tree, gain, by_heading, yaw, weight, rate, path_gain, path_cost):
    gathered = np.zeros(gain.shape[0])
    headings = by_heading.shape[1]
    for n in range(tree.order.shape[0]):
        node = tree.order[n]
        parent = tree.parent[node]
        before = gathered[parent] if parent >= 0 else 0.0
        path_gain[node] = before + gain[node]
        ahead = int(tree.heading[node] / (2.0 * math.pi) * headings + 2 * headings) % headings
        gathered[node] = before + weight * by_heading[node, ahead]
        turn = abs((yaw[node] - tree.heading[node] + math.pi) % (2.0 * math.pi) - math.pi)
        path_cost[node] = tree.cost[node] + turn / rate

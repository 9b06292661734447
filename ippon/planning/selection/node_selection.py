"""Which viewpoint to go to (Sec. Node Selection)."""

import math
from dataclasses import dataclass, replace
from typing import Final, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ippon.geometry import Float64Array
from ippon.planning.roadmap.shortest_tree import ShortestTree

MOVED_ON_M: Final = 0.5
_MOST_RETURNS: Final = 30


@dataclass(frozen=True, slots=True, kw_only=True)
class SelectionConfig:
    """When a viewpoint is worth going to, and when to change one's mind."""

    min_gain: float = 1.5
    """Expected object voxels, at the average level, below which a viewpoint explores little; more
    ends a search earlier."""
    passing_weight: float = 0.5
    """Share of the gain of viewpoints on the way that counts: the camera looks ahead there, and
    views of neighbours overlap. 1 is the paper's sum."""
    stay_factor: float = 1.3
    """Another target must be this much better; more dithers less and corrects itself later."""
    stay_power: float = 0.6
    """That factor grows with the seconds left, by (seconds + look_s) to this power: who often
    leaves a long way half way drives much and sees little. 0 lets it."""
    fade_power: float = 4.0
    """What a way promises is often seen from half way. That power falls with the share of it that
    is left, to this power: more turns to something else sooner, 0 drives to the end anyway."""
    patience: float = 1.2
    """Factor on that for each return to a target that was given up since the robot moved on, so
    that two of them do not take turns for ever. 1 lets them."""
    framing_cap: float = 1.5
    """Object voxels beyond this many times T_min count no more in T(n) / C(P_n); more drives on
    for a fuller view of what is found already, and infinity is the paper's rule."""
    hold: float = 0.6
    """The target goes on terminating while its T(n) stays above this share of T_min: voxels of what
    is hard to recognise come and go."""
    settle_s: float = 1.0
    """Added to the cost of what ends the search: time to come to rest and look. Keeps the ratio
    finite at the robot."""
    look_s: float = 4.0
    """Likewise of what explores; more leaves small gains beside the robot for larger ones."""
    cost_power: float = 1.6
    """Power of the cost that gain is divided by. 1 is the paper's ratio, which takes no account of
    what it costs to come back for what is left; more finishes what is near first, drives less."""

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


class Scores(NamedTuple):
    """Per node: what its path gathers and takes, and how the two compare."""

    path_gain: NDArray[np.float64]
    """G(P_n)."""
    path_cost: NDArray[np.float64]
    """C(P_n) in seconds, the turn to the final heading included."""
    ratio: NDArray[np.float64]
    """G(P_n) / C(P_n)^cost_power, or T(n) / C(P_n) for terminating nodes; -1 where not eligible."""
    terminating: NDArray[np.bool_]


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
    """Weigh every node of the tree.

    Args:
        config: Weights.
        tree: Cheapest ways.
        gain: (N,) G(n).
        by_heading: (N, A) gain of each candidate heading, evenly spaced from just above 0.
        termination: (N,) T(n).
        yaw: (N,) final heading of each node.
        eligible: (N,) nodes that may be chosen.
        termination_min: T_min; nodes above it terminate.
        turn_rate: Radians a second.
        current: The target so far, None for none.
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
        enough[current] = held(config, termination_min)
    terminating = reached & (termination > enough)
    framed = np.minimum(termination, config.framing_cap * termination_min)
    ratio = np.full(n, -1.0)
    explores = reached & eligible & ~terminating
    ratio[explores] = _gain_ratio(config, path_gain[explores], path_cost[explores])
    ratio[terminating] = framed[terminating] / (path_cost[terminating] + config.settle_s)
    return Scores(path_gain, path_cost, ratio, terminating)


def _gain_ratio(config: SelectionConfig, gain: Float64Array, cost: Float64Array) -> Float64Array:
    return gain / (cost + config.look_s) ** config.cost_power


def promised_per_s(config: SelectionConfig, scores: Scores) -> float:
    """Return the gain a second of the way to explore that has most of it, 0 where none is left."""
    explores = (scores.ratio > 0.0) & ~scores.terminating
    seconds = scores.path_cost[explores] + config.look_s
    return float((scores.path_gain[explores] / seconds).max(initial=0.0))


def held(config: SelectionConfig, termination_min: float) -> float:
    """Return what T(n) of the target must exceed for it to go on terminating.

    One voxel is enough only where T_min asks for no more.

    Args:
        config: Weights.
        termination_min: T_min.
    """
    return min(termination_min, max(1.0, config.hold * termination_min))


@dataclass(frozen=True, slots=True, kw_only=True)
class Commitment:
    """What the way to a target promised when it was chosen, and at most since then."""

    node: int
    passing: float
    """Gain of the viewpoints on that way."""
    cost: float
    """Seconds that it took."""
    promised: float
    """The most gain that the way to it has had since then."""

    def left(self, scores: Scores) -> float:
        """Return the share of that gain which is still there to be seen, 0 to 1."""
        if self.promised <= 0.0:
            return 0.0
        return min(1.0, float(scores.path_gain[self.node]) / self.promised)


def commit(
    scores: Scores, gain: NDArray[np.float32], target: int | None, before: Commitment | None
) -> Commitment | None:
    """Return what the way to a target promises: when it was chosen, and at most since then.

    Args:
        scores: Of every node, what is still to be passed with them.
        gain: (N,) G(n).
        target: The node that was chosen, None for none.
        before: What the last step returned.
    """
    if target is None:
        return None
    gathered = float(scores.path_gain[target])
    if before is not None and before.node == target:
        more = gathered > before.promised
        return replace(before, promised=gathered) if more else before
    return Commitment(
        node=target,
        passing=gathered - float(gain[target]),
        cost=float(scores.path_cost[target]),
        promised=gathered,
    )


def with_passing(
    config: SelectionConfig, scores: Scores, gain: NDArray[np.float32], commitment: Commitment
) -> Scores:
    """Count for the target what it was chosen to pass, as far as that still lies ahead.

    The robot's own way to it leads past the same places, but through none of their nodes: without
    this the target would be worth less for being the target, and two of them take turns for ever.
    """
    node = commitment.node
    left = min(1.0, float(scores.path_cost[node]) / max(commitment.cost, 1e-6))
    path_gain = max(float(scores.path_gain[node]), float(gain[node]) + left * commitment.passing)
    if scores.ratio[node] <= 0.0 or scores.terminating[node]:
        return scores
    gains, ratio = scores.path_gain.copy(), scores.ratio.copy()
    gains[node] = path_gain
    ratio[node] = _gain_ratio(config, gains[node], scores.path_cost[node])
    return scores._replace(path_gain=gains, ratio=ratio)


@njit(cache=True, nogil=True)
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


class Patience:
    """Counts how often a target that was given up is chosen again before the robot has moved on.

    Two targets may take turns for many reasons: an estimate of a way that is off by a second or two
    is enough. Each return then makes the next change of mind harder.
    """

    def __init__(self) -> None:
        self._given_up: set[int] = set()
        self._returns = 0
        self._since: tuple[float, float] | None = None

    def stay_factor(self, config: SelectionConfig) -> float:
        """Return how much better another target must be by now."""
        return config.stay_factor * config.patience**self._returns

    def note(self, before: int | None, chosen: int | None, xy: tuple[float, float]) -> None:
        """Take note of a choice.

        Args:
            before: The target so far.
            chosen: The one from now on.
            xy: Where the robot is.
        """
        if self._since is None or math.dist(self._since, xy) > MOVED_ON_M:
            self._since, self._returns = xy, 0
            self._given_up.clear()
        if before is None or chosen is None or chosen == before:
            return
        self._given_up.add(before)
        if chosen in self._given_up:
            self._returns = min(self._returns + 1, _MOST_RETURNS)


def select(
    config: SelectionConfig,
    scores: Scores,
    current: int | None,
    stay_factor: float | None = None,
    left: float = 1.0,
) -> int | None:
    """Choose a node by eq. (5): terminating ones first, then by gain over cost.

    Args:
        config: Weights.
        scores: Of every node.
        current: The target so far, kept unless another is clearly better; None for none.
        stay_factor: How much better where the current target is near; None for
            `config.stay_factor`.
        left: Share of what the way to the current target promised that is still there.

    Returns:
        The node, None when none is eligible.
    """
    group = scores.terminating if scores.terminating.any() else scores.ratio > 0.0
    if not group.any():
        return None
    ratio = np.where(group, scores.ratio, -1.0)
    best = int(np.argmax(ratio))
    if current is None or not group[current]:
        return best
    stay = config.stay_factor if stay_factor is None else stay_factor
    if not scores.terminating[current]:
        firmness = config.stay_power * left**config.fade_power
        stay *= (float(scores.path_cost[current]) + config.look_s) ** firmness
    return current if ratio[best] < stay * ratio[current] else best

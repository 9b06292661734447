"""Hysteresis of the target: one factor on its score, and the gain that it was chosen to pass."""

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ippon.planning.selection.node_selection import Scores, SelectionConfig, gain_ratio


class Retention(NamedTuple):
    """The factors by which the score of another viewpoint must exceed that of the target."""

    margin: float
    """`stay_factor`: gains and travel times are estimates."""
    returns: float
    """`patience` to the number of returns: ends an alternation of two targets."""
    progress: float
    """Grows with the travel time left, and falls to 1 as the gain of the path is used up; 1
    for a terminating target."""

    @property
    def factor(self) -> float:
        """Their product."""
        return self.margin * self.returns * self.progress


def retention_of(
    config: SelectionConfig, scores: Scores, target: int, *, returns: int, remaining: float
) -> Retention:
    """Return the factors that keep the robot on its way to a target.

    Args:
        config: Weights.
        scores: Scores of every node.
        target: The present target.
        returns: See `ReturnCounter`.
        remaining: Fraction of the gain of the path to it that is left, 0 to 1.
    """
    progress = 1.0
    if not scores.terminating[target]:
        power = config.stay_power * remaining**config.fade_power
        progress = (float(scores.path_cost[target]) + config.look_s) ** power
    return Retention(config.stay_factor, config.patience**returns, progress)


@dataclass(frozen=True, slots=True, kw_only=True)
class TargetProgress:
    """Gain and cost of the path to a target when it was chosen, and the highest gain since."""

    node: int
    passing: float
    """Gain of the viewpoints along that path."""
    cost: float
    """Travel time of that path, seconds."""
    max_gain: float
    """The highest gain that the path to the target has had since then."""

    def remaining(self, scores: Scores) -> float:
        """Return the fraction of the highest gain that is left, 0 to 1."""
        if self.max_gain <= 0.0:
            return 0.0
        return min(1.0, float(scores.path_gain[self.node]) / self.max_gain)


def update_target_progress(
    scores: Scores, gain: NDArray[np.float32], target: int | None, before: TargetProgress | None
) -> TargetProgress | None:
    """Return the progress towards a target, which restarts if the target is another one.

    Args:
        scores: Scores of every node, with `credit_passed_gain`.
        gain: (N,) G(n).
        target: The node that was chosen, None for none.
        before: The progress after the last step.
    """
    if target is None:
        return None
    gathered = float(scores.path_gain[target])
    if before is not None and before.node == target:
        more = gathered > before.max_gain
        return replace(before, max_gain=gathered) if more else before
    return TargetProgress(
        node=target,
        passing=gathered - float(gain[target]),
        cost=float(scores.path_cost[target]),
        max_gain=gathered,
    )


def credit_passed_gain(
    config: SelectionConfig, scores: Scores, gain: NDArray[np.float32], progress: TargetProgress
) -> Scores:
    """Return scores in which the target keeps the gain of the viewpoints that it was chosen with.

    The robot's path to its target passes the same places as the tree's path did, but none of its
    nodes. Without this credit a viewpoint would lose score by becoming the target. The credit falls
    in proportion to the travel time that is left.
    """
    node = progress.node
    ahead = min(1.0, float(scores.path_cost[node]) / max(progress.cost, 1e-6))
    path_gain = max(float(scores.path_gain[node]), float(gain[node]) + ahead * progress.passing)
    if scores.ratio[node] <= 0.0 or scores.terminating[node]:
        return scores
    gains, ratio = scores.path_gain.copy(), scores.ratio.copy()
    gains[node] = path_gain
    ratio[node] = gain_ratio(config, gains[node], scores.path_cost[node])
    return scores._replace(path_gain=gains, ratio=ratio)


class ReturnCounter:
    """Counts returns to targets that were given up, until the robot has moved on.

    An error of a second or two in an estimated travel time is enough for two targets to alternate.
    """

    def __init__(self, config: SelectionConfig) -> None:
        self._config = config
        self.count = 0
        """Returns since the robot moved on last."""
        self._given_up: set[int] = set()
        self._since: tuple[float, float] | None = None

    def forget(self, node: int) -> None:
        """Forget a node that was removed: a new node may take its number."""
        self._given_up.discard(node)

    def note(self, before: int | None, chosen: int | None, xy: tuple[float, float]) -> None:
        """Record a choice.

        Args:
            before: The target so far, None for none.
            chosen: The target from now on, None for none.
            xy: Position of the robot, metres.
        """
        if self._since is None or math.dist(self._since, xy) > self._config.moved_on_m:
            self._since, self.count = xy, 0
            self._given_up.clear()
        if before is None or chosen is None or chosen == before:
            return
        self._given_up.add(before)
        if chosen in self._given_up:
            self.count = min(self.count + 1, self._config.max_returns)

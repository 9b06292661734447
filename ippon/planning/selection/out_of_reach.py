"""When to say that an object is found but out of reach, after the ways round to it were tried.

A search used to explore the rest of the home and end without a find, minutes later, although the
map had shown the object all along: on a sofa behind a table, behind glass, on a shelf of a closet.
"""

from dataclasses import dataclass, field

import numpy as np

from ippon.geometry import Float64Array
from ippon.planning.roadmap.shortest_tree import ShortestTree
from ippon.planning.selection.detours import Surroundings, nearest_stand, way_round
from ippon.planning.selection.look_target import (
    SIGHT_TRIES,
    STAY_S,
    Look,
    is_same,
    look_at,
    stands_facing,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class OutOfReachConfig:
    """How hard the robot tries before it says that an object is out of reach."""

    around_steps: int = 300
    """Steps spent on ways round that lead through unseen floor, a minute at five a second; more
    tries longer ones."""
    patience_steps: int = 8
    """Steps that it looks at such floor before that counts as blocked; more waits for worse
    images."""
    sure_steps: int = 10
    """Steps in a row in which no way shows before that counts; more lets new viewpoints come up."""
    approach_steps: int = 250
    """Steps on the way to the nearest place from which it sees the object, after which it explores
    on instead."""
    reach_m: float = 0.95
    """What lies farther from the robot than this, over the floor, is out of reach; as in N_T."""

    def __post_init__(self) -> None:
        """Reject counts without meaning."""
        if min(self.around_steps, self.patience_steps, self.sure_steps, self.approach_steps) < 1:
            raise ValueError(
                "around_steps, patience_steps, sure_steps and approach_steps must be at least 1; "
                f"got {self.around_steps}, {self.patience_steps}, {self.sure_steps}, "
                f"{self.approach_steps}"
            )
        if not self.reach_m > 0.0:
            raise ValueError(f"reach_m must be above 0; got {self.reach_m}")


@dataclass(slots=True, kw_only=True)
class _Case:
    """One object that no way leads to, as it seems."""

    centre: Float64Array
    steps: int = 0
    sure: int = 0
    approach: int = 0
    closed: list[tuple[float, float]] = field(default_factory=list[tuple[float, float]])
    node: int | None = None
    settled: int = 0
    stand: tuple[Float64Array, Float64Array] | None = None


class OutOfReach:
    """Tries ways round to an object, then leads to the nearest place that shows it."""

    def __init__(self, config: OutOfReachConfig, speed_m_s: float) -> None:
        self._config = config
        self._speed = speed_m_s
        self._case: _Case | None = None

    def forget(self) -> None:
        """Start anew: another object is searched for."""
        self._case = None

    def think_again(self) -> None:
        """The floor was opened a little: look for ways for some steps more."""
        if self._case is not None:
            self._case.sure, self._case.stand = 0, None

    def choose(
        self,
        cluster: Float64Array,
        around: Surroundings,
        tree: ShortestTree,
        xy: Float64Array,
        T_world_base: Float64Array,
        *,
        enough: float,
        cut_short: bool = False,
    ) -> Look | None:
        """Return where to go for an object that was looked at and that no viewpoint ends at.

        Args:
            cluster: (M, 3) voxel centres, metres.
            around: Floor and map.
            tree: Cheapest ways; it reaches a viewpoint at least.
            xy: (capacity, 2) positions of the viewpoints.
            T_world_base: Where the robot stands.
            enough: Voxels that must be in sight to be sure of the object: T_min.
            cut_short: This step had no time for all viewpoints and ways that it might have added:
                that no way shows in it makes nothing surer.

        Returns:
            None while nothing is sure, or when the object cannot be seen well from anywhere.
        """
        case = self._case_of(cluster)
        case.steps += 1
        robot = float(T_world_base[0, 3]), float(T_world_base[1, 3])
        if case.stand is None and case.steps <= self._config.around_steps:
            unsure = way_round(around, cluster, case.closed, self._config.reach_m, robot)
            if unsure is not None:
                case.sure = 0
                return self._towards(case, unsure, around, tree, xy, T_world_base)
        case.sure += 0 if cut_short else 1
        if case.sure < self._config.sure_steps:
            return None
        if case.stand is None:
            found = nearest_stand(around, cluster, enough)
            if found is None:
                case.sure = 0
                return None
            case.stand = found
        case.approach += 1
        if case.approach > self._config.approach_steps:
            return None
        place, voxel = case.stand
        node = int(tree.order[np.argmin(np.hypot(*(xy[tree.order] - place).T))])
        away = float(np.hypot(*(cluster[:, :2] - xy[node]).T).min())
        return look_at(node, xy[node], voxel, around.eye_z_m, away)

    def wanted_place(self) -> Float64Array | None:
        """Return the place (2,) where a viewpoint is wanted, None for none."""
        return None if self._case is None or self._case.stand is None else self._case.stand[0]

    def _case_of(self, cluster: Float64Array) -> _Case:
        centre, case = cluster.mean(axis=0), self._case
        if case is None or not is_same(case.centre, centre):
            case = _Case(centre=centre)
        case.centre = centre
        self._case = case
        return case

    def _towards(
        self,
        case: _Case,
        unsure: tuple[float, float],
        around: Surroundings,
        tree: ShortestTree,
        xy: Float64Array,
        T_world_base: Float64Array,
    ) -> Look | None:
        """Look at unseen floor from where that is soonest; it counts as blocked after a while."""
        nodes, floor_z = tree.order, float(T_world_base[2, 3])
        point = np.array([*unsure, floor_z + 0.5 * around.grid.voxel_size])
        away = np.hypot(*(xy[nodes] - point[:2]).T)
        seconds = tree.cost[nodes] + 1.5 * away / self._speed
        seconds[nodes == case.node] -= STAY_S
        for row in np.argsort(seconds, kind="stable")[:SIGHT_TRIES].tolist():
            node = int(nodes[row])
            if around.views.sees(xy[node], point, around.arrays):
                break
        else:
            case.closed.append(unsure)
            return None
        look = look_at(node, xy[node], point, around.eye_z_m)
        stays = node == case.node and stands_facing(T_world_base, xy[node], look.yaw_rad)
        case.settled = case.settled + 1 if stays else 0
        case.node = node
        if case.settled >= self._config.patience_steps:
            case.closed.append(unsure)
            case.settled = 0
        return look

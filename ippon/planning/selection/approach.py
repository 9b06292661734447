"""Where to look closer at what may be the object, while no viewpoint ends the search yet.

The paper puts terminating nodes first (Sec. Node Selection). An object that is recognised from
afar has none as long as the floor beside it is unseen, and its few voxels weigh little against the
thousands of an unseen room: the robot would drive off. So a cluster of OOI voxels that is large
enough goes before exploring, too. What shows clearly and cannot be come close to ends the search as
out of reach.
"""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from ippon.geometry import Float64Array
from ippon.planning.roadmap.shortest_tree import ShortestTree
from ippon.planning.selection.detours import SIGHTS, Surroundings, spread
from ippon.planning.selection.look_target import (
    SIGHT_TRIES,
    STAY_S,
    Look,
    is_same,
    look_at,
    stands_facing,
)
from ippon.planning.selection.out_of_reach import OutOfReach, OutOfReachConfig

_kd_tree: Any = KDTree
_components: Any = connected_components
"""Untyped on purpose: scipy does not say what its functions return."""

_CLUSTER_GAP = 2.1
"""Voxels of one cluster lie at most this many edges apart."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CloserLookConfig:
    """When something is worth a closer look before exploring goes on."""

    share: float = 0.5
    """Share of T_min that a cluster must exceed; less goes after more misread specks. Of clusters
    above one half five in six are the object, of those below one in six."""
    patience_steps: int = 16
    """Steps in front of it, facing it, after which it is left alone; the camera looks down in the
    second half, since mostly it is unseen floor that keeps the robot from going closer."""
    down_rad: float = 0.5
    """How much lower it looks then; more sees floor closer to the robot."""
    give_up_steps: int = 250
    """Steps on the way to it after which it is left alone."""
    grown: float = 1.5
    """A cluster that was left alone counts again when it has this many times the voxels."""
    out_of_reach: OutOfReachConfig = field(default_factory=OutOfReachConfig)

    def __post_init__(self) -> None:
        """Reject shares and counts without meaning."""
        if self.share < 0.0 or self.patience_steps < 1 or self.give_up_steps < 1:
            raise ValueError(
                "share must be at least 0, patience_steps and give_up_steps at least 1; got "
                f"{self.share}, {self.patience_steps}, {self.give_up_steps}"
            )


@dataclass(slots=True, kw_only=True)
class _Pursuit:
    """What is being looked at, and for how long."""

    centre: Float64Array
    voxels: int
    node: int
    stand: Float64Array
    yaw_rad: float
    age: int = 0
    settled: int = 0


class CloserLooks:
    """Chooses them, and remembers which came to nothing."""

    def __init__(self, config: CloserLookConfig, speed_m_s: float) -> None:
        self._config = config
        self._speed = speed_m_s
        self._pursuit: _Pursuit | None = None
        self._left_alone: list[tuple[Float64Array, int]] = []
        self.out_of_reach = OutOfReach(config.out_of_reach, speed_m_s)

    @property
    def active(self) -> bool:
        """Something is being looked at."""
        return self._pursuit is not None

    def forget(self) -> None:
        """Start anew: another object is searched for."""
        self._pursuit = None
        self._left_alone.clear()
        self.out_of_reach.forget()

    def rest(self) -> None:
        """Take note that the search ends or explores at this step."""
        self._pursuit = None

    def choose(
        self,
        voxels: Float64Array,
        around: Surroundings,
        tree: ShortestTree,
        xy: Float64Array,
        T_world_base: Float64Array,
        *,
        termination_min: float,
        cut_short: bool = False,
    ) -> Look | None:
        """Return the viewpoint to look from, None when nothing is worth it.

        Args:
            voxels: (M, 3) centres of OOI voxels, metres.
            around: Floor and map, for lines of sight and ways round.
            tree: Cheapest ways.
            xy: (capacity, 2) positions of the viewpoints.
            T_world_base: Where the robot stands.
            termination_min: T_min.
            cut_short: See `OutOfReach.choose`.
        """
        self._watch(T_world_base)
        nodes = tree.order
        best: tuple[float, int, Float64Array, Float64Array] | None = None
        known: Float64Array | None = None
        for cluster in clusters_of(voxels, around.grid.voxel_size) if len(nodes) else ():
            if len(cluster) <= self._config.share * termination_min:
                continue
            if self._is_settled(cluster):
                if len(cluster) > max(termination_min, 0 if known is None else len(known)):
                    known = cluster
                continue
            found = self._nearest_sight(cluster, nodes, around, tree, xy)
            if found is not None and (best is None or found[0] < best[0]):
                best = (*found, cluster)
        if best is not None:
            return self._towards(best[1], best[2], best[3], xy, around.eye_z_m)
        self._pursuit = None
        if known is None:
            return None
        return self.out_of_reach.choose(
            known, around, tree, xy, T_world_base, enough=termination_min, cut_short=cut_short
        )

    def _nearest_sight(
        self,
        cluster: Float64Array,
        nodes: NDArray[np.int64],
        around: Surroundings,
        tree: ShortestTree,
        xy: Float64Array,
    ) -> tuple[float, int, Float64Array] | None:
        """Return seconds, viewpoint and voxel (3,) in sight from where the cluster is soonest."""
        away = np.linalg.norm(xy[nodes, None] - cluster[None, :, :2], axis=2).min(axis=1)
        # The rest of the way is likely to lead round something.
        seconds = tree.cost[nodes] + 1.5 * away / self._speed
        if self._pursuit is not None:
            seconds[nodes == self._pursuit.node] -= STAY_S
        samples = spread(cluster, SIGHTS)
        for row in np.argsort(seconds, kind="stable")[:SIGHT_TRIES].tolist():
            for voxel in samples:
                if around.views.sees(xy[nodes[row]], voxel, around.arrays):
                    return float(seconds[row]), int(nodes[row]), voxel
        return None

    def _towards(
        self,
        node: int,
        voxel: Float64Array,
        cluster: Float64Array,
        xy: Float64Array,
        eye_z_m: float,
    ) -> Look:
        centre = cluster.mean(axis=0)
        look = look_at(node, xy[node], voxel, eye_z_m)
        old = self._pursuit
        same = old is not None and is_same(old.centre, centre)
        self._pursuit = _Pursuit(
            centre=centre,
            voxels=len(cluster),
            node=node,
            stand=xy[node].copy(),
            yaw_rad=look.yaw_rad,
            age=old.age if old is not None and same else 0,
            settled=old.settled if old is not None and same and old.node == node else 0,
        )
        if self._pursuit.settled < self._config.patience_steps // 4:
            return look
        return replace(look, tilt_rad=look.tilt_rad - self._config.down_rad)

    def _watch(self, T_world_base: Float64Array) -> None:
        """Leave alone what stays what it is although the robot stands in front of it."""
        pursuit = self._pursuit
        if pursuit is None:
            return
        pursuit.age += 1
        stays = stands_facing(T_world_base, pursuit.stand, pursuit.yaw_rad)
        pursuit.settled = pursuit.settled + 1 if stays else 0
        patient = pursuit.settled < self._config.patience_steps
        if not patient or pursuit.age >= self._config.give_up_steps:
            self._left_alone.append((pursuit.centre, pursuit.voxels))
            self._pursuit = None

    def _is_settled(self, cluster: Float64Array) -> bool:
        centre, size = cluster.mean(axis=0), len(cluster)
        return any(
            is_same(old, centre) and size < self._config.grown * count
            for old, count in self._left_alone
        )


def clusters_of(voxels: Float64Array, voxel_size: float) -> list[Float64Array]:
    """Split (M, 3) voxel centres into those that touch, one voxel of gap allowed."""
    count = len(voxels)
    if count == 0:
        return []
    pairs: NDArray[np.int64] = _kd_tree(voxels).query_pairs(
        _CLUSTER_GAP * voxel_size, output_type="ndarray"
    )
    ones = np.ones(len(pairs), dtype=np.int8)
    graph = coo_array((ones, (pairs[:, 0], pairs[:, 1])), (count, count))
    number, member_of = _components(graph, directed=False)
    return [voxels[member_of == c] for c in range(number)]

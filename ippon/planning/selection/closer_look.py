"""A closer look at a cluster that may be the object, before exploring continues.

The paper puts terminating nodes first (Sec. Node Selection). An object that is recognised from a
distance has none while the floor beside it is unseen, and its few voxels weigh little against the
thousands of an unseen room, so that the robot would drive away. A cluster of OOI voxels that is
large enough therefore comes before exploring. An object that is clearly visible but that no path
leads close to ends the search as out of reach.
"""

from dataclasses import dataclass, field, replace

from ippon.geometry import Float64Array
from ippon.planning.roadmap.shortest_tree import ShortestTree
from ippon.planning.selection.cluster_look import ClusterLook, Sight
from ippon.planning.selection.detours import Surroundings
from ippon.planning.selection.look_target import (
    LookConfig,
    LookTarget,
    is_same_cluster,
)
from ippon.planning.selection.out_of_reach import OutOfReach, OutOfReachConfig
from ippon.planning.selection.passing_look import PassingLook, PassingLookConfig
from ippon.planning.selection.voxel_clusters import clusters_of


@dataclass(frozen=True, slots=True, kw_only=True)
class CloserLookConfig:
    """Which clusters are worth a closer look, and how long it lasts."""

    share: float = 0.5
    """Fraction of T_min that the voxels of a cluster must exceed; less looks at more misclassified
    voxels."""
    patience_steps: int = 16
    """Steps at the viewpoint, facing the cluster, after which it is left; in the last three
    quarters the camera looks down, since unseen floor mostly keeps the robot from coming closer.
    More waits longer for voxels that no image confirms."""
    down_rad: float = 0.5
    """How far the camera looks down below the cluster then; more sees floor closer to the robot."""
    give_up_steps: int = 250
    """Steps on the way to the viewpoint after which the cluster is left, twice as many for looks
    that images without it interrupt; more drives farther."""
    grown: float = 1.5
    """A cluster that was left is looked at again once it has this many times the voxels; more
    returns to fewer clusters."""
    look: LookConfig = field(default_factory=LookConfig)
    out_of_reach: OutOfReachConfig = field(default_factory=OutOfReachConfig)
    passing: PassingLookConfig = field(default_factory=PassingLookConfig)

    def __post_init__(self) -> None:
        """Reject shares and counts without meaning."""
        if self.share < 0.0 or self.patience_steps < 1 or self.give_up_steps < 1:
            raise ValueError(
                "share must be at least 0, patience_steps and give_up_steps at least 1; got "
                f"{self.share}, {self.patience_steps}, {self.give_up_steps}"
            )


class CloserLookSelector:
    """Selects clusters to look at, and keeps those that a closer look did not confirm."""

    def __init__(self, config: CloserLookConfig, speed_m_s: float) -> None:
        self._config = config
        self._look = ClusterLook(
            config.look,
            speed_m_s,
            patience_steps=config.patience_steps,
            give_up_steps=config.give_up_steps,
        )
        self.counts = True
        """Whether the next step counts as one on the way; see `Planner.set_searching`."""
        self._left: list[tuple[Float64Array, int]] = []
        """Centre and number of voxels of each cluster that was left."""
        self.out_of_reach = OutOfReach(config.out_of_reach, config.look, speed_m_s)
        self._passing = PassingLook(config.passing, speed_m_s)

    @property
    def active(self) -> bool:
        """A cluster, or a place in passing, is being looked at."""
        return self._look.active or self._passing.active

    def reset(self) -> None:
        """Drop all clusters, for another object."""
        self._look.reset()
        self._left.clear()
        self.out_of_reach.reset()
        self._passing.reset()

    def cancel(self) -> None:
        """End the present look: the target ends the search."""
        self._look.interrupt()
        self._passing.cancel()

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
    ) -> LookTarget | None:
        """Return the viewpoint to look from, None if no cluster is worth it.

        Args:
            voxels: (M, 3) centres of OOI voxels, metres.
            around: Floor and map, for lines of sight and detours.
            tree: Shortest paths.
            xy: (capacity, 2) positions of the viewpoints, metres.
            T_world_base: Pose of the robot.
            termination_min: T_min.
            cut_short: See `OutOfReach.choose`.
        """
        ended = self._look.count_step(T_world_base, counts=self.counts)
        if ended is not None:
            self._left.append((ended.mean(axis=0), len(ended)))
        nodes = tree.order
        best: Sight | None = None
        known: Float64Array | None = None
        for rows in clusters_of(voxels, around.grid.voxel_size) if len(nodes) else ():
            cluster = voxels[rows]
            if len(cluster) <= self._config.share * termination_min:
                continue
            if self._was_left(cluster):
                least = max(termination_min, 0 if known is None else len(known))
                if len(cluster) > least and not self.out_of_reach.is_given_up(cluster):
                    known = cluster
                continue
            found = self._look.first_sight(cluster, nodes, around, tree, xy)
            if found is not None and (best is None or found.seconds < best.seconds):
                best = found
        if best is not None:
            self._passing.cancel()
            return self._look_down(self._look.aim(best, xy, around.camera_z_m))
        self._look.interrupt()
        look = None
        if known is not None:
            look = self.out_of_reach.choose(
                known, around, tree, xy, T_world_base,
                enough=termination_min, cut_short=cut_short, counts=self.counts,
            )  # fmt: skip
        if look is not None:
            self._passing.cancel()
            return look
        return self._passing.choose(
            around, tree, xy, T_world_base, termination_min=termination_min, counts=self.counts
        )

    def _look_down(self, look: LookTarget) -> LookTarget:
        """Direct the camera down in the last three quarters of the patience."""
        if self._look.settled_steps < self._config.patience_steps // 4:
            return look
        return replace(look, tilt_rad=look.tilt_rad - self._config.down_rad)

    def _was_left(self, cluster: Float64Array) -> bool:
        centre, size = cluster.mean(axis=0), len(cluster)
        return any(
            is_same_cluster(self._config.look, old, centre) and size < self._config.grown * count
            for old, count in self._left
        )

"""A look from nearby at what may be a small object, before exploring goes on.

A small object is recognised in few images from afar. Its evidence stays below p_T, so that it is
no cluster for a closer look, and its surface, which was seen, has no gain: the robot would drive on
and come back after everything else, or never. Where a viewpoint near such a place is soon reached,
the robot looks from there once.
"""

import math
from dataclasses import dataclass, field

from ippon.geometry import Float64Array
from ippon.mapping.objects.ooi_voxels import OoiVoxels, nearest_voxels
from ippon.planning.roadmap.shortest_tree import ShortestTree
from ippon.planning.selection.cluster_look import ClusterLook, Sight
from ippon.planning.selection.detours import Surroundings
from ippon.planning.selection.look_target import (
    LookConfig,
    LookTarget,
    is_same_cluster,
)
from ippon.planning.selection.voxel_clusters import clusters_of
from ippon.planning.surface_scale import surface_scale


@dataclass(frozen=True, slots=True, kw_only=True)
class PassingLookConfig:
    """Which places are worth a look in passing, and how long it lasts."""

    enabled: bool = True
    """Off where viewpoints are scored as in the paper."""
    evidence_nat: float = 1.5
    """Log-likelihood ratio above which a voxel may be the object; more looks at fewer places that
    are something else."""
    near_m: float = 1.4
    """Distance over the floor from which the place is looked at; more looks from viewpoints that
    recognise small objects less."""
    within_s: float = 15.0
    """Travel time to the viewpoint up to which the robot looks; more takes longer detours."""
    patience_steps: int = 6
    """Steps at the viewpoint, facing the place, after which it is done with; more waits for images
    that add little, since images from one place are one observation."""
    give_up_steps: int = 250
    """Steps on the way to the viewpoint after which the place is done with; more drives longer."""
    max_voxels: int = 512
    """Voxels, those nearest to the robot, that are considered; more takes longer."""
    look: LookConfig = field(default_factory=LookConfig)

    def __post_init__(self) -> None:
        """Reject distances and counts without meaning."""
        positive = 0.0 < self.evidence_nat < math.inf and self.near_m > 0.0
        if not positive or not self.within_s >= 0.0:
            raise ValueError(
                "evidence_nat must be finite, it and near_m above 0, within_s at least 0; got "
                f"{self.evidence_nat}, {self.near_m}, {self.within_s}"
            )
        if min(self.patience_steps, self.give_up_steps, self.max_voxels) < 1:
            raise ValueError(
                "patience_steps, give_up_steps and max_voxels must be at least 1; got "
                f"{self.patience_steps}, {self.give_up_steps}, {self.max_voxels}"
            )


class PassingLook:
    """Selects places to look at in passing; each is looked at once in a search."""

    def __init__(self, config: PassingLookConfig, speed_m_s: float) -> None:
        self._config = config
        self._look = ClusterLook(
            config.look,
            speed_m_s,
            patience_steps=config.patience_steps,
            give_up_steps=config.give_up_steps,
        )
        self._voxels: tuple[float, OoiVoxels] | None = None
        """The threshold of p(v in O), and the voxels above it."""
        self._done: list[Float64Array] = []
        """Centre of each place that was looked at."""

    @property
    def active(self) -> bool:
        """A place is being looked at."""
        return self._look.active

    def reset(self) -> None:
        """Forget all places, for another object."""
        self._look.reset()
        self._voxels = None
        self._done.clear()

    def cancel(self) -> None:
        """End the present look; its place may be looked at again."""
        self._look.interrupt()

    def choose(
        self,
        around: Surroundings,
        tree: ShortestTree,
        xy: Float64Array,
        T_world_base: Float64Array,
        *,
        termination_min: float,
        counts: bool = True,
    ) -> LookTarget | None:
        """Return the viewpoint to look from, None if no place is worth it.

        Args:
            around: Floor and map.
            tree: Shortest paths.
            xy: (capacity, 2) positions of the viewpoints, metres.
            T_world_base: Pose of the robot.
            termination_min: T_min; an object with more than that of a small one is recognised from
                afar, and voxels with little evidence are mostly something else.
            counts: See `ClusterLook.count_step`.
        """
        ended = self._look.count_step(T_world_base, counts=counts)
        if ended is not None:
            self._done.append(ended.mean(axis=0))
        best: Sight | None = None
        small = termination_min <= max(1.0, surface_scale(around.grid.voxel_size))
        if self._config.enabled and small and len(tree.order):
            voxels = self._doubtful(around, T_world_base)
            nodes = tree.order[tree.cost[tree.order] <= self._config.within_s]
            for rows in clusters_of(voxels, around.grid.voxel_size):
                cluster = voxels[rows]
                centre = cluster.mean(axis=0)
                if any(is_same_cluster(self._config.look, done, centre) for done in self._done):
                    continue
                found = self._look.first_sight(
                    cluster, nodes, around, tree, xy, self._config.near_m
                )
                if found is not None and (best is None or found.seconds < best.seconds):
                    best = found
        if best is None:
            self._look.interrupt()
            return None
        return self._look.aim(best, xy, around.camera_z_m)

    def _doubtful(self, around: Surroundings, T_world_base: Float64Array) -> Float64Array:
        """Return the (M, 3) centres of the voxels with enough evidence, metres."""
        log_odds = around.arrays.ooi_prior_log_odds + self._config.evidence_nat
        threshold = 1.0 / (1.0 + math.exp(-log_odds))
        if self._voxels is None or self._voxels[0] != threshold:
            # A label was added since.
            self._voxels = threshold, OoiVoxels(threshold)
        x, y = float(T_world_base[0, 3]), float(T_world_base[1, 3])
        centres = self._voxels[1].update(around.arrays)[0]
        return nearest_voxels(centres, x, y, self._config.max_voxels)

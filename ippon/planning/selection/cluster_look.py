"""A look at a cluster of voxels: from which viewpoint, and for how long it has lasted."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ippon.geometry import Float64Array
from ippon.planning.roadmap.shortest_tree import ShortestTree
from ippon.planning.selection.detours import Surroundings, farthest_point_sample
from ippon.planning.selection.interrupted_looks import INTERRUPTED_FACTOR, InterruptedLooks
from ippon.planning.selection.look_target import (
    LookConfig,
    LookTarget,
    is_same_cluster,
    look_at,
    stands_facing,
)


class Sight(NamedTuple):
    """A viewpoint that shows a cluster."""

    seconds: float
    """To the viewpoint, and from there to the cluster."""
    node: int
    voxel: Float64Array
    """(3,) a voxel in sight, metres."""
    cluster: Float64Array
    """(M, 3) voxel centres, metres."""


@dataclass(slots=True, kw_only=True)
class _Active:
    """The cluster that the robot looks at."""

    cluster: Float64Array
    centre: Float64Array
    node: int
    stand: Float64Array
    yaw_rad: float
    age: int = 0
    """Steps since the look began."""
    settled: int = 0
    """Steps in a row at the viewpoint, facing the cluster."""
    before: int = 0
    """Steps of interrupted looks at it."""


class ClusterLook:
    """The present look at a cluster; none at first."""

    def __init__(
        self, config: LookConfig, speed_m_s: float, *, patience_steps: int, give_up_steps: int
    ) -> None:
        """Begin without a look.

        Args:
            config: How viewpoints are chosen and reached.
            speed_m_s: Highest speed of the robot.
            patience_steps: Steps at the viewpoint, facing the cluster, after which the look ends.
            give_up_steps: Steps after which it ends wherever the robot is; interrupted looks at one
                cluster end after twice as many together.
        """
        self._config = config
        self._speed = speed_m_s
        self._patience_steps = patience_steps
        self._give_up_steps = give_up_steps
        self._now: _Active | None = None
        self._interrupted = InterruptedLooks(config, 1)

    @property
    def active(self) -> bool:
        """A cluster is being looked at."""
        return self._now is not None

    @property
    def settled_steps(self) -> int:
        """Steps in a row at the viewpoint, facing the cluster; 0 without a look."""
        return 0 if self._now is None else self._now.settled

    def reset(self) -> None:
        """End the look and forget all earlier ones, for another object."""
        self._now = None
        self._interrupted.clear()

    def interrupt(self) -> None:
        """End the look at a cluster that was not looked at for long enough."""
        now, self._now = self._now, None
        if now is not None:
            self._interrupted.add(now.centre, now.before + now.age)

    def first_sight(
        self,
        cluster: Float64Array,
        nodes: NDArray[np.int64],
        around: Surroundings,
        tree: ShortestTree,
        xy: Float64Array,
        near_m: float = math.inf,
    ) -> Sight | None:
        """Return the viewpoint in sight of a cluster from which it is reached soonest.

        Args:
            cluster: (M, 3) voxel centres, metres.
            nodes: (N,) viewpoints.
            around: Floor and map, for lines of sight.
            tree: Shortest paths to them.
            xy: (capacity, 2) positions of all viewpoints, metres.
            near_m: Distance over the floor up to which a viewpoint is near enough.
        """
        config = self._config
        away = np.linalg.norm(xy[nodes, None] - cluster[None, :, :2], axis=2).min(axis=1)
        near = away <= near_m
        nodes, away = nodes[near], away[near]
        seconds = tree.cost[nodes] + config.detour_factor * away / self._speed
        if self._now is not None:
            seconds[nodes == self._now.node] -= config.keep_s
        samples = farthest_point_sample(cluster, config.sight_points)
        for row in np.argsort(seconds, kind="stable")[: config.max_viewpoints].tolist():
            for voxel in samples:
                if around.is_visible(xy[nodes[row]], voxel):
                    return Sight(float(seconds[row]), int(nodes[row]), voxel, cluster)
        return None

    def aim(self, sight: Sight, xy: Float64Array, camera_z_m: float) -> LookTarget:
        """Begin or continue the look at a cluster.

        Args:
            sight: The viewpoint and the cluster.
            xy: (capacity, 2) positions of all viewpoints, metres.
            camera_z_m: Height of the camera in the world.
        """
        old, centre, stand = self._now, sight.cluster.mean(axis=0), xy[sight.node]
        goes_on = old is not None and is_same_cluster(self._config, old.centre, centre)
        if not goes_on:
            self.interrupt()
        target = look_at(sight.node, stand, sight.voxel, camera_z_m)
        self._now = _Active(
            cluster=sight.cluster,
            centre=centre,
            node=sight.node,
            stand=stand.copy(),
            yaw_rad=target.yaw_rad,
        )
        if old is not None and goes_on:
            self._now.age, self._now.before = old.age, old.before
            self._now.settled = old.settled if old.node == sight.node else 0
        else:
            (self._now.before,) = self._interrupted.take(centre)
        return target

    def count_step(self, T_world_base: Float64Array, *, counts: bool = True) -> Float64Array | None:
        """Count a step with the robot at a pose.

        Args:
            T_world_base: The pose.
            counts: Whether it counts as a step on the way; it does at the viewpoint in any case.

        Returns:
            The (M, 3) cluster whose look ends with this step, None for none.
        """
        now = self._now
        if now is None:
            return None
        now.age += counts
        stays = stands_facing(self._config, T_world_base, now.stand, now.yaw_rad)
        now.settled = now.settled + 1 if stays else 0
        lasts = now.before + now.age < INTERRUPTED_FACTOR * self._give_up_steps
        if now.settled < self._patience_steps and now.age < self._give_up_steps and lasts:
            return None
        self._now = None
        return now.cluster

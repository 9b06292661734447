"""Up to eight objects of interest in one map at once.

Each goal has its own evidence, updated as that of a map's only object of interest. The map's `ooi`
holds the highest p(v in O) of the goals that are still missing, so that whoever reads it sees an
object voxel where one of them has one. The highest, not the probability of at least one of them:
two doubtful goals in a voxel do not make an object voxel.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ippon.camera import PinholeCamera
from ippon.geometry import Float64Array
from ippon.mapping.arrays import NOT_MAPPED
from ippon.mapping.goal_layers.goal_arrays import (
    MAX_GOALS,
    GoalFusion,
    make_goal_arrays,
    make_goal_work,
)
from ippon.mapping.goal_layers.goal_kernels import (
    begin_goal_kernel,
    combine_goals_kernel,
    goal_voxels_kernel,
)
from ippon.mapping.goal_layers.goal_update import fuse_goals_kernel
from ippon.mapping.objects.likelihood_tables import channel_of
from ippon.mapping.objects.object_layers import ImageEntries, clear_m
from ippon.mapping.objects.ooi_suppression import (
    SuppressedRegion,
    ball_at,
    outside,
    surface_slots,
    values_before,
)
from ippon.mapping.objects.places import (
    begin_in_places,
    close_counted,
    current_places,
    places_since,
)
from ippon.mapping.objects.posterior_arithmetic import (
    LOG_ODDS_MAX,
    NONE,
    FusionInput,
    ooi_bounds,
    ooi_code,
    prior_log_odds,
)
from ippon.mapping.objects.surface_fusion import AHEAD
from ippon.mapping.objects.surface_voxels import N_USED
from ippon.mapping.voxel_map import VoxelMap
from ippon.observation import Heatmap


@dataclass(frozen=True, slots=True, kw_only=True)
class OoiTarget:
    """An object of interest; see `VoxelMap.set_ooi` for the fields."""

    label: str
    highest_m: float = math.inf
    lowest_m: float = -math.inf
    small_m: float = math.inf


class GoalLayers:
    """The evidence of a map for several objects of interest; replaces its object of interest.

    It ends with the next `VoxelMap.set_ooi`. It is not saved with the map.

    Args:
        voxel_map: The map, whose object of interest is unset.
        targets: 1 to `MAX_GOALS` objects of different labels.

    Raises:
        ValueError: Another number of objects, or two of one label.
    """

    def __init__(self, voxel_map: VoxelMap, targets: Sequence[OoiTarget]) -> None:
        self.labels = tuple(target.label for target in targets)
        if not 1 <= len(targets) <= MAX_GOALS or len(set(self.labels)) != len(targets):
            raise ValueError(
                f"a map takes 1 to {MAX_GOALS} objects of interest of different labels; got "
                f"{', '.join(self.labels) or 'none'}"
            )
        voxel_map.set_ooi(None)
        self._map = voxel_map
        self._targets = tuple(targets)
        self._layers = voxel_map._layers  # noqa: SLF001 - one package
        self._pools = voxel_map._pools  # noqa: SLF001 - one package
        self._directory = voxel_map._directory  # noqa: SLF001 - one package
        self._arrays = make_goal_arrays(
            len(voxel_map.surface.voxel), len(self._layers.accumulators.owner), len(targets)
        )
        self._work = make_goal_work(AHEAD, len(targets))
        self._suppressed: list[tuple[int, NDArray[np.float64]]] = []
        self._ended = np.zeros(len(targets), np.bool_)
        self._listed = [0] * len(targets)
        """Voxels of each goal when they were listed last."""
        self._layers.goals = self
        slots = np.arange(1, int(voxel_map.surface.tally[N_USED]))
        self._begin(range(len(targets)), slots)
        # `set_ooi` has begun a new revision of the map.
        self._combine()

    @property
    def asked(self) -> tuple[str, ...]:
        """Labels of the goals that images still update."""
        return tuple(x for x, ended in zip(self.labels, self._ended, strict=True) if not ended)

    def layer(self, label: str) -> "GoalLayer":
        """Return the evidence for one goal; raises ValueError for a label that is no goal."""
        return GoalLayer(self, self.labels.index(label))

    def log_odds(self, goal: int) -> NDArray[np.float32]:
        """Return (R,) the log-odds of a goal, one for each row of `VoxelMap.surface`."""
        return self._arrays.log_odds[:, goal]

    def codes(self, goal: int) -> NDArray[np.uint8]:
        """Return (R,) p(v in O) of a goal in units of 1/254, `NOT_MAPPED` for none."""
        return self._arrays.code[:, goal]

    def set_levels(self, levels: NDArray[np.uint8], probabilities: NDArray[np.float32]) -> None:
        """Set how likely a goal is near each common object; see `VoxelMap.set_levels`."""
        self._map.set_levels(levels, probabilities)

    def set_missing(self, goal: int, *, missing: bool) -> None:
        """Set whether a goal counts in the map's `ooi`; images update it either way."""
        self._arrays.missing[goal] = missing
        self._map.revision += 1
        self._combine()

    def end(self, goal: int) -> None:
        """Stop updating a goal: it was cancelled or confirmed."""
        self._ended[goal] = True
        self.set_missing(goal, missing=False)

    def fuse(
        self,
        image: ImageEntries,
        fusion: FusionInput,
        heatmap: Heatmap | None,
        camera: PinholeCamera,
        floor_z_m: float,
        revision: int,
    ) -> int:
        """Update the goals from an image; see `fuse_goals_kernel`."""
        layers = self._layers
        clear = [clear_m(fusion.mode, camera, target.small_m) for target in self._targets]
        goals = self._properties(heatmap, clear, floor_z_m)
        return int(
            fuse_goals_kernel(
                image.entries, image.n_entries, image.work, self._work, image.depth, image.color,
                fusion, goals, len(layers.labels), self._map.config.voxel_size_m, self._pools,
                layers.surface, layers.accumulators, self._arrays, revision,
            )
        )  # fmt: skip

    def suppress(
        self, goal: int, centre_world: NDArray[np.float64], radius_m: float
    ) -> SuppressedRegion:
        """Exclude a goal from a ball; see `VoxelMap.suppress_ooi`."""
        ball, others = ball_at(centre_world, radius_m), self._balls_of(goal)
        self._suppressed.append((goal, ball))
        voxel, slots = self._surface_in(ball, others[:0])
        log_odds, code = self._arrays.log_odds[:, goal], self._arrays.code[:, goal]
        free = outside(voxel, others, self._map.config.voxel_size_m)
        at, places = slots[free], self._layers.surface.ooi_places
        before = SuppressedRegion(ball, voxel[free], log_odds[at], code[at], places[at])
        log_odds[slots] = -LOG_ODDS_MAX
        code[slots[code[slots] != NOT_MAPPED]] = ooi_code(-LOG_ODDS_MAX)
        self._map.revision += 1
        self._combine()
        return before

    def restore(self, goal: int, region: SuppressedRegion) -> None:
        """Undo `suppress`; see `VoxelMap.restore_ooi`."""
        self._suppressed = [
            (g, ball)
            for g, ball in self._suppressed
            if g != goal or not (ball == region.ball).all()
        ]
        log_odds, code = self._arrays.log_odds[:, goal], self._arrays.code[:, goal]
        voxel, slots = self._surface_in(region.ball, self._balls_of(goal))
        if self._alias(self.labels[goal]) >= 0:
            self._begin([goal], slots)
        else:
            values = values_before(region, voxel, self._prior(goal))
            log_odds[slots] = values.log_odds
            code[slots] = np.where(code[slots] == NOT_MAPPED, NOT_MAPPED, values.code)
            # Other goals have seen the places meanwhile: those that were left stay closed.
            layers = self._layers
            held, at = places_since(layers.surface, layers.accumulators, slots, values.places)
            self._arrays.base_log_odds[held, goal] = values.log_odds[at]
        self._map.revision += 1
        self._combine()

    def voxels(self, goal: int, threshold: float) -> tuple[Float64Array, NDArray[np.float64]]:
        """Return centres (M, 3) in metres and p(v in O) (M,) of a goal's occupied voxels.

        Args:
            goal: The goal.
            threshold: Voxels up to this probability are left out.
        """
        limit = math.floor(threshold * 254.0)
        found = (self._pools, self._layers.surface, self._arrays.code, goal, limit)
        # Mostly there are about as many as before, and one pass over the surface is enough.
        room = self._listed[goal] + 256
        while True:
            index, value = np.empty((room, 3), np.int64), np.empty(room, np.uint8)
            n = goal_voxels_kernel(*found, index, value)
            if n <= room:
                break
            room = n
        self._listed[goal] = n
        edge = self._map.config.voxel_size_m
        centres: Float64Array = (index[:n].astype(np.float64) + 0.5) * edge
        return centres, value[:n].astype(np.float64) / 254.0

    def _begin(self, chosen: Iterable[int], slots: NDArray[np.int64]) -> None:
        """Begin goals in some voxels, the current places of which go on."""
        layers, arrays = self._layers, self._arrays
        goals = self._properties(None, [math.inf] * len(self._targets), self._map.floor_z_m)
        rows, at = current_places(layers.surface, slots)
        for goal in chosen:
            begin_goal_kernel(
                self._pools, layers.surface, arrays, goals, goal, slots, len(layers.labels)
            )
            sums, images, base = begin_in_places(
                layers.accumulators, rows, arrays.log_odds[slots[at], goal], int(goals.alias[goal])
            )
            close_counted(layers.surface, layers.accumulators, slots[at], rows, images)
            arrays.sums[rows, goal], arrays.images[rows, goal] = sums, images
            arrays.base_log_odds[rows, goal] = base

    def _combine(self) -> None:
        """Write the map's `ooi` again, as its present revision."""
        voxel_map = self._map
        missing = zip(self._targets, self._arrays.missing, strict=True)
        # The smallest of the missing objects decides from where a miss is evidence.
        self._layers.ooi_small_m = min(
            (target.small_m for target, is_missing in missing if is_missing), default=math.inf
        )
        combine_goals_kernel(self._pools, voxel_map.surface, self._arrays, voxel_map.revision)

    def _balls_of(self, goal: int) -> NDArray[np.float64]:
        """Return the (K, 4) balls in which a goal is suppressed."""
        return np.array([ball for g, ball in self._suppressed if g == goal]).reshape(-1, 4)

    def _surface_in(
        self, ball: NDArray[np.float64], others: NDArray[np.float64]
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return the surface in a ball and in none of others; see `surface_slots`."""
        edge = self._map.config.voxel_size_m
        return surface_slots(ball, others, self._pools, self._directory, edge)

    def _alias(self, label: str) -> int:
        labels = self._layers.labels
        return labels.index(label) if label in labels else NONE

    def _prior(self, goal: int) -> np.float32:
        return prior_log_odds(len(self._layers.labels), self._alias(self.labels[goal]))

    def _properties(
        self, heatmap: Heatmap | None, clear: Sequence[float], floor_z_m: float
    ) -> GoalFusion:
        """Return the goals as kernel arguments for an image, or for none."""
        targets, edge = self._targets, self._map.config.voxel_size_m
        channel = [NONE if heatmap is None else channel_of(heatmap, x) for x in self.labels]
        channel = [NONE if e else c for c, e in zip(channel, self._ended, strict=True)]
        likelihood_of, table_of = self._layers.likelihoods(heatmap, self.labels, None)
        bounds = [ooi_bounds(t.lowest_m, t.highest_m, floor_z_m, edge) for t in targets]
        balls = [ball for _, ball in self._suppressed]
        return GoalFusion(
            channel=np.array(channel, np.int64),
            alias=np.array([self._alias(x) for x in self.labels], np.int64),
            prior=np.array([self._prior(g) for g in range(len(targets))], np.float32),
            likelihood_of=likelihood_of,
            table_of=table_of,
            clear_m=np.array(clear, np.float64),
            bounds=np.array(bounds, np.int64),
            suppressed=np.array(balls, np.float64).reshape(-1, 4),
            suppressed_goal=np.array([g for g, _ in self._suppressed], np.int64),
        )


@dataclass(frozen=True, slots=True)
class GoalLayer:
    """The evidence for one of several goals, with the interface of a map's only one."""

    goals: GoalLayers
    column: int

    def suppress_ooi(self, centre_world: NDArray[np.float64], radius_m: float) -> SuppressedRegion:
        """Exclude the goal from a ball; see `VoxelMap.suppress_ooi`."""
        return self.goals.suppress(self.column, centre_world, radius_m)

    def restore_ooi(self, ruled_out: SuppressedRegion) -> None:
        """Undo `suppress_ooi`."""
        self.goals.restore(self.column, ruled_out)

    def voxels(self, threshold: float) -> tuple[Float64Array, NDArray[np.float64]]:
        """Return centres (M, 3) in metres and p(v in O) (M,) of its voxels above a threshold."""
        return self.goals.voxels(self.column, threshold)

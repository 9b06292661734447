"""Labels, levels and the object of interest of a map, and changes of them."""

import math
from collections.abc import Sequence
from typing import Final, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from ippon.camera import PinholeCamera
from ippon.mapping.arrays import read_only
from ippon.mapping.blocks import N_ROWS, BlockDirectory, Pools
from ippon.mapping.config import SURFACE_VOXELS_PER_BLOCK, MapConfig
from ippon.mapping.level_probabilities import LEVEL_PROBABILITIES
from ippon.mapping.objects.layer_kernels import (
    give_prior_share,
    relevel_kernel,
    reset_ooi_kernel,
    start_ooi,
)
from ippon.mapping.objects.likelihood_tables import LikelihoodTables, channel_of
from ippon.mapping.objects.ooi_suppression import (
    SuppressedRegion,
    ball_at,
    restore,
    suppress,
    surface_slots,
)
from ippon.mapping.objects.places import (
    MAX_OPEN_PLACES,
    N_OPENED,
    make_place_accumulators,
    reopen_for_added_labels,
    reopen_for_ooi,
)
from ippon.mapping.objects.posterior_arithmetic import (
    MODES,
    NONE,
    PAPER,
    PLACES,
    FusionInput,
    energy_table,
    ooi_bounds,
    prior_log_odds,
)
from ippon.mapping.objects.surface_fusion import FusionWork
from ippon.mapping.objects.surface_voxels import (
    ENERGY_MAX,
    N_FREE,
    N_USED,
    SurfaceVoxels,
    make_surface_voxels,
)
from ippon.observation import Heatmap
from ippon.observation_model import ObservationModels

AVERAGE_LEVEL: Final = 1
MAX_LABELS: Final = 255
CLEAR_SHARE: Final = 0.05
"""Share of the image's longer side, 32 of 640 pixels, from which an object is detected nearly as
often as from nearby; measured with NanoDet-Plus (docs/results.md)."""


class GoalFuser(Protocol):
    """Several objects of interest; see `ippon.mapping.goal_layers.goal_layers.GoalLayers`."""

    def fuse(
        self,
        image: "ImageEntries",
        fusion: FusionInput,
        heatmap: Heatmap | None,
        camera: PinholeCamera,
        floor_z_m: float,
        revision: int,
    ) -> int:
        """Update the goals from an image before the common objects are; return the voxels."""
        ...


class ImageEntries(NamedTuple):
    """The surface voxels that an image shows, as `fuse_kernel` takes them."""

    entries: NDArray[np.int32]
    n_entries: int
    work: FusionWork
    depth: NDArray[np.float32]
    color: NDArray[np.uint8]


class ObjectLayers:
    """Surface voxels with their labels; see `VoxelMap` for the methods of the same names."""

    def __init__(
        self,
        config: MapConfig,
        labels: Sequence[str],
        pools: Pools,
        models: ObservationModels | None = None,
    ) -> None:
        if isinstance(labels, str):
            raise TypeError(f"labels are a sequence of names; got the single string {labels!r}")
        if not 1 <= len(labels) <= MAX_LABELS or len(set(labels)) != len(labels):
            raise ValueError(
                f"a map takes 1 to {MAX_LABELS} different labels; got {len(labels)}, "
                f"{len(set(labels))} of them different"
            )
        self.labels = tuple(labels)
        self.ooi: str | None = None
        self.surface: SurfaceVoxels = make_surface_voxels(
            config.max_blocks * SURFACE_VOXELS_PER_BLOCK, len(labels)
        )
        self.levels = np.full(len(labels), AVERAGE_LEVEL, np.uint8)
        self.level_probabilities = np.array(LEVEL_PROBABILITIES, np.float32)
        self.suppressed: NDArray[np.float64] = np.empty((0, 4), np.float64)
        self.ooi_highest_m = math.inf
        """Height above the floor from which nothing is the object of interest."""
        self.ooi_lowest_m = -math.inf
        """Height above the floor up to which nothing is the object of interest."""
        self.ooi_small_m = math.inf
        """Side of a small object of interest in an image, metres."""
        self.ooi_clear_m = math.inf
        """Depth up to which a miss in the last image is evidence, metres."""
        self.goals: GoalFuser | None = None
        """Several objects of interest, in place of `ooi`."""
        self._config = config
        self._pools = pools
        self._settled = len(labels)
        """Labels from this one on were added last."""
        self._opened_at_add = -1
        """`N_OPENED` when the last label was added."""
        self._energy_of = energy_table(config.likelihood_floor)
        self._likelihoods = LikelihoodTables(models or ObservationModels())
        self.accumulators = make_place_accumulators(
            MAX_OPEN_PLACES if config.fusion == "places" else 1, self.surface.energy.shape[1]
        )

    def has_room_for(self, blocks: int) -> bool:
        """Tell whether rows for the surface voxels of this many blocks are free."""
        rows = self.surface
        left = len(rows.voxel) - int(rows.tally[N_USED]) + int(rows.tally[N_FREE])
        return left >= blocks * SURFACE_VOXELS_PER_BLOCK // 2

    def set_ooi(
        self,
        ooi: str | None,
        highest_m: float,
        floor_z_m: float,
        revision: int,
        *,
        lowest_m: float,
        small_m: float,
    ) -> None:
        """Set the object of interest and reset its probabilities; ends several goals."""
        self.goals = None
        self.ooi, self.ooi_highest_m, self.ooi_lowest_m = ooi, highest_m, lowest_m
        self.ooi_small_m, self.ooi_clear_m = small_m, math.inf
        self.suppressed = np.empty((0, 4), np.float64)
        prior = prior_log_odds(len(self.labels), self._alias())
        rows = int(self._pools.tally[N_ROWS])
        reset_ooi_kernel(self._pools, self.surface, rows, prior, revision)
        slots = np.arange(1, int(self.surface.tally[N_USED]))
        reopen_for_ooi(self.surface, self.accumulators, slots, np.zeros(len(slots), np.uint64))
        self._start_ooi(slots, floor_z_m, revision)

    def set_models(self, models: ObservationModels) -> None:
        """Set the observation models of later images."""
        self._likelihoods = LikelihoodTables(models)

    def set_levels(
        self, levels: NDArray[np.uint8], probabilities: NDArray[np.float32], revision: int
    ) -> None:
        """Set new levels and recompute level and proximity of every labelled voxel."""
        if levels.shape != (len(self.labels),) or probabilities.shape != (4,):
            raise ValueError(
                f"levels are one for each of {len(self.labels)} labels and probabilities four; got "
                f"{levels.shape} and {probabilities.shape}"
            )
        if not np.isin(levels, (0, 1, 2, 3)).all():
            raise ValueError(f"levels are 0 to 3; got {levels.min()} to {levels.max()}")
        if not ((probabilities >= 0.0) & (probabilities <= 1.0)).all():
            raise ValueError(f"probabilities of levels lie in [0, 1]; got {probabilities}")
        self.levels = levels.astype(np.uint8)
        self.level_probabilities = probabilities.astype(np.float32)
        self._relevel(revision)

    def add_label(self, label: str, revision: int) -> None:
        """Add a label to every row."""
        if label in self.labels:
            raise ValueError(f"{label!r} is already a label of this map")
        n = len(self.labels)
        if n == MAX_LABELS:
            raise ValueError(f"a map takes at most {MAX_LABELS} labels")
        if int(self.accumulators.tally[N_OPENED]) != self._opened_at_add:
            # What was added since the last image is added together.
            self._settled = n
        if n == self.surface.energy.shape[1]:
            wider = make_surface_voxels(len(self.surface.voxel), n + 1).energy
            used = int(self.surface.tally[N_USED])
            wider[:used] = ENERGY_MAX
            wider[:used, :n] = self.surface.energy[:used]
            self.surface = self.surface._replace(energy=wider)
            self.accumulators = make_place_accumulators(
                len(self.accumulators.owner) - 1, wider.shape[1]
            )
        reopen_for_added_labels(self.surface)
        self._opened_at_add = int(self.accumulators.tally[N_OPENED])
        give_prior_share(self.surface, n)
        self.labels = (*self.labels, label)
        self.levels = np.append(self.levels, np.uint8(AVERAGE_LEVEL))
        self._relevel(revision)

    def suppress_ooi(
        self,
        centre_world: NDArray[np.float64],
        radius_m: float,
        directory: BlockDirectory,
        revision: int,
    ) -> SuppressedRegion:
        """Exclude the current object of interest from a ball."""
        ball, others = ball_at(centre_world, radius_m), self.suppressed
        self.suppressed = np.concatenate([others, ball[None]])
        size_m = self._config.voxel_size_m
        return suppress(ball, others, self._pools, self.surface, directory, size_m, revision)

    def restore_ooi(
        self,
        region: SuppressedRegion,
        directory: BlockDirectory,
        floor_z_m: float,
        revision: int,
    ) -> None:
        """Undo `suppress_ooi`: the map's values of that time return, or those of its label now."""
        same = (self.suppressed == region.ball).all(axis=1)
        self.suppressed = self.suppressed[~same]
        size_m, alias = self._config.voxel_size_m, self._alias()
        prior = prior_log_odds(len(self.labels), alias)
        if alias >= 0:
            _, slots = surface_slots(region.ball, self.suppressed, self._pools, directory, size_m)
            self.surface.log_odds[slots] = prior
            self._start_ooi(slots, floor_z_m, revision)
            return
        held = self.accumulators
        restore(
            region, self.suppressed, self._pools, self.surface, held, directory, size_m, prior,
            revision,
        )  # fmt: skip

    @property
    def ooi_prior_log_odds(self) -> float:
        """Log-odds of p(v in O) of a voxel without evidence; infinite without an OOI."""
        return (
            math.inf if self.ooi is None else float(prior_log_odds(len(self.labels), self._alias()))
        )

    def _start_ooi(self, slots: NDArray[np.int64], floor_z_m: float, revision: int) -> None:
        start_ooi(
            self._pools, self.surface, self.accumulators, slots, len(self.labels), self._alias(),
            self._ooi_bounds(floor_z_m), revision,
        )  # fmt: skip

    def _ooi_bounds(self, floor_z_m: float) -> tuple[int, int, int]:
        lowest_m, highest_m = self.ooi_lowest_m, self.ooi_highest_m
        return ooi_bounds(lowest_m, highest_m, floor_z_m, self._config.voxel_size_m)

    def likelihoods(
        self, heatmap: Heatmap | None, labels: tuple[str, ...], ooi: str | None
    ) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
        """Return the likelihood ratios of a heatmap's values; see `LikelihoodTables.of`."""
        return self._likelihoods.of(heatmap, labels, ooi)

    def fusion_input(
        self,
        heatmap: Heatmap | None,
        floor_z_m: float,
        camera: PinholeCamera,
        camera_at: tuple[float, float, float],
    ) -> FusionInput:
        """Return a heatmap as kernel arguments.

        Args:
            heatmap: Of the image, or None.
            floor_z_m: Height of the floor, metres.
            camera: Intrinsics of the image.
            camera_at: World position of the camera, metres.
        """
        cfg, n = self._config, len(self.labels)
        channel = np.full(n, NONE, np.int64)
        ooi_channel = NONE
        probabilities = np.zeros((1, 1, 1), np.uint8)
        if heatmap is not None:
            probabilities = heatmap.probabilities
            channel = np.array([channel_of(heatmap, label) for label in self.labels], np.int64)
            ooi_channel = NONE if self.ooi is None else channel_of(heatmap, self.ooi)
        likelihood_of, table_of = self._likelihoods.of(heatmap, self.labels, self.ooi)
        mode = _mode(cfg, heatmap)
        if heatmap is not None:
            self.ooi_clear_m = clear_m(mode, camera, self.ooi_small_m)
        return FusionInput(
            probabilities=read_only(probabilities),
            has_heatmap=heatmap is not None,
            channel=channel,
            in_order=bool((channel == np.arange(n)).all()),
            ooi_channel=ooi_channel,
            ooi_alias=self._alias(),
            settled=self._settled,
            prior=prior_log_odds(n, self._alias()),
            energy_of=self._energy_of,
            common_max_m=cfg.common_max_range_m,
            ooi_max_m=cfg.ooi_max_range_m,
            ooi_clear_m=self.ooi_clear_m,
            mode=mode,
            likelihood_of=likelihood_of,
            table_of=table_of,
            camera_at=camera_at,
            levels=self.levels,
            level_probability=self.level_probabilities[self.levels],
            suppressed=self.suppressed,
            ooi_bounds=self._ooi_bounds(floor_z_m),
        )

    def _alias(self) -> int:
        return self.labels.index(self.ooi) if self.ooi in self.labels else NONE

    def _relevel(self, revision: int) -> None:
        relevel_kernel(
            self._pools,
            self.surface,
            len(self.labels),
            self.levels,
            self.level_probabilities[self.levels],
            revision,
        )


def clear_m(mode: int, camera: PinholeCamera, small_m: float) -> float:
    """Return `FusionInput.ooi_clear_m` of an object with a side of `small_m` in images."""
    longer_px = max(camera.width, camera.height)
    return camera.fx / longer_px * small_m / CLEAR_SHARE if mode == PLACES else math.inf


def _mode(config: MapConfig, heatmap: Heatmap | None) -> int:
    """Return the fusion rule of a heatmap; distributions use the paper's filter."""
    if config.fusion == "places" and (heatmap is None or heatmap.kind == "distribution"):
        return PAPER
    return MODES[config.fusion]

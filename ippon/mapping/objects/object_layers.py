"""The labels that the map tells apart, the object that is searched for, and changes of either."""

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ippon.mapping.arrays import BLOCK_EDGE, BLOCK_VOLUME, INNER, NOT_MAPPED, read_only
from ippon.mapping.blocks import N_ROWS, NO_SLAB, BlockDirectory, Pools
from ippon.mapping.config import SURFACE_ROWS_PER_BLOCK, MapConfig
from ippon.mapping.objects.bayes_filter import (
    LOG_ODDS_MAX,
    MODES,
    NONE,
    PAPER,
    FusionInput,
    describe,
    energy_table,
    exp_of_steps,
    may_be_ooi,
    ooi_code,
    prior_log_odds,
)
from ippon.mapping.objects.likelihood_tables import LikelihoodTables
from ippon.mapping.objects.places import (
    MAX_WITNESSES,
    close_places,
    forget_places,
    make_witnesses,
)
from ippon.mapping.objects.surface_rows import (
    ENERGY_MAX,
    N_FREE,
    N_USED,
    NO_LABEL,
    NORM_STEPS,
    STEPS_PER_NAT,
    SurfaceRows,
    make_surface_rows,
    norm_code,
)
from ippon.observation import Heatmap
from ippon.observation_model import ObservationModels

AVERAGE_LEVEL: Final = 1
MAX_LABELS: Final = 255
UNDERFOOT_M: Final = 0.2
"""As far below the floor that the robot stands on as that floor shows, with the errors of depth and
pose. What is lower may be another floor, with things on it."""
_EVERYWHERE_M: Final = 1e6


class RuledOut(NamedTuple):
    """A ball that is ruled out for the object of interest, and what the map held of it there."""

    ball: NDArray[np.float64]
    """(4,) centre in the world and radius, metres."""
    voxel: NDArray[np.int64]
    """(M, 3) voxels with a surface."""
    log_odds: NDArray[np.float32]
    """(M,) of the object of interest."""
    code: NDArray[np.uint8]
    """(M,) its probability, as `MapArrays.ooi` gives it."""


class ObjectLayers:
    """Surface rows and what they mean; see `VoxelMap` for the methods of the same names."""

    def __init__(
        self,
        config: MapConfig,
        labels: Sequence[str],
        pools: Pools,
        models: ObservationModels | None = None,
    ) -> None:
        if isinstance(labels, str):
            raise TypeError(f"labels are a sequence of names; got the one text {labels!r}")
        if not 1 <= len(labels) <= MAX_LABELS or len(set(labels)) != len(labels):
            raise ValueError(
                f"a map takes 1 to {MAX_LABELS} different labels; got {len(labels)}, "
                f"{len(set(labels))} of them different"
            )
        self.labels = tuple(labels)
        self.ooi: str | None = None
        self.surface: SurfaceRows = make_surface_rows(
            config.max_blocks * SURFACE_ROWS_PER_BLOCK, len(labels)
        )
        self.levels = np.full(len(labels), AVERAGE_LEVEL, np.uint8)
        self.level_probabilities = np.array([0.02, 0.1, 0.25, 0.6], np.float32)
        self.suppressed: NDArray[np.float64] = np.empty((0, 4), np.float64)
        self.ooi_highest_m = math.inf
        """Above the floor; the object of interest is not up there."""
        self.ooi_lowest_m = -math.inf
        """Above the floor; what lies between the floor and that is not the object of interest."""
        self._config = config
        self._pools = pools
        self._energy_of = energy_table(config.likelihood_floor)
        self._likelihoods = LikelihoodTables(models or ObservationModels())
        self.witnesses = make_witnesses(
            MAX_WITNESSES if config.fusion == "places" else 1, self.surface.energy.shape[1]
        )

    def has_room_for(self, blocks: int) -> bool:
        """Tell whether every voxel on the surface of so many blocks would find a row."""
        rows = self.surface
        left = len(rows.voxel) - int(rows.tally[N_USED]) + int(rows.tally[N_FREE])
        return left >= blocks * SURFACE_ROWS_PER_BLOCK // 2

    def set_ooi(
        self,
        ooi: str | None,
        highest_m: float,
        floor_z_m: float,
        revision: int,
        *,
        lowest_m: float,
    ) -> None:
        """Start anew for another object of interest."""
        self.ooi, self.ooi_highest_m, self.ooi_lowest_m = ooi, highest_m, lowest_m
        self.suppressed = np.empty((0, 4), np.float64)
        forget_places(self.surface, slice(0, int(self.surface.tally[N_USED])))
        rows = int(self._pools.tally[N_ROWS])
        n, alias = len(self.labels), self._alias()
        prior = prior_log_odds(n, alias)
        bounds = self._ooi_bounds(floor_z_m)
        _reset_ooi_kernel(self._pools, self.surface, rows, n, alias, prior, bounds, revision)

    def set_models(self, models: ObservationModels) -> None:
        """Read scores by other models."""
        self._likelihoods = LikelihoodTables(models)

    def set_levels(
        self, levels: NDArray[np.uint8], probabilities: NDArray[np.float32], revision: int
    ) -> None:
        """Derive level and proximity of every labelled voxel from new levels."""
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
        """Make room for one more label in every row."""
        if label in self.labels:
            raise ValueError(f"{label!r} is already a label of this map")
        n = len(self.labels)
        if n == MAX_LABELS:
            raise ValueError(f"a map takes at most {MAX_LABELS} labels")
        if n == self.surface.energy.shape[1]:
            wider = make_surface_rows(len(self.surface.voxel), n + 1).energy
            used = int(self.surface.tally[N_USED])
            wider[:used] = ENERGY_MAX
            wider[:used, :n] = self.surface.energy[:used]
            self.surface = self.surface._replace(energy=wider)
            self.witnesses = make_witnesses(len(self.witnesses.owner) - 1, wider.shape[1])
        close_places(self.surface, slice(0, int(self.surface.tally[N_USED])))
        _give_prior_share(self.surface, n)
        self.labels = (*self.labels, label)
        self.levels = np.append(self.levels, np.uint8(AVERAGE_LEVEL))
        self._relevel(revision)

    def suppress_ooi(
        self,
        centre_world: NDArray[np.float64],
        radius_m: float,
        directory: BlockDirectory,
        revision: int,
    ) -> RuledOut:
        """Rule a ball out for the current object of interest."""
        ball = np.array([*centre_world, radius_m], np.float64)
        if ball.shape != (4,) or not np.isfinite(ball).all() or radius_m <= 0.0:
            raise ValueError(
                f"a ball is a finite (3,) centre and a positive radius; got {centre_world}, "
                f"{radius_m}"
            )
        self.suppressed = np.concatenate([self.suppressed, ball[None]])
        rows, voxel, inside = self._surface_in(ball, directory)
        pools = self._pools
        slabs = pools.slab[rows]
        slots = pools.slot[slabs]
        with_row = inside & (slots != 0)
        before = RuledOut(
            ball,
            voxel[with_row],
            self.surface.log_odds[slots[with_row]],
            pools.ooi[slabs][with_row],
        )
        self.surface.log_odds[slots[with_row]] = -LOG_ODDS_MAX
        mapped = inside & (pools.ooi[slabs] != NOT_MAPPED)
        self._set_codes(rows, mapped, int(ooi_code(-LOG_ODDS_MAX)), revision)
        return before

    def readmit_ooi(self, ruled_out: RuledOut, directory: BlockDirectory, revision: int) -> None:
        """Take a ball back that was ruled out, with what the map held of it then."""
        same = (self.suppressed == ruled_out.ball).all(axis=1)
        self.suppressed = self.suppressed[~same]
        rows, voxel, inside = self._surface_in(ruled_out.ball, directory)
        pools, log_odds = self._pools, self.surface.log_odds
        slots = pools.slot[pools.slab[rows]]
        inside &= slots != 0
        # What was first seen in the meantime starts anew.
        forget_places(self.surface, slots[inside])
        fresh = slots[inside][log_odds[slots[inside]] == -LOG_ODDS_MAX]
        log_odds[fresh] = prior_log_odds(len(self.labels), self._alias())
        if not len(ruled_out.voxel) or not inside.any():
            return
        corner = np.minimum(ruled_out.voxel.min(axis=0), voxel[inside].min(axis=0))
        side = np.maximum(ruled_out.voxel.max(axis=0), voxel[inside].max(axis=0)) - corner + 1
        _, here, then = np.intersect1d(
            np.ravel_multi_index(tuple((voxel[inside] - corner).T), tuple(side)),
            np.ravel_multi_index(tuple((ruled_out.voxel - corner).T), tuple(side)),
            return_indices=True,
        )
        log_odds[slots[inside][here]] = ruled_out.log_odds[then]
        codes = np.full(inside.size, NOT_MAPPED, np.uint8)
        codes[np.flatnonzero(inside)[here]] = ruled_out.code[then]
        codes = codes.reshape(inside.shape)
        mapped = (codes != NOT_MAPPED) & (pools.ooi[pools.slab[rows]] != NOT_MAPPED)
        self._set_codes(rows, mapped, codes[mapped], revision)

    def _surface_in(
        self, ball: NDArray[np.float64], directory: BlockDirectory
    ) -> tuple[NDArray[np.int32], NDArray[np.int64], NDArray[np.bool_]]:
        """Return (B,) blocks with a surface, (B, 512, 3) their voxels, (B, 512) those in a ball."""
        edge = BLOCK_EDGE * self._config.voxel_size_m
        low = np.floor((ball[:3] - ball[3]) / edge).astype(np.int64)
        high = np.floor((ball[:3] + ball[3]) / edge).astype(np.int64) + 1
        rows = directory.part(low, high)[1].ravel()
        rows = rows[rows >= 0]
        rows = rows[self._pools.slab[rows] != NO_SLAB]
        k = np.arange(BLOCK_VOLUME)
        inner = np.stack([k >> 6, (k >> 3) & 7, k & 7], axis=1)
        voxel = self._pools.coord[rows][:, None].astype(np.int64) * BLOCK_EDGE + inner
        away = (voxel + 0.5) * self._config.voxel_size_m - ball[:3]
        return rows, voxel, (away**2).sum(axis=2) <= ball[3] ** 2

    def _set_codes(
        self,
        rows: NDArray[np.int32],
        where: NDArray[np.bool_],
        code: int | NDArray[np.uint8],
        revision: int,
    ) -> None:
        """Write the OOI's probability of (B, 512) voxels of blocks, as code of `ooi_code`."""
        pools = self._pools
        codes = pools.ooi[pools.slab[rows]]
        codes[where] = code
        pools.ooi[pools.slab[rows]] = codes
        pools.best_ooi[rows] = np.where(codes == NOT_MAPPED, 0, codes).max(axis=1, initial=0)
        changed = rows[where.any(axis=1)]
        pools.revision[changed] = pools.appearance[changed] = revision

    def _ooi_bounds(self, floor_z_m: float) -> tuple[int, int, int]:
        """Return `FusionInput.ooi_bounds`: a voxel is where its centre is."""
        edge = self._config.voxel_size_m
        heights_m = (-UNDERFOOT_M, max(self.ooi_lowest_m, -UNDERFOOT_M), self.ooi_highest_m)
        low, high, top = (
            math.floor(min(floor_z_m + z, _EVERYWHERE_M) / edge + 0.5 + 1e-6) for z in heights_m
        )
        return low, high, top

    def fusion_input(
        self, heatmap: Heatmap | None, floor_z_m: float, camera_at: tuple[float, float, float]
    ) -> FusionInput:
        """Return a frame's heatmap as the kernel takes it.

        Args:
            heatmap: What the image says; None for nothing.
            floor_z_m: Height of the floor, metres.
            camera_at: Where the image was taken, metres.
        """
        cfg, n = self._config, len(self.labels)
        channel = np.full(n, NONE, np.int64)
        ooi_channel = NONE
        probabilities = np.zeros((1, 1, 1), np.uint8)
        if heatmap is not None:
            probabilities = heatmap.probabilities
            index = {label: i for i, label in enumerate(heatmap.labels)}
            channel = np.array([index.get(label, NONE) for label in self.labels], np.int64)
            if self.ooi is not None and heatmap.ooi == self.ooi:
                at = heatmap.ooi_channel
                ooi_channel = NONE if at is None else at
        likelihood_of, table_of = self._likelihoods.of(heatmap, self.labels, self.ooi)
        return FusionInput(
            probabilities=read_only(probabilities),
            has_heatmap=heatmap is not None,
            channel=channel,
            in_order=bool((channel == np.arange(n)).all()),
            ooi_channel=ooi_channel,
            ooi_alias=self._alias(),
            prior=prior_log_odds(n, self._alias()),
            energy_of=self._energy_of,
            common_max_m=cfg.common_max_range_m,
            ooi_max_m=cfg.ooi_max_range_m,
            mode=_mode(cfg, heatmap),
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
        _relevel_kernel(
            self._pools,
            self.surface,
            len(self.labels),
            self.levels,
            self.level_probabilities[self.levels],
            revision,
        )


@njit(cache=True, nogil=True)
def _reset_ooi_kernel(pools, surface, rows, labels, alias, prior, bounds, revision):
    """Forget the object of interest; where the new one is common label `alias`, start from it."""
    for row in range(rows):
        slab = pools.slab[row]
        if slab != NO_SLAB and _count_mapped(pools.ooi[slab]) > 0:
            pools.ooi[slab, :] = NOT_MAPPED
            pools.best_ooi[row] = 0
            pools.revision[row] = revision
            pools.appearance[row] = revision
    floor_code = ooi_code(-LOG_ODDS_MAX)
    no_weights = np.zeros(labels, np.float32)
    for slot in range(1, surface.tally[0]):
        surface.log_odds[slot] = prior
        at = surface.voxel[slot]
        if alias < 0 or at < 0 or surface.label[slot] == NO_LABEL:
            continue
        log_q = -np.float32(surface.energy[slot, alias]) / STEPS_PER_NAT
        log_q -= surface.log_norm[slot] / NORM_STEPS
        if log_q > -1.0:
            # Near 1 the odds hang on the small rest, which the stored normaliser is too coarse for.
            exact = describe(surface.energy, slot, no_weights, labels)[3]
            log_q = -np.float32(surface.energy[slot, alias]) / STEPS_PER_NAT - exact
        odds, code = -LOG_ODDS_MAX, floor_code
        if log_q > -LOG_ODDS_MAX:
            q = exp_of_steps(np.float32(min(log_q, 0.0) * -STEPS_PER_NAT))
            # The odds of q, to 1e-5: most labels are far from most voxels and need no logarithm.
            rest = q * (1.0 + q * (0.5 + q / 3.0))
            if log_q > -3.0:
                rest = -np.log(max(1.0 - np.exp(log_q), 1e-9))
            # Where blocks lie is far from memory, and few voxels come to here.
            layer = pools.coord[at // 512, 2] * 8 + (at & 7)
            if may_be_ooi(layer, bounds):
                odds = min(max(log_q + rest, odds), LOG_ODDS_MAX)
                code = np.uint8(254.0 * q + 0.5)
        surface.log_odds[slot] = odds
        row, k = at // 512, at % 512
        pools.ooi[pools.slab[row], k] = code
        pools.best_ooi[row] = max(pools.best_ooi[row], code)
        pools.revision[row] = revision
        pools.appearance[row] = revision


@INNER
def _count_mapped(codes):
    n = 0
    for k in range(512):
        n += np.int32(codes[k] != NOT_MAPPED)
    return n


@njit(cache=True, nogil=True)
def _relevel_kernel(pools, surface, labels, levels, level_probability, revision):
    """Derive level and proximity of every labelled voxel again."""
    for slot in range(1, surface.tally[0]):
        at = surface.voxel[slot]
        if at < 0 or surface.label[slot] == NO_LABEL:
            continue
        best, confidence, proximity, log_norm = describe(
            surface.energy, slot, level_probability, labels
        )
        surface.label[slot], surface.confidence[slot] = best, confidence
        surface.proximity[slot], surface.log_norm[slot] = proximity, norm_code(log_norm)
        row, k = at // 512, at % 512
        pools.appearance[row] = revision
        level = levels[surface.label[slot]]
        if pools.level[pools.slab[row], k] != level:
            pools.level[pools.slab[row], k] = level
            pools.revision[row] = revision


def _mode(config: MapConfig, heatmap: Heatmap | None) -> int:
    """Return how a heatmap is fused: distributions stay with the paper's filter."""
    if config.fusion == "places" and (heatmap is None or heatmap.kind == "distribution"):
        return PAPER
    return MODES[config.fusion]


def _give_prior_share(surface: SurfaceRows, labels: int) -> None:
    """Give label number `labels` the share of its prior, 1 / (labels + 1), in every row."""
    used = slice(1, int(surface.tally[N_USED]))
    # x / (Z + x) = 1 / (N + 1) for x = Z / N.
    log_norm = surface.log_norm[used] / NORM_STEPS
    energy = np.log(max(labels, 1)) - log_norm
    steps = np.clip(np.round(energy * STEPS_PER_NAT), 0.0, ENERGY_MAX)
    surface.energy[used, labels] = steps
    log_sum = np.logaddexp(log_norm, -steps / STEPS_PER_NAT)
    surface.log_norm[used] = np.floor(log_sum * NORM_STEPS + 0.5)

"""The map: geometry, object probabilities and distances of everything that was observed."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ippon.errors import FrameRejectedError
from ippon.frame import Frame, Heatmap
from ippon.geometry import invert_transform
from ippon.mapping import queries
from ippon.mapping.arrays import BLOCK_EDGE, BLOCK_VOLUME, MapArrays
from ippon.mapping.blocks import (
    BYTES_PER_VOXEL,
    N_LAYER_FREE,
    N_ROWS,
    BlockDirectory,
    make_pools,
)
from ippon.mapping.depth_image import prepare_depth
from ippon.mapping.distance_field import DistanceField
from ippon.mapping.eviction import drop_blocks_kernel, drop_unobserved_kernel, oldest_blocks
from ippon.mapping.geometry_update import (
    OBSERVED,
    OCCUPIED_CHANGED,
    Rules,
    View,
    hit_kernel,
    make_hits,
    n_samples,
    sample_strides,
    update_kernel,
)
from ippon.mapping.object_filter import (
    BAYES,
    MAXIMUM,
    NONE,
    FusionInput,
    energy_table,
    fuse_kernel,
)
from ippon.mapping.object_layers import (
    new_label_kernel,
    relevel_kernel,
    reset_ooi_kernel,
    suppress_kernel,
)
from ippon.mapping.surface_rows import N_USED, make_surface_rows
from ippon.mapping.view_blocks import OVER_BOUND, frustum_box, select_kernel

SURFACE_ROWS_PER_BLOCK = 64
AVERAGE_LEVEL = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class MapConfig:
    """How observations become a map."""

    voxel_size_m: float = 0.1
    """Edge of a voxel; larger is faster and coarser."""
    truncation_voxels: float = 4.0
    """Band before a surface in which the signed distance is graded, in voxels."""
    behind_voxels: float = 2.0
    """Band behind a surface in which it is; wider lets thin walls' two sides disturb each other."""
    min_range_m: float = 0.1
    """Nearer depth is not used."""
    max_range_m: float = 5.0
    """Farther depth is used to see free space up to here, but makes no surface."""
    max_valid_depth_m: float = 20.0
    """Readings above are a sensor's code for nothing, such as 65.535 m."""
    common_max_range_m: float = 5.0
    """Surface farther away learns nothing about common objects."""
    ooi_max_range_m: float = 4.0
    """Surface farther away learns nothing about the object of interest, which takes a closer
    look."""
    distance_max_m: float = 1.0
    """Distances to obstacles are cut off here; larger costs time with its square."""
    fusion: Literal["bayes", "max"] = "bayes"
    """"bayes": the paper's filter. "max": keep the highest probability seen (ablation)."""
    likelihood_floor: float = 1.0 / 255.0
    """No single image makes a label less likely than this; smaller trusts images more."""
    weight_max: int = 32
    """Observations that the signed distance remembers; larger is smoother and slower to change."""
    hit_evidence: int = 2
    """Evidence for occupied that an image's hits add to a voxel."""
    miss_evidence: int = 1
    """Evidence for free that an image adds to a voxel it sees through."""
    max_evidence: int = 10
    """A removed object vanishes after `max_evidence / miss_evidence + 1` views of free space."""
    min_evidence: int = -4
    """A placed object appears after `-min_evidence / hit_evidence + 1` views."""
    hit_share: float = 0.08
    """Share of a voxel's face that must be covered by surface for the voxel to be occupied."""
    body_height_m: float = 0.5
    """Height above the base at which floor area counts as explored when it is free."""
    max_camera_speed_m_s: float = 10.0
    """A frame whose camera would have moved faster, beyond a metre, is refused as a pose jump."""
    memory_limit_mb: float = 1024.0
    """Bound on the map's memory; beyond it the oldest far blocks are dropped."""
    directory_max_cells: int = 16_000_000
    """Bound on the box of blocks that holds the map; frames that would need more are refused."""

    def __post_init__(self) -> None:
        """Reject values that no map can be made with."""
        positive = (
            "voxel_size_m", "truncation_voxels", "behind_voxels", "max_range_m", "distance_max_m",
            "common_max_range_m", "ooi_max_range_m", "max_valid_depth_m", "max_camera_speed_m_s",
        )  # fmt: skip
        for name in positive:
            if not getattr(self, name) > 0.0:
                raise ValueError(f"{name} must be positive; got {getattr(self, name)}")
        if not 0.0 < self.min_range_m < self.max_range_m:
            raise ValueError(
                f"min_range_m must lie between 0 and max_range_m; got {self.min_range_m}"
            )
        if not 0.0 < self.likelihood_floor <= 0.1:
            raise ValueError(f"likelihood_floor must be in (0, 0.1]; got {self.likelihood_floor}")
        if not (1 <= self.weight_max <= 255 and 0.0 < self.hit_share < 1.0):
            raise ValueError("weight_max must be in 1 to 255 and hit_share in (0, 1)")
        if not (
            1 <= self.hit_evidence <= self.max_evidence <= 100
            and 1 <= self.miss_evidence <= -self.min_evidence <= 100
        ):
            raise ValueError(
                "evidence must satisfy 1 <= hit <= max <= 100 and 1 <= miss <= -min <= 100; got "
                f"{self.hit_evidence}, {self.max_evidence}, {self.miss_evidence}, "
                f"{self.min_evidence}"
            )
        need = int(1.5 * (self.max_range_m / (BLOCK_EDGE * self.voxel_size_m) + 2.0) ** 3)
        if self.max_blocks < need:
            raise ValueError(
                f"memory_limit_mb {self.memory_limit_mb} holds {self.max_blocks} blocks, and one "
                f"view alone may need {need}; raise it, or use larger voxels or a shorter range"
            )

    @property
    def max_blocks(self) -> int:
        """Blocks that fit in the memory limit."""
        per_block = BLOCK_VOLUME * BYTES_PER_VOXEL + SURFACE_ROWS_PER_BLOCK * 120
        return int(self.memory_limit_mb * 1e6 / per_block)


@dataclass(frozen=True, slots=True, kw_only=True)
class IntegrationReport:
    """What one frame did to the map."""

    revision: int
    blocks_seen: int
    blocks_new: int
    blocks_changed: int
    """Blocks in which a voxel changed between unknown, free and occupied."""
    surface_hits: int
    """Surface voxels that the image's points fell in."""
    labelled: int
    """Surface voxels that a heatmap updated."""
    distances: int
    """Voxels whose distance was computed again."""
    blocks_dropped: int
    """Blocks given up to stay within `MapConfig.memory_limit_mb`."""


class VoxelMap:
    """Everything observed so far, as voxels in blocks of 8 x 8 x 8.

    Occupied or free is decided by evidence (see `geometry_update`), the signed distance gives the
    surface inside a voxel, the object probabilities follow the filter of `object_filter`, and the
    distance field is exact up to `MapConfig.distance_max_m`.

    Where the object of interest is one of the common labels, a voxel labelled so before the search
    starts with that probability. A heatmap that was asked for another object of interest teaches
    common objects only. `level` of a voxel is that of its most probable common label, also where
    p(v in O) is high. p(v in C_j), as used for labels and for l(v), is conditional on the voxel not
    being the object of interest.
    """

    def __init__(self, config: MapConfig, labels: Sequence[str]) -> None:
        if not 1 <= len(labels) <= 255 or len(set(labels)) != len(labels):
            raise ValueError(f"a map takes 1 to 255 different labels; got {list(labels)}")
        self.config = config
        self.labels = tuple(labels)
        self.revision = 0
        self.ooi: str | None = None
        self.pools = make_pools(config.max_blocks)
        self.surface = make_surface_rows(config.max_blocks * SURFACE_ROWS_PER_BLOCK, len(labels))
        self._directory = BlockDirectory(config.directory_max_cells)
        self._field = DistanceField(config.voxel_size_m, config.distance_max_m)
        self._energy_of = energy_table(config.likelihood_floor)
        self._levels = np.full(len(labels), AVERAGE_LEVEL, np.uint8)
        self._level_probabilities = np.array([0.02, 0.1, 0.25, 0.6], np.float32)
        self._suppressed = np.empty((0, 4), np.float64)
        self._layer: int | None = None
        self._last_pose: tuple[int, NDArray[np.float64]] | None = None
        self._hits = make_hits(0)
        self._list_of_row = np.zeros(config.max_blocks, np.int32)
        self._dropped_coords: list[NDArray[np.int64]] = []

    def integrate(self, frame: Frame) -> IntegrationReport:
        """Take one frame into the map.

        Raises:
            FrameRejectedError: The frame cannot be true; the map is as it was before.
        """
        cfg = self.config
        self._check(frame)
        image = prepare_depth(frame.depth, frame.camera, cfg.max_valid_depth_m)
        view = View(
            invert_transform(frame.T_world_camera),
            np.ascontiguousarray(frame.T_world_camera),
            frame.camera.fx,
            frame.camera.fy,
            frame.camera.cx,
            frame.camera.cy,
            cfg.min_range_m,
            cfg.max_range_m,
        )
        deepest = min(float(image.tiles[..., 1].max()), cfg.max_range_m)
        margin = cfg.voxel_size_m * (cfg.behind_voxels + 2.0)
        low, high = frustum_box(
            _corner_rays(frame), frame.T_world_camera, deepest + margin, self._block_m
        )
        if not self._directory.fits(low, high):
            raise FrameRejectedError(
                f"camera at {_text(frame.T_world_camera[:3, 3])} m is too far from the map to hold "
                f"both in {cfg.directory_max_cells} blocks; raise MapConfig.directory_max_cells"
            )
        if self._layer is None:
            height = float(frame.T_world_base[2, 3]) + cfg.body_height_m
            self._layer = math.floor(height / cfg.voxel_size_m)
        self._last_pose = (frame.stamp_ns, frame.T_world_camera[:3, 3].copy())
        self._directory.cover(low, high)
        return self._update(frame, image, view, low, high)

    def set_ooi(self, ooi: str | None) -> None:
        """Search for another object: its probabilities start anew, everything else stays.

        Args:
            ooi: Canonical label; None for no object of interest. A common label's probabilities
                are taken over.
        """
        self.ooi = ooi
        self._suppressed = np.empty((0, 4), np.float64)
        self.revision += 1
        alias = self.labels.index(ooi) if ooi in self.labels else NONE
        rows = int(self.pools.tally[N_ROWS])
        reset_ooi_kernel(self.pools, self.surface, rows, len(self.labels), alias, self.revision)

    def set_levels(self, levels: NDArray[np.uint8], probabilities: NDArray[np.float32]) -> None:
        """Say how likely the object of interest is near each common object.

        Args:
            levels: (N,) level of each label, an index of `probabilities`.
            probabilities: (4,) l(O | C) of each level.
        """
        if levels.shape != (len(self.labels),) or probabilities.shape != (4,):
            raise ValueError(
                f"levels are one for each of {len(self.labels)} labels and probabilities four; got "
                f"{levels.shape} and {probabilities.shape}"
            )
        if levels.size and int(levels.max()) > 3:
            raise ValueError(f"levels are 0 to 3; got {int(levels.max())}")
        self._levels = levels.astype(np.uint8)
        self._level_probabilities = probabilities.astype(np.float32)
        self._relevel()

    def add_label(self, label: str) -> None:
        """Tell one more common object apart; known surface gives it the share of its prior."""
        if label in self.labels:
            raise ValueError(f"{label!r} is already a label of this map")
        n = len(self.labels)
        if n == 255:
            raise ValueError("a map takes at most 255 labels")
        if n == self.surface.energy.shape[1]:
            wider = make_surface_rows(len(self.surface.voxel), n + 8).energy
            used = int(self.surface.tally[N_USED])
            wider[:used, :n] = self.surface.energy[:used]
            self.surface = self.surface._replace(energy=wider)
        new_label_kernel(self.surface, n)
        self.labels = (*self.labels, label)
        self._levels = np.append(self._levels, np.uint8(AVERAGE_LEVEL))
        self._relevel()

    def suppress_ooi(self, centre_world: NDArray[np.float64], radius_m: float) -> None:
        """Rule a ball out for the current object of interest, whatever later images say."""
        ball = np.array([*centre_world, radius_m], np.float64)
        self._suppressed = np.concatenate([self._suppressed, ball[None]])
        self.revision += 1
        suppress_kernel(
            self.pools,
            self.surface,
            self._directory.rows,
            self._directory.origin,
            ball,
            self.config.voxel_size_m,
            self.revision,
        )

    def arrays(self) -> MapArrays:
        """Return views of the map for kernels; they show later changes, too."""
        n = int(self.pools.tally[N_ROWS])
        return MapArrays(
            voxel_size=self.config.voxel_size_m,
            origin_block=self._directory.origin,
            directory=self._directory.rows,
            state=self.pools.state[:n],
            ooi=self.pools.ooi[:n],
            level=self.pools.level[:n],
            distance=self.pools.distance[:n],
            revision=self.pools.revision[:n],
        )

    def state_at(self, points_world: NDArray[np.float64]) -> NDArray[np.uint8]:
        """Return (N,) uint8 `UNKNOWN`, `FREE` or `OCCUPIED` for (N, 3) points in metres."""
        return queries.state_at(self.arrays(), points_world)

    def distance_at(
        self, points_world: NDArray[np.float64], *, unknown: queries.UnknownPolicy
    ) -> NDArray[np.float32]:
        """Return (N,) metres to the nearest obstacle; see `queries.distance_at`."""
        return queries.distance_at(self.arrays(), points_world, self.config.distance_max_m, unknown)

    def gradient_at(self, points_world: NDArray[np.float64]) -> NDArray[np.float32]:
        """Return (N, 3) the direction in which the distance grows, unit per metre."""
        return queries.gradient_at(self.arrays(), points_world, self.config.distance_max_m)

    def spheres_are_free(
        self,
        centers_world: NDArray[np.float64],
        radii_m: NDArray[np.float64],
        *,
        unknown: queries.UnknownPolicy,
    ) -> NDArray[np.bool_]:
        """Return (N,) bool; see `queries.spheres_are_free`."""
        return queries.spheres_are_free(
            self.arrays(), centers_world, radii_m, self.config.distance_max_m, unknown
        )

    def bounds(self) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
        """Return the corners, (3,) metres each, of the box of observed blocks; None when empty."""
        n = int(self.pools.tally[N_ROWS])
        coord = self.pools.coord[:n][self.pools.used[:n] == 1]
        if len(coord) == 0:
            return None
        return coord.min(axis=0) * self._block_m, (coord.max(axis=0) + 1) * self._block_m

    def best_ooi(self) -> float:
        """Return the highest p(v in O) of an occupied voxel, 0 when none was observed."""
        n = int(self.pools.tally[N_ROWS])
        return float(self.pools.best_ooi[:n].max()) / 254.0 if n else 0.0

    def explored_m2(self) -> float:
        """Return the floor area that was seen free at `MapConfig.body_height_m`."""
        return float(self.pools.tally[N_LAYER_FREE]) * self.config.voxel_size_m**2

    @property
    def _block_m(self) -> float:
        return BLOCK_EDGE * self.config.voxel_size_m

    def _check(self, frame: Frame) -> None:
        if not np.isfinite(frame.depth).any():
            raise FrameRejectedError("depth has no finite value: NaN or infinite everywhere")
        if self._last_pose is None:
            return
        stamp, position = self._last_pose
        jump = float(np.linalg.norm(frame.T_world_camera[:3, 3] - position))
        elapsed_s = (frame.stamp_ns - stamp) * 1e-9
        # A clock that went back is another run's: its first pose may be anywhere.
        if elapsed_s >= 0.0 and jump > 1.0 + self.config.max_camera_speed_m_s * elapsed_s:
            raise FrameRejectedError(
                f"the camera jumped {jump:.2f} m in {elapsed_s:.3f} s; at most "
                f"{self.config.max_camera_speed_m_s} m/s is believed"
            )

    def _rules(self) -> Rules:
        cfg, v = self.config, self.config.voxel_size_m
        assert self._layer is not None
        return Rules(
            voxel_size=v,
            truncation=cfg.truncation_voxels * v,
            behind=cfg.behind_voxels * v,
            clear=0.4 * v,
            depth_of_hits=0.2 * v,
            weight_max=cfg.weight_max,
            hit=cfg.hit_evidence,
            miss=cfg.miss_evidence,
            evidence_max=cfg.max_evidence,
            evidence_min=cfg.min_evidence,
            hit_share=cfg.hit_share,
            layer=self._layer,
        )

    def _update(self, frame: Frame, image, view: View, low, high) -> IntegrationReport:  # pyright: ignore
        revision = self.revision + 1
        rows, kinds, is_new, dropped = self._select(frame, image, low, high, revision)
        n = len(rows)
        if len(self._hits.any) < n:
            self._hits = make_hits(n + n // 2)
        self._hits.any[:n] = 0
        self._list_of_row[rows] = np.arange(n, dtype=np.int32)
        rules = self._rules()
        strides = sample_strides(frame.camera, self.config.voxel_size_m, self.config.max_range_m)
        directory, origin = self._directory.rows, self._directory.origin
        hit_kernel(
            image, strides, view, rules, origin, directory, rows, self._list_of_row, n, self._hits
        )
        flags = np.zeros(n, np.uint8)
        entries = np.empty((n_samples(frame.camera, strides), 3), np.int32)
        n_entries = update_kernel(
            image, strides, view, rules, rows, kinds, n, self._hits, self.pools, self.surface,
            revision, flags, entries,
        )  # fmt: skip
        fusion = self._fusion_input(frame.heatmap)
        labelled = fuse_kernel(
            entries, n_entries, strides, image.depth, np.ascontiguousarray(frame.color), fusion,
            len(self.labels), self.config.voxel_size_m, self.pools, self.surface, revision,
        )  # fmt: skip
        drop_unobserved_kernel(
            rows, is_new, (flags & OBSERVED) == 0, n, self.pools, directory, origin
        )
        coords = self.pools.coord[rows]
        changed = coords[(flags & OCCUPIED_CHANGED) > 0]
        if dropped:
            changed = np.concatenate([changed, *dropped])
        fresh = coords[(is_new == 1) & ((flags & OBSERVED) > 0)]
        distances = self._field.update(self.pools, directory, origin, changed, fresh)
        self.revision = revision
        return IntegrationReport(
            revision=revision,
            blocks_seen=n,
            blocks_new=len(fresh),
            blocks_changed=int(np.count_nonzero(self.pools.revision[rows] == revision)),
            surface_hits=int(n_entries),
            labelled=max(0, int(labelled)),
            distances=distances,
            blocks_dropped=sum(len(d) for d in dropped),
        )

    def _select(self, frame: Frame, image, low, high, revision: int):  # pyright: ignore
        """Return rows, kinds, newness of the blocks in view, and blocks dropped for them."""
        cfg = self.config
        most = int(np.prod(high - low))
        rows, kinds = np.empty(most, np.int32), np.empty(most, np.int8)
        is_new = np.empty(most, np.uint8)
        camera = frame.camera
        behind = cfg.behind_voxels * cfg.voxel_size_m
        dropped: list[NDArray[np.int64]] = []
        while True:
            n = select_kernel(
                low,
                high,
                invert_transform(frame.T_world_camera),
                cfg.voxel_size_m,
                (
                    cfg.min_range_m,
                    cfg.max_range_m,
                    cfg.truncation_voxels * cfg.voxel_size_m,
                    behind,
                ),
                (camera.fx, camera.fy, camera.cx, camera.cy),
                (camera.width, camera.height),
                image.tiles,
                self._directory.origin,
                self._directory.rows,
                self.pools,
                np.float32(cfg.distance_max_m),
                revision,
                rows,
                kinds,
                is_new,
            )
            if n != OVER_BOUND:
                return rows[:n], kinds[:n], is_new[:n], dropped
            dropped.append(self._drop_blocks(frame.T_world_camera[:3, 3], revision))

    def _drop_blocks(self, position: NDArray[np.float64], revision: int) -> NDArray[np.int64]:
        """Give up an eighth of the blocks: the longest unseen, those near the camera last."""
        rows = oldest_blocks(
            self.pools, position / self._block_m, self.config.max_range_m / self._block_m, revision
        )
        coords = self.pools.coord[rows].copy()
        drop_blocks_kernel(
            rows, self.pools, self.surface, self._directory.rows, self._directory.origin
        )
        return coords

    def _fusion_input(self, heatmap: Heatmap | None) -> FusionInput:
        cfg = self.config
        channel = np.full(len(self.labels), NONE, np.int64)
        ooi_channel = NONE
        probabilities = np.zeros((1, 1, 1), np.uint8)
        if heatmap is not None:
            probabilities = np.ascontiguousarray(heatmap.probabilities)
            index = {label: i for i, label in enumerate(heatmap.labels)}
            channel = np.array([index.get(label, NONE) for label in self.labels], np.int64)
            if self.ooi is not None and heatmap.ooi == self.ooi:
                at = heatmap.ooi_channel
                ooi_channel = NONE if at is None else at
        alias = self.labels.index(self.ooi) if self.ooi in self.labels else NONE
        return FusionInput(
            probabilities=probabilities,
            has_heatmap=heatmap is not None,
            channel=channel,
            in_order=bool((channel == np.arange(len(channel))).all()),
            ooi_channel=ooi_channel,
            ooi_alias=alias,
            energy_of=self._energy_of,
            common_max_m=cfg.common_max_range_m,
            ooi_max_m=cfg.ooi_max_range_m,
            mode=BAYES if cfg.fusion == "bayes" else MAXIMUM,
            levels=self._levels,
            level_probability=self._level_probabilities[self._levels],
            suppressed=self._suppressed,
        )

    def _relevel(self) -> None:
        self.revision += 1
        relevel_kernel(
            self.pools,
            self.surface,
            len(self.labels),
            self._levels,
            self._level_probabilities[self._levels],
            self.revision,
        )


def _corner_rays(frame: Frame) -> NDArray[np.float64]:
    c = frame.camera
    u = np.array([-0.5, c.width - 0.5, -0.5, c.width - 0.5])
    v = np.array([-0.5, -0.5, c.height - 0.5, c.height - 0.5])
    return np.stack([(u - c.cx) / c.fx, (v - c.cy) / c.fy, np.ones(4)], axis=1)


def _text(point: NDArray[np.float64]) -> str:
    return "(" + ", ".join(f"{x:.2f}" for x in point) + ")"

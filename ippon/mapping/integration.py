"""One frame into the map: its blocks, their geometry, the object probabilities, the distances."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ippon.errors import FrameRejectedError
from ippon.frame import Frame
from ippon.geometry import invert_transform
from ippon.mapping.arrays import BLOCK_EDGE, OCCUPIED, read_only
from ippon.mapping.blocks import BlockDirectory, Pools
from ippon.mapping.config import MapConfig
from ippon.mapping.depth_image import DepthImage, prepare_depth
from ippon.mapping.eviction import drop_blocks, oldest_blocks
from ippon.mapping.objects.object_layers import ObjectLayers
from ippon.mapping.objects.surface_fusion import fuse_kernel, make_fusion_work
from ippon.mapping.occupancy.distance_field import DistanceField
from ippon.mapping.occupancy.free_space import OBSERVED, OCCUPIED_CHANGED
from ippon.mapping.occupancy.geometry_update import update_kernel
from ippon.mapping.occupancy.hits import (
    PIXEL_BITS,
    Rules,
    View,
    hit_kernel,
    make_hits,
    n_samples,
    sample_strides,
)
from ippon.mapping.occupancy.visible_blocks import OVER_BOUND, frustum_box, select_kernel

CLEAR_VOXELS = 0.4
"""A voxel's centre at least this far before the surface, in voxels, is seen free."""
HIT_DEPTH_VOXELS = 0.2
"""Hits are taken this far under the surface: a floor on the boundary of two voxels is in one."""


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


@dataclass(frozen=True, slots=True)
class _Selection:
    """The blocks that a frame sees."""

    rows: NDArray[np.int32]
    kinds: NDArray[np.int8]
    is_new: NDArray[np.uint8]
    box: tuple[int, ...]
    """Lower corner and shape of the box of blocks round the view."""
    place: NDArray[np.int32]
    """Places of the box's blocks in `rows`, see `select_kernel`."""
    dropped: list[NDArray[np.int64]]
    """Blocks that were given up to make room."""


class FrameIntegrator:
    """Takes frames into pools; owns what is kept from one frame to the next."""

    def __init__(self, config: MapConfig, pools: Pools, directory: BlockDirectory) -> None:
        self._config = config
        self._pools = pools
        self._directory = directory
        self._field = DistanceField(config.voxel_size_m, config.distance_max_m)
        self._hits = make_hits(0)
        self._last_pose: tuple[int, NDArray[np.float64]] | None = None
        self.layer: int | None = None
        """Voxel layer at body height, once the first frame told where the floor is."""
        self.floor_z_m = 0.0
        """Height of the floor that the robot stood on last."""

    def integrate(self, frame: Frame, layers: ObjectLayers, revision: int) -> IntegrationReport:
        """Take one frame in; see `VoxelMap.integrate`."""
        cfg = self._config
        self._check(frame)
        image = prepare_depth(frame.depth, frame.camera, cfg.max_valid_depth_m)
        low, high = self._box(frame, image)
        if not self._directory.fits(low, high):
            raise FrameRejectedError(
                f"camera at {_text(frame.T_world_camera[:3, 3])} m is too far from the map to hold "
                f"both in {cfg.directory_max_cells} blocks; raise MapConfig.directory_max_cells"
            )
        self.floor_z_m = float(frame.T_world_base[2, 3])
        if self.layer is None:
            self.layer = math.floor((self.floor_z_m + cfg.body_height_m) / cfg.voxel_size_m)
        self._last_pose = (frame.stamp_ns, frame.T_world_camera[:3, 3].copy())
        self._directory.cover(low, high)
        seen = self._select(frame, image, layers, (low, high), revision)
        return self._update(frame, image, seen, layers, revision)

    def learn(self, frame: Frame, layers: ObjectLayers, revision: int) -> int:
        """Take the heatmap alone of a frame that is in the map; see `VoxelMap.learn`."""
        if self.layer is None:
            return 0
        cfg, pools = self._config, self._pools
        image = prepare_depth(frame.depth, frame.camera, cfg.max_valid_depth_m)
        low, cells = self._directory.part(*self._box(frame, image))
        rows, place = cells[cells >= 0], np.zeros(1 + cells.size, np.int32)
        place[1:][cells.ravel() >= 0] = -1 - np.arange(len(rows))
        strides = sample_strides(frame.camera, cfg.voxel_size_m, cfg.max_range_m)
        self._count_hits(frame, image, strides, len(rows), _whole(low, cells.shape), place)
        entries = self._hit_surface(rows)
        slot = pools.slot[pools.slab[entries[:, 0]], entries[:, 1]]
        # Their colours have this image in them already.
        known = slot[slot > 0]
        colors = layers.surface.color[known], layers.surface.color_count[known]
        labelled = self.fuse(frame, image.depth, strides, entries, len(entries), layers, revision)
        layers.surface.color[known], layers.surface.color_count[known] = colors
        return labelled

    def fuse(
        self,
        frame: Frame,
        depth: NDArray[np.float32],
        strides: tuple[int, int],
        entries: NDArray[np.int32],
        n: int,
        layers: ObjectLayers,
        revision: int,
    ) -> int:
        """Take colour and heatmap into surface voxels that an image hit.

        Args:
            frame: The image and where it was taken.
            depth: (H + 2, W + 2) its padded depth, metres.
            strides: Pixels between samples along u and v.
            entries: (m, 3) block row, voxel and sample of each such voxel.
            n: Rows of `entries`.
            layers: What is known of the surface.
            revision: Of the map with this image in it.

        Returns:
            How many of them a heatmap updated.
        """
        x, y, z = (float(c) for c in frame.T_world_camera[:3, 3])
        heat = layers.fusion_input(frame.heatmap, self.floor_z_m, (x, y, z))
        surface = layers.surface
        color = read_only(frame.color)
        heat_size, length = heat.probabilities.shape[:2], surface.energy.shape[1]
        work = make_fusion_work(color.shape[:2], strides, heat_size, length)
        labelled = fuse_kernel(
            entries, n, work, depth, color, heat, len(layers.labels),
            self._config.voxel_size_m, self._pools, surface, layers.witnesses, revision,
        )  # fmt: skip
        return int(labelled)

    def _hit_surface(self, rows: NDArray[np.int32]) -> NDArray[np.int32]:
        """Return (m, 3) block row, voxel and sample of the surface that was hit in `rows`."""
        at = np.flatnonzero(self._hits.any[1 : 1 + len(rows)])
        is_hit = (self._hits.number[1 + at] > 0) & (self._pools.state[rows[at]] == OCCUPIED)
        block, k = np.nonzero(is_hit)
        sample = self._hits.best[1 + at[block], k] & np.int32((1 << PIXEL_BITS) - 1)
        columns = (rows[at[block]], k, sample)
        return np.stack([c.astype(np.int32) for c in columns], axis=1)

    def _box(self, frame: Frame, image: DepthImage) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return the box [low, high) of blocks that the image may see."""
        cfg = self._config
        deepest = min(float(image.tiles[0, ..., 1].max()), cfg.max_range_m)
        margin = cfg.voxel_size_m * (cfg.behind_voxels + 2.0)
        far_m = deepest + margin
        return frustum_box(_corner_rays(frame), frame.T_world_camera, far_m, self._block_m)

    def _view(self, frame: Frame) -> View:
        return View(
            invert_transform(frame.T_world_camera),
            np.ascontiguousarray(frame.T_world_camera),
            frame.camera.fx,
            frame.camera.fy,
            frame.camera.cx,
            frame.camera.cy,
            self._config.min_range_m,
            self._config.max_range_m,
        )

    def _count_hits(
        self,
        frame: Frame,
        image: DepthImage,
        strides: tuple[int, int],
        n: int,
        box: tuple[int, ...],
        place: NDArray[np.int32],
    ) -> None:
        """Fill `_hits` with the image's points in the `n` blocks that `place` names."""
        if len(self._hits.any) <= n:
            self._hits = make_hits(n + n // 2)
        self._hits.any[: n + 1] = 0
        hit_kernel(image, strides, self._view(frame), self._rules(), box, place, self._hits)

    @property
    def _block_m(self) -> float:
        return BLOCK_EDGE * self._config.voxel_size_m

    def _check(self, frame: Frame) -> None:
        if not np.isfinite(frame.depth).any():
            raise FrameRejectedError("depth has no finite value: NaN or infinite everywhere")
        if self._last_pose is None:
            return
        jump = float(np.linalg.norm(frame.T_world_camera[:3, 3] - self._last_pose[1]))
        elapsed_s = (frame.stamp_ns - self._last_pose[0]) * 1e-9
        # A clock that went back is another run's: its first pose may be anywhere.
        if elapsed_s >= 0.0 and jump > 1.0 + self._config.max_camera_speed_m_s * elapsed_s:
            raise FrameRejectedError(
                f"the camera jumped {jump:.2f} m in {elapsed_s:.3f} s; at most "
                f"{self._config.max_camera_speed_m_s} m/s is believed"
            )

    def _rules(self) -> Rules:
        cfg, v = self._config, self._config.voxel_size_m
        assert self.layer is not None
        return Rules(
            voxel_size=v,
            truncation=cfg.truncation_voxels * v,
            behind=cfg.behind_voxels * v,
            clear=CLEAR_VOXELS * v,
            depth_of_hits=HIT_DEPTH_VOXELS * v,
            weight_max=cfg.weight_max,
            hit=cfg.hit_evidence,
            miss=cfg.miss_evidence,
            evidence_max=cfg.max_evidence,
            evidence_min=cfg.min_evidence,
            hit_share=cfg.hit_share,
            layer=self.layer,
        )

    def _select(
        self,
        frame: Frame,
        image: DepthImage,
        layers: ObjectLayers,
        box: tuple[NDArray[np.int64], NDArray[np.int64]],
        revision: int,
    ) -> _Selection:
        cfg, camera = self._config, frame.camera
        low, high = box
        most = int(np.prod(high - low))
        rows, kinds = np.empty(most, np.int32), np.empty(most, np.int8)
        is_new, place = np.empty(most, np.uint8), np.empty(most + 1, np.int32)
        v = cfg.voxel_size_m
        depths = (
            cfg.min_range_m,
            cfg.max_range_m,
            cfg.truncation_voxels * v,
            cfg.behind_voxels * v,
        )
        dropped: list[NDArray[np.int64]] = []
        while True:
            n = select_kernel(
                low,
                high,
                invert_transform(frame.T_world_camera),
                v,
                depths,
                (camera.fx, camera.fy, camera.cx, camera.cy),
                (camera.width, camera.height),
                image.tiles,
                self._directory.origin,
                self._directory.rows,
                self._pools,
                np.uint16(self._field.farthest),
                revision,
                rows,
                kinds,
                is_new,
                place,
            )
            if n != OVER_BOUND and layers.has_room_for(n):
                return _Selection(
                    rows[:n], kinds[:n], is_new[:n], _whole(low, high - low), place, dropped
                )
            gone = self._drop_blocks(layers, frame.T_world_camera[:3, 3], revision)
            dropped.append(gone)
            if len(gone) == 0:
                self._release_blocks_of(layers, revision)
                raise FrameRejectedError(
                    f"one view needs more than the {cfg.max_blocks} blocks of "
                    f"memory_limit_mb {cfg.memory_limit_mb}; raise it"
                )

    def _release_blocks_of(self, layers: ObjectLayers, revision: int) -> None:
        """Take back the blocks that a frame made before it was refused."""
        is_new = (self._pools.appearance == revision) & (self._pools.used == 1)
        self._forget(layers, np.flatnonzero(is_new))

    def _forget(self, layers: ObjectLayers, rows: NDArray[np.integer]) -> None:
        drop_blocks(rows, self._pools, layers.surface, self._directory.rows, self._directory.origin)

    def _drop_blocks(
        self, layers: ObjectLayers, position: NDArray[np.float64], revision: int
    ) -> NDArray[np.int64]:
        """Give up an eighth of the blocks: the longest unseen, those near the camera last."""
        reach = self._config.max_range_m / self._block_m
        rows = oldest_blocks(self._pools, position / self._block_m, reach, revision)
        coords = self._pools.coord[rows].copy()
        self._forget(layers, rows)
        return coords

    def _update(
        self,
        frame: Frame,
        image: DepthImage,
        seen: _Selection,
        layers: ObjectLayers,
        revision: int,
    ) -> IntegrationReport:
        cfg, pools, rows, n = self._config, self._pools, seen.rows, len(seen.rows)
        strides = sample_strides(frame.camera, cfg.voxel_size_m, cfg.max_range_m)
        self._count_hits(frame, image, strides, n, seen.box, seen.place)
        flags = np.zeros(n, np.uint8)
        entries = np.empty((n_samples(frame.camera, strides), 3), np.int32)
        n_entries = update_kernel(
            image, strides, self._view(frame), self._rules(), rows, seen.kinds, n, self._hits,
            pools, layers.surface, revision, flags, entries,
        )  # fmt: skip
        labelled = self.fuse(frame, image.depth, strides, entries, int(n_entries), layers, revision)
        observed = (flags & OBSERVED) > 0
        self._forget(layers, rows[(seen.is_new == 1) & ~observed])
        coords = pools.coord[rows]
        changed = np.concatenate([coords[(flags & OCCUPIED_CHANGED) > 0], *seen.dropped])
        fresh = coords[(seen.is_new == 1) & observed]
        return IntegrationReport(
            revision=revision,
            blocks_seen=n,
            blocks_new=len(fresh),
            blocks_changed=int(np.count_nonzero(pools.revision[rows[observed]] == revision)),
            surface_hits=int(n_entries),
            labelled=labelled,
            distances=self._field.update(
                pools, self._directory.rows, self._directory.origin, changed, fresh
            ),
            blocks_dropped=sum(len(d) for d in seen.dropped),
        )


def _corner_rays(frame: Frame) -> NDArray[np.float64]:
    c = frame.camera
    u = np.array([-0.5, c.width - 0.5, -0.5, c.width - 0.5])
    v = np.array([-0.5, -0.5, c.height - 0.5, c.height - 0.5])
    return np.stack([(u - c.cx) / c.fx, (v - c.cy) / c.fy, np.ones(4)], axis=1)


def _whole(low: NDArray[np.int64], shape: Iterable[int]) -> tuple[int, ...]:
    return *(int(n) for n in low), *(int(n) for n in shape)


def _text(point: NDArray[np.float64]) -> str:
    return "(" + ", ".join(f"{x:.2f}" for x in point) + ")"

"""Fusion of one frame: geometry of its blocks, object probabilities, distance field."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ippon.errors import FrameRejectedError
from ippon.frame import Frame
from ippon.geometry import invert_transform
from ippon.mapping.arrays import OCCUPIED, read_only
from ippon.mapping.blocks import BlockDirectory, Pools, count_layer
from ippon.mapping.config import MapConfig
from ippon.mapping.depth_image import DepthImage, prepare_depth
from ippon.mapping.frame_blocks import BlockSelector, VisibleBlocks, box_bounds
from ippon.mapping.objects.object_layers import ImageEntries, ObjectLayers
from ippon.mapping.objects.surface_fusion import fuse_kernel, make_fusion_work
from ippon.mapping.occupancy.distance_field import DistanceField
from ippon.mapping.occupancy.free_space import OBSERVED, OCCUPIED_CHANGED
from ippon.mapping.occupancy.geometry_update import make_update_work, update_kernel
from ippon.mapping.occupancy.ray_endpoints import (
    CameraGeometry,
    UpdateRules,
    count_endpoints_kernel,
    make_endpoint_counts,
    make_endpoint_work,
    n_listed,
    n_samples,
    sample_strides,
)
from ippon.mapping.occupancy.sample_rows import PIXEL_BITS

MOST_FROM_ORIGIN_M: Final = 10_000.0
"""Distance from the world's origin up to which the float32 coordinates of messages and drawings
tell one voxel from the next, and indices fit their 21 bits."""

FLOOR_MOVED_M: Final = 0.2
"""Difference of height, beyond a voxel, from which the explored floor is that of another layer."""


@dataclass(frozen=True, slots=True, kw_only=True)
class IntegrationReport:
    """Statistics of the fusion of one frame."""

    revision: int
    blocks_seen: int
    blocks_new: int
    blocks_changed: int
    """Blocks in which a voxel changed between unknown, free and occupied."""
    surface_hits: int
    """Surface voxels that contain a depth point of the image."""
    labelled: int
    """Surface voxels that the heatmap updated."""
    distances: int
    """Voxels whose distance to obstacles was recomputed."""
    blocks_dropped: int
    """Blocks dropped to stay within `MapConfig.memory_limit_mb`."""


class FrameIntegrator:
    """Fuses frames into the map's pools; holds the state between frames."""

    def __init__(self, config: MapConfig, pools: Pools, directory: BlockDirectory) -> None:
        self._config = config
        self._pools = pools
        self._directory = directory
        self._field = DistanceField(config.voxel_size_m, config.distance_max_m)
        self._blocks = BlockSelector(config, pools, directory, self._field.farthest)
        self._endpoints = make_endpoint_counts(0)
        self._endpoint_work = make_endpoint_work(0)
        self._update_work = make_update_work()
        self._padded = np.zeros((2, 2), np.float32)
        self._last_pose: tuple[int, NDArray[np.float64]] | None = None
        self.layer: int | None = None
        """Voxel layer at body height over the floor; None before the first frame."""
        self.floor_z_m = 0.0
        """Height of the floor that the robot stood on last."""

    def integrate(self, frame: Frame, layers: ObjectLayers, revision: int) -> IntegrationReport:
        """Fuse one frame; see `VoxelMap.integrate`."""
        cfg = self._config
        self._check(frame)
        image = self._prepare_depth(frame)
        low, high = self._blocks.box(frame, image)
        if not self._directory.fits(low, high):
            raise FrameRejectedError(
                f"camera at {_text(frame.T_world_camera[:3, 3])} m is too far from the map to hold "
                f"both in {cfg.directory_max_cells} blocks; raise mission.map.directory_max_cells"
            )
        self._directory.cover(low, high)
        seen = self._blocks.select(frame, image, layers, (low, high), revision)
        self._stand_on(float(frame.T_world_base[2, 3]))
        self._last_pose = (frame.stamp_ns, frame.T_world_camera[:3, 3].copy())
        return self._update(frame, image, seen, layers, revision)

    def integrate_heatmap(self, frame: Frame, layers: ObjectLayers, revision: int) -> int:
        """Fuse the heatmap of an integrated frame; see `VoxelMap.integrate_heatmap`."""
        if self.layer is None:
            return 0
        cfg, pools = self._config, self._pools
        image = self._prepare_depth(frame)
        low, cells = self._directory.part(*self._blocks.box(frame, image))
        rows, place = cells[cells >= 0], np.zeros(1 + cells.size, np.int32)
        place[1:][cells.ravel() >= 0] = -1 - np.arange(len(rows))
        strides = sample_strides(frame.camera, cfg.voxel_size_m, cfg.max_range_m)
        self._count_hits(frame, image, strides, len(rows), box_bounds(low, cells.shape), place)
        entries = self._hit_surface(rows)
        slot = pools.slot[pools.slab[entries[:, 0]], entries[:, 1]]
        # Their colours already include this image.
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
        """Fuse colour and heatmap into the surface voxels of an image.

        Args:
            frame: Image and pose.
            depth: (H + 2, W + 2) its padded depth, metres.
            strides: Pixels between samples along u and v.
            entries: (m, 3) block row, voxel and sample of each surface voxel.
            n: Rows of `entries`.
            layers: Labels and probabilities, updated.
            revision: Map revision after this image.

        Returns:
            Number of voxels that the heatmap updated.
        """
        x, y, z = (float(c) for c in frame.T_world_camera[:3, 3])
        heat = layers.fusion_input(frame.heatmap, self.floor_z_m, frame.camera, (x, y, z))
        surface = layers.surface
        color = read_only(frame.color)
        heat_size, length = heat.probabilities.shape[:2], surface.energy.shape[1]
        work = make_fusion_work(color.shape[:2], strides, heat_size, length)
        image = ImageEntries(entries, n, work, depth, color)
        goals = 0
        if layers.goals is not None:
            goals = layers.goals.fuse(
                image, heat, frame.heatmap, frame.camera, self.floor_z_m, revision
            )
        labelled = fuse_kernel(
            entries, n, work, depth, color, heat, len(layers.labels),
            self._config.voxel_size_m, self._pools, surface, layers.accumulators, revision,
        )  # fmt: skip
        return max(int(labelled), goals)

    def _hit_surface(self, rows: NDArray[np.int32]) -> NDArray[np.int32]:
        """Return (m, 3) block row, voxel and sample of occupied voxels with endpoints in `rows`."""
        at = np.flatnonzero(self._endpoints.any[1 : 1 + len(rows)])
        is_hit = (self._endpoints.number[1 + at] > 0) & (self._pools.state[rows[at]] == OCCUPIED)
        block, k = np.nonzero(is_hit)
        sample = self._endpoints.best[1 + at[block], k] & np.int32((1 << PIXEL_BITS) - 1)
        columns = (rows[at[block]], k, sample)
        return np.stack([c.astype(np.int32) for c in columns], axis=1)

    def _prepare_depth(self, frame: Frame) -> DepthImage:
        """Return the frame's depth, prepared; it lasts until the next call."""
        height, width = frame.depth.shape
        if self._padded.shape != (height + 2, width + 2):
            self._padded = np.zeros((height + 2, width + 2), np.float32)
        most_m = self._config.max_valid_depth_m
        return prepare_depth(frame.depth, frame.camera, most_m, self._padded)

    def _view(self, frame: Frame) -> CameraGeometry:
        return CameraGeometry(
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
        """Count the endpoints in the `n` blocks that `place` maps to, into `_endpoints`."""
        if len(self._endpoints.any) <= n:
            self._endpoints = make_endpoint_counts(n + n // 2)
        most = n_listed(frame.camera.width, strides[0])
        if self._endpoint_work.order.shape[1] != most:
            self._endpoint_work = make_endpoint_work(most)
        self._endpoints.any[: n + 1] = 0
        count_endpoints_kernel(
            image, strides, self._view(frame), self._rules(), box, place, self._endpoint_work,
            self._endpoints,
        )  # fmt: skip

    def _stand_on(self, floor_z_m: float) -> None:
        """Take up the floor at a height; on another one its free voxels are counted anew."""
        size = self._config.voxel_size_m
        self.floor_z_m = floor_z_m
        layer = math.floor((floor_z_m + self._config.body_height_m) / size)
        if self.layer is None:
            self.layer = layer
        elif abs(layer - self.layer) * size > FLOOR_MOVED_M + size:
            self.layer = layer
            count_layer(self._pools, layer)

    def _check(self, frame: Frame) -> None:
        # Row by row: the first ones nearly always tell.
        if not any(np.isfinite(row).any() for row in frame.depth):
            raise FrameRejectedError("depth has no finite value: NaN or infinite everywhere")
        if float(np.abs(frame.T_world_camera[:3, 3]).max()) > MOST_FROM_ORIGIN_M:
            raise FrameRejectedError(
                f"camera at {_text(frame.T_world_camera[:3, 3])} m is more than "
                f"{MOST_FROM_ORIGIN_M / 1000.0:.0f} km from the origin of its world frame: use a "
                "frame with its origin on the site, none of geographic coordinates such as UTM"
            )
        if self._last_pose is None:
            return
        jump = float(np.linalg.norm(frame.T_world_camera[:3, 3] - self._last_pose[1]))
        elapsed_s = (frame.stamp_ns - self._last_pose[0]) * 1e-9
        # If the clock went back, another run has begun, and its first pose may be anywhere.
        if elapsed_s >= 0.0 and jump > 1.0 + self._config.max_camera_speed_m_s * elapsed_s:
            raise FrameRejectedError(
                f"the camera jumped {jump:.2f} m in {elapsed_s:.3f} s; at most "
                f"{self._config.max_camera_speed_m_s} m/s is believed"
            )

    def _rules(self) -> UpdateRules:
        cfg, v = self._config, self._config.voxel_size_m
        assert self.layer is not None
        return UpdateRules(
            voxel_size=v,
            truncation=cfg.truncation_voxels * v,
            behind=cfg.behind_voxels * v,
            clear=cfg.clear_voxels * v,
            endpoint_depth=cfg.endpoint_depth_voxels * v,
            weight_max=cfg.weight_max,
            hit=cfg.hit_evidence,
            miss=cfg.miss_evidence,
            evidence_max=cfg.max_evidence,
            evidence_min=cfg.min_evidence,
            hit_share=cfg.hit_share,
            layer=self.layer,
        )

    def _update(
        self,
        frame: Frame,
        image: DepthImage,
        seen: VisibleBlocks,
        layers: ObjectLayers,
        revision: int,
    ) -> IntegrationReport:
        cfg, pools, rows, n = self._config, self._pools, seen.rows, len(seen.rows)
        strides = sample_strides(frame.camera, cfg.voxel_size_m, cfg.max_range_m)
        self._count_hits(frame, image, strides, n, seen.box, seen.place)
        flags = np.zeros(n, np.uint8)
        entries = np.empty((n_samples(frame.camera, strides), 3), np.int32)
        n_entries = update_kernel(
            image, strides, self._view(frame), self._rules(), rows, seen.kinds, n, self._endpoints,
            self._update_work, pools, layers.surface, revision, flags, entries,
        )  # fmt: skip
        labelled = self.fuse(frame, image.depth, strides, entries, int(n_entries), layers, revision)
        observed = (flags & OBSERVED) > 0
        self._blocks.forget(layers, rows[(seen.is_new == 1) & ~observed])
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


def _text(point: NDArray[np.float64]) -> str:
    return "(" + ", ".join(f"{x:.2f}" for x in point) + ")"

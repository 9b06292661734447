"""The blocks that a frame sees, and room for them within the map's memory limit."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ippon.errors import FrameRejectedError
from ippon.frame import Frame
from ippon.geometry import invert_transform
from ippon.mapping.arrays import BLOCK_EDGE
from ippon.mapping.blocks import BlockDirectory, Pools
from ippon.mapping.config import MapConfig
from ippon.mapping.depth_image import DepthImage
from ippon.mapping.eviction import drop_blocks, oldest_blocks
from ippon.mapping.objects.object_layers import ObjectLayers
from ippon.mapping.occupancy.visible_blocks import OVER_BOUND, frustum_box, select_kernel


@dataclass(frozen=True, slots=True)
class VisibleBlocks:
    """The blocks that a frame sees, N of them."""

    rows: NDArray[np.int32]
    kinds: NDArray[np.int8]
    is_new: NDArray[np.uint8]
    box: tuple[int, ...]
    """Lower corner and shape, three each, of the box of blocks around the view."""
    place: NDArray[np.int32]
    """Index in `rows` of each block of the box; see `select_kernel`."""
    dropped: list[NDArray[np.int64]]
    """Coordinates of the blocks that were dropped to make room, (n, 3) each."""


class BlockSelector:
    """Selects and allocates the blocks of a frame; evicts old blocks when the limit is reached.

    Args:
        config: Range, voxel size and memory limit.
        pools: The map's pools.
        directory: Rows of the blocks.
        farthest: Cut-off of the distance field, squared, in voxels.
    """

    def __init__(
        self, config: MapConfig, pools: Pools, directory: BlockDirectory, farthest: int
    ) -> None:
        self._config = config
        self._pools = pools
        self._directory = directory
        self._farthest = farthest

    def box(self, frame: Frame, image: DepthImage) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return the box [low, high) of blocks that the image may see."""
        cfg = self._config
        deepest = min(float(image.tiles[0, ..., 1].max()), cfg.max_range_m)
        margin = cfg.voxel_size_m * (cfg.behind_voxels + 2.0)
        far_m = deepest + margin
        return frustum_box(_corner_rays(frame), frame.T_world_camera, far_m, self._block_m)

    def select(
        self,
        frame: Frame,
        image: DepthImage,
        layers: ObjectLayers,
        box: tuple[NDArray[np.int64], NDArray[np.int64]],
        revision: int,
    ) -> VisibleBlocks:
        """Return the visible blocks, allocating those that are new.

        Args:
            frame: Camera and pose.
            image: Its prepared depth.
            layers: Surface voxels, for their free rows.
            box: From `box`.
            revision: Map revision of this frame.

        Raises:
            FrameRejectedError: The view alone exceeds the memory limit.
        """
        cfg = self._config
        low, high = box
        most = int(np.prod(high - low))
        rows, kinds = np.empty(most, np.int32), np.empty(most, np.int8)
        is_new, place = np.empty(most, np.uint8), np.empty(most + 1, np.int32)
        list_blocks = self._lister(frame, image, box, revision, (rows, kinds, is_new, place))
        dropped: list[NDArray[np.int64]] = []
        while True:
            n = list_blocks(True)
            if n != OVER_BOUND and layers.has_room_for(n):
                break
            if not dropped and list_blocks(False) > cfg.max_blocks:
                self._release_blocks_of(layers, revision)
                raise FrameRejectedError(
                    f"one view needs more than the {cfg.max_blocks} blocks of "
                    f"memory_limit_mb {cfg.memory_limit_mb}; raise it"
                )
            gone = self._drop_blocks(layers, frame.T_world_camera[:3, 3], revision)
            if len(gone) == 0:
                assert n != OVER_BOUND, "the view alone fits"
                break
            dropped.append(gone)
        return VisibleBlocks(
            rows[:n], kinds[:n], is_new[:n], box_bounds(low, high - low), place, dropped
        )

    def _lister(
        self,
        frame: Frame,
        image: DepthImage,
        box: tuple[NDArray[np.int64], NDArray[np.int64]],
        revision: int,
        lists: tuple[NDArray[np.int32], NDArray[np.int8], NDArray[np.uint8], NDArray[np.int32]],
    ) -> Callable[[bool], int]:
        """Return `select_kernel` for an image; its argument is `makes_rows`."""
        camera = frame.camera
        T_camera_world = invert_transform(frame.T_world_camera)
        return partial(
            select_kernel,
            *box,
            T_camera_world,
            T_camera_world[:3, :3] * (0.5 * self._block_m),
            self._config.voxel_size_m,
            self._depth_range(),
            (camera.fx, camera.fy, camera.cx, camera.cy),
            (camera.width, camera.height),
            image.tiles,
            self._directory.origin,
            self._directory.rows,
            self._pools,
            np.uint16(self._farthest),
            revision,
            *lists,
        )

    def _depth_range(self) -> tuple[float, float, float, float]:
        """Return `depth_range` of `classify_block`, metres."""
        cfg, v = self._config, self._config.voxel_size_m
        return (
            cfg.min_range_m,
            cfg.max_range_m,
            cfg.truncation_voxels * v,
            cfg.behind_voxels * v,
        )

    def _release_blocks_of(self, layers: ObjectLayers, revision: int) -> None:
        """Remove the blocks that were allocated for a refused frame."""
        is_new = (self._pools.appearance == revision) & (self._pools.used == 1)
        self.forget(layers, np.flatnonzero(is_new))

    def forget(self, layers: ObjectLayers, rows: NDArray[np.integer]) -> None:
        """Remove blocks with everything that they hold."""
        drop_blocks(rows, self._pools, layers.surface, self._directory.rows, self._directory.origin)

    def _drop_blocks(
        self, layers: ObjectLayers, position: NDArray[np.float64], revision: int
    ) -> NDArray[np.int64]:
        """Drop an eighth of the blocks: the longest unseen first, those near the camera last."""
        reach = self._config.max_range_m / self._block_m
        rows = oldest_blocks(self._pools, position / self._block_m, reach, revision)
        coords = self._pools.coord[rows].copy()
        self.forget(layers, rows)
        return coords

    @property
    def _block_m(self) -> float:
        return BLOCK_EDGE * self._config.voxel_size_m


def _corner_rays(frame: Frame) -> NDArray[np.float64]:
    c = frame.camera
    u = np.array([-0.5, c.width - 0.5, -0.5, c.width - 0.5])
    v = np.array([-0.5, -0.5, c.height - 0.5, c.height - 0.5])
    return np.stack([(u - c.cx) / c.fx, (v - c.cy) / c.fy, np.ones(4)], axis=1)


def box_bounds(low: NDArray[np.int64], shape: Iterable[int]) -> tuple[int, ...]:
    """Return lower corner and shape of a box of blocks as six integers."""
    return *(int(n) for n in low), *(int(n) for n in shape)

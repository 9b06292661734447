"""The map in the scene: a point cloud per column of blocks, boxes where the object may be."""

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from app.view.colors import NOT_MAPPED, OOI_SCALE, UNMAPPED, linear, ooi_colors, voxel_colors
from app.view.floor_height import layer_below
from app.view.model.voxel_store import COLUMN, Column, ColumnVoxels, VoxelStore
from app.view.view_options import ViewOptions

POINT_SIZE: Final = 1.3
"""Point size in voxels that leaves no gaps between neighbours from any direction."""

_DARKEST: Final = 164
_DARKEST_DATA: Final = 176
"""Brightness of 255 in the deepest shade; higher where colours encode values."""

MAX_BOXES: Final = 6000
LEAST_CONFIDENCE: Final = 76
"""Probability of a label, in units of 1/254, from which a voxel has its colour: 0.3."""
NEAR_M: Final = 0.8
"""Horizontal distance to a viewpoint within which surface has the colour of its gain."""
DEFAULT_TOP_M: Final = 3.0
"""Upper end of the height ramp without a ceiling cut."""

_CUBE: Final = np.array(
    [[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)], dtype=np.float32
)
_CUBE_FACES: Final = np.array(
    [
        [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
        [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3],
    ],
    dtype=np.uint32,
)  # fmt: skip


class VoxelLayer:
    """Draws columns of a `VoxelStore` under fixed node names."""

    def __init__(self, scene: Any) -> None:
        self._scene = scene
        self._options: ViewOptions | None = None
        self._voxel_size_m = self._floor_z_m = 0.0
        self._clouds: dict[Column, Any] = {}
        self._gathered: dict[Column, ColumnVoxels] = {}
        """Columns as last drawn, for recolouring."""
        self._below: int | None = None
        self._extents: dict[Column, tuple[NDArray[np.int16], NDArray[np.int16]]] = {}
        """Least and greatest x and y of the voxels drawn in each column, in voxels."""
        self._likely: dict[Column, tuple[NDArray[np.float32], NDArray[np.uint8]]] = {}
        self._boxes: Any = None
        self._viewpoints: KDTree | None = None
        """x and y of the viewpoints, for the colour mode of gains; None if all gains are 0."""
        self._gains: NDArray[np.uint8] = np.empty(0, np.uint8)
        """(N + 1,) gain of each viewpoint over the highest gain, and 255 for none."""
        self.kinds: NDArray[np.uint8] = np.full((256, 3), UNMAPPED, np.uint8)
        """(256, 3) colour of each label, for the colour mode of things without a chosen one."""
        self.shown = 0
        """Columns that are drawn now."""

    def set_gains(self, xy_world: NDArray[np.float32], gains: NDArray[np.float32]) -> None:
        """Set the viewpoints of the colour mode of gains, for columns that are drawn after.

        Args:
            xy_world: (N, 2) position of each, metres.
            gains: (N,) gain of each.
        """
        highest = gains.max(initial=0.0)
        self._viewpoints = None
        if highest > 0.0:
            self._viewpoints = KDTree(xy_world)
            shares = np.clip(gains / highest * OOI_SCALE, 0.0, OOI_SCALE)
            self._gains = np.append(shares.astype(np.uint8), np.uint8(NOT_MAPPED))

    def draw(
        self,
        store: VoxelStore,
        voxel_size_m: float,
        dirty: Sequence[Column],
        options: ViewOptions,
        floor_z_m: float,
    ) -> None:
        """Draw changed columns; all columns after a change of options.

        Another floor changes all columns of the store.
        """
        if voxel_size_m != self._voxel_size_m:
            self._remove_all()
            self._voxel_size_m = voxel_size_m
        below = None
        if options.ceiling_m is not None:
            below = layer_below(options.ceiling_m, floor_z_m, voxel_size_m)
        if below != self._below:
            self._gathered.clear()
            self._below = below
        self._floor_z_m = floor_z_m
        for column in dirty:
            self._gathered.pop(column, None)
        if options != self._options:
            # Columns of a map that was cleared are no longer in the store.
            dirty = list({*dirty, *store.columns})
            self._options = options
        boxes_changed = False
        for column in dirty:
            voxels = self._gathered.get(column)
            if voxels is None:
                voxels = self._gathered[column] = store.column(column, below)
            boxes_changed |= self._draw_column(column, voxels, options)
            if not len(voxels.local):
                self._forget(column)
        if boxes_changed:
            self._draw_boxes()
        self.shown = len(self._extents)

    def bounds(self) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
        """Return the least and greatest (x, y) of the drawn voxels in metres; None without any."""
        shown = list(self._extents)
        if not shown:
            return None
        corners = np.array(shown, dtype=np.float64) * COLUMN
        low = np.array([self._extents[column][0] for column in shown])
        high = np.array([self._extents[column][1] for column in shown])
        size = self._voxel_size_m
        return (corners + low).min(axis=0) * size, (corners + high + 1.0).max(axis=0) * size

    def _forget(self, column: Column) -> None:
        """Remove the cloud of a column without voxels, which may be that of another map."""
        del self._gathered[column]
        cloud = self._clouds.pop(column, None)
        if cloud is not None:
            cloud.remove()

    def _draw_column(self, column: Column, voxels: ColumnVoxels, options: ViewOptions) -> bool:
        """Draw one column; return whether the boxes have changed."""
        ooi = voxels.attributes[:, 3]
        likely = (ooi != NOT_MAPPED) & (ooi >= options.object_threshold * OOI_SCALE)
        if "object" not in options.layers:
            likely[:] = False
        self._draw_points(column, voxels, ~likely, options)
        had = self._likely.pop(column, None) is not None
        if not likely.any():
            return had
        corner = np.array([column[0] * COLUMN, column[1] * COLUMN, 0.0], dtype=np.float32)
        centers = (voxels.local[likely] + corner + np.float32(0.5)) * np.float32(self._voxel_size_m)
        self._likely[column] = (centers, ooi[likely])
        return True

    def _draw_points(
        self,
        column: Column,
        voxels: ColumnVoxels,
        kept: NDArray[np.bool_],
        options: ViewOptions,
    ) -> None:
        cloud = self._clouds.get(column)
        local, attributes = voxels.local[kept], voxels.attributes[kept]
        if not len(local) or "map" not in options.layers:
            self._extents.pop(column, None)
            if cloud is not None:
                cloud.visible = False
            return
        self._extents[column] = (local[:, :2].min(axis=0), local[:, :2].max(axis=0))
        ooi = attributes[:, 3]
        colors = voxel_colors(
            options.mode,
            rgb=attributes[:, :3],
            ooi=ooi,
            level=attributes[:, 5],
            height_m=(local[:, 2] + np.float32(0.5)) * np.float32(self._voxel_size_m)
            - np.float32(self._floor_z_m),
            top_m=options.ceiling_m or DEFAULT_TOP_M,
            thing=_thing(attributes, options.thing),
            kind=self._kinds_of(attributes) if _shows_kinds(options) else None,
            gain=self._gain_of(column, local) if options.mode == "gain" else ooi,
        )
        darkest = _DARKEST if options.mode == "camera" else _DARKEST_DATA
        colors = _shade(colors, voxels.openness[kept], local, darkest)
        # Half integers below 1024 are exact in float16: 6 bytes per point instead of 12. Layers
        # are counted from the lowest, because they may lie far above the world's origin.
        lowest, size = int(local[:, 2].min()), self._voxel_size_m
        points = (local - np.array([0, 0, lowest]) + 0.5).astype(np.float16)
        position = (column[0] * COLUMN * size, column[1] * COLUMN * size, lowest * size)
        if cloud is None:
            self._clouds[column] = self._scene.add_point_cloud(
                f"/map/{column[0]}_{column[1]}",
                points,
                colors,
                point_size=POINT_SIZE,
                point_shape="square",
                point_shading="flat",
                precision="float16",
                scale=size,
                position=position,
            )
            return
        if cloud.position[2] != position[2]:
            cloud.position = position
        cloud.points = points
        cloud.colors = colors
        cloud.visible = True

    def _kinds_of(self, attributes: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Return (N, 3) colours of the most probable labels."""
        colors = self.kinds[attributes[:, 6]]
        colors[attributes[:, 7] < LEAST_CONFIDENCE] = UNMAPPED
        return colors

    def _gain_of(self, column: Column, local: NDArray[np.int16]) -> NDArray[np.uint8]:
        """Return the gain of the nearest viewpoint over the highest gain, 255 for none near."""
        if self._viewpoints is None:
            return np.full(len(local), NOT_MAPPED, dtype=np.uint8)
        corner = np.array([column[0] * COLUMN, column[1] * COLUMN])
        xy = (local[:, :2] + corner + 0.5) * self._voxel_size_m
        _, nearest = self._viewpoints.query(xy, distance_upper_bound=NEAR_M)
        return self._gains[nearest]

    def _draw_boxes(self) -> None:
        if not self._likely:
            if self._boxes is not None:
                self._boxes.visible = False
            return
        centers = np.concatenate([c for c, _ in self._likely.values()])
        ooi = np.concatenate([o for _, o in self._likely.values()])
        if len(ooi) > MAX_BOXES:
            best = np.argpartition(ooi, len(ooi) - MAX_BOXES)[-MAX_BOXES:]
            centers, ooi = centers[best], ooi[best]
        wxyzs = np.tile(np.array([1.0, 0.0, 0.0, 0.0], dtype=np.float32), (len(ooi), 1))
        colors = linear(ooi_colors(ooi))
        if self._boxes is None:
            self._boxes = self._scene.add_batched_meshes_simple(
                "/object_voxels",
                _CUBE * np.float32(self._voxel_size_m * 1.12),
                _CUBE_FACES,
                wxyzs,
                centers,
                batched_colors=colors,
                flat_shading=True,
                lod="off",
                cast_shadow=False,
                receive_shadow=False,
            )
            return
        self._boxes.batched_wxyzs = wxyzs
        self._boxes.batched_positions = centers
        self._boxes.batched_colors = colors
        self._boxes.visible = True

    def _remove_all(self) -> None:
        for cloud in self._clouds.values():
            cloud.remove()
        if self._boxes is not None:
            self._boxes.remove()
        self._boxes = None
        for known in (self._clouds, self._gathered, self._extents, self._likely):
            known.clear()


def _shows_kinds(options: ViewOptions) -> bool:
    return options.mode == "thing" and options.thing is None


def _thing(attributes: NDArray[np.uint8], label: int | None) -> NDArray[np.uint8]:
    """Return the confidence of voxels whose most probable label is the given one, else 255."""
    if label is None:
        return np.full(len(attributes), NOT_MAPPED, dtype=np.uint8)
    return np.where(attributes[:, 6] == label, np.minimum(attributes[:, 7], 254), NOT_MAPPED)


def _shade(
    colors: NDArray[np.uint8],
    openness: NDArray[np.uint8],
    local: NDArray[np.int16],
    darkest: int,
) -> NDArray[np.uint8]:
    """Darken voxels below or beside others, and vary the brightness of each slightly."""
    i, j, k = local.T.astype(np.int64)
    grain = (((i * 73_856_093) ^ (j * 19_349_663) ^ (k * 83_492_791)) >> 4) & 15
    factor = darkest + (openness.astype(np.int64) * (240 - darkest)) // 255 + grain
    return ((colors * factor[:, None]) >> 8).astype(np.uint8)

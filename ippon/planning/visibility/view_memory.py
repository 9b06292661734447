"""Number of images of each voxel, and the step in which the map last changed around it."""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ippon.compiling import njit
from ippon.mapping.arrays import FREE, NOT_MAPPED, OCCUPIED, UNKNOWN, MapArrays
from ippon.planning.array_overlap import copy_overlap
from ippon.planning.visibility.panorama import ViewField, ViewRules, within_field
from ippon.planning.visibility.rays import cast_rays
from ippon.planning.visibility.view_config import StalenessConfig
from ippon.planning.visibility.view_geometry import ViewLayers
from ippon.planning.visibility.view_table import ViewTable
from ippon.planning.voxel_lookup import block_row

_NO_BLOCK: Final = np.iinfo(np.int64).min


class ViewMemory:
    """State and number of images of each voxel, and the last change of each block column.

    Space that remains unknown although the camera observed it (glass, mirrors, dark holes) must
    lose its gain; so must a surface that was observed often. Statistics of each block keep
    viewpoints from being evaluated again for small changes.

    Args:
        config: Changes of a block after which it counts as changed.
        range_m: Range of the camera.
    """

    def __init__(self, config: StalenessConfig, range_m: float) -> None:
        self.step = 0
        """Number of updates so far."""
        self._range_m = range_m
        self._thresholds = (
            config.unknown_voxels,
            config.occupied_voxels,
            config.unlabelled_voxels,
            config.object_voxels,
        )
        self._field = _empty_field(np.zeros(3, dtype=np.int64), (0, 0, 0))
        self._changed = np.zeros((0, 0), dtype=np.int64)
        self._statistics = np.zeros((0, 4), dtype=np.float32)
        self._owner = np.zeros((0, 3), dtype=np.int64)
        """(B, 3) block that the statistics of a row of the map are of; `_NO_BLOCK` before any."""
        self._revision = -1

    @property
    def field(self) -> ViewField:
        """States and numbers of images, for the view kernels."""
        return self._field

    @property
    def changed(self) -> NDArray[np.int64]:
        """(X, Y) step in which a block column last changed; (0, 0) at `field.origin`."""
        return self._changed

    def begin_goal(self, arrays: MapArrays, layers: ViewLayers) -> None:
        """Count no image of a surface for another object, and forget what the map has dropped.

        No viewpoint becomes stale by the first: a new goal resets the object probabilities of every
        block, which does, while other levels alone need no new ray. Blocks that the map has dropped
        at its memory limit stay as they were seen during a search, which would go to and fro
        between them otherwise; for another object they are unknown.

        Args:
            arrays: The map.
            layers: Those of the last `update`.
        """
        field = self._field
        field.surface_views[:] = 0
        _forget_dropped_kernel(arrays, field, layers.floor, self.step, self._changed)

    def update(self, arrays: MapArrays, layers: ViewLayers, rules: ViewRules) -> None:
        """Match the map's extent, and record which block columns have changed by enough.

        Args:
            arrays: The map.
            layers: Voxel layers that count.
            rules: What a voxel counts.
        """
        self.step += 1
        self._fit(arrays, layers)
        rows = arrays.state.shape[0]
        if rows > self._statistics.shape[0]:
            grown = np.zeros((max(rows, 2 * self._statistics.shape[0]), 4), dtype=np.float32)
            grown[: self._statistics.shape[0]] = self._statistics
            owner = np.full((len(grown), 3), _NO_BLOCK, dtype=np.int64)
            owner[: len(self._owner)] = self._owner
            self._statistics, self._owner = grown, owner
        _note_changes_kernel(
            arrays,
            self._revision,
            np.array((layers.low, layers.high), dtype=np.int64),
            rules,
            self._thresholds,
            self._statistics,
            self._owner,
            self._field,
            self.step,
            self._changed,
        )
        if arrays.revision.size:
            self._revision = max(self._revision, int(arrays.revision.max()))

    def record(
        self,
        arrays: MapArrays,
        table: ViewTable,
        rules: ViewRules,
        camera_voxel: tuple[int, int, int],
        shown: NDArray[np.bool_],
    ) -> None:
        """Count one image of every voxel that it shows as unknown or as a surface.

        Args:
            arrays: The map, with that image in it.
            table: Directions and offsets.
            rules: What a voxel counts.
            camera_voxel: Voxel that held the camera.
            shown: (P * Y,) directions within the image.
        """
        if not within_field(table, self._field, camera_voxel):
            # The robot has left the map.
            return
        camera = np.array(camera_voxel, dtype=np.int64)
        cells = np.flatnonzero(shown)
        depth = cast_rays(arrays, table, rules.unknown_depth, camera, cells)
        _record_kernel(table, rules, self._field, camera, cells, depth, self.step, self._changed)

    def _fit(self, arrays: MapArrays, layers: ViewLayers) -> None:
        """Match extent and layers; numbers of images stay with their voxels in the world."""
        # Blocks around the map, so that no view reaches beyond the field.
        margin = math.ceil(self._range_m / arrays.voxel_size / 8.0) + 1
        old = self._field
        first = (arrays.origin_block[:2] - margin) * 8
        origin = np.array([first[0], first[1], layers.low], dtype=np.int64)
        shape = (
            (arrays.directory.shape[0] + 2 * margin) * 8,
            (arrays.directory.shape[1] + 2 * margin) * 8,
            layers.high - layers.low + 1,
        )
        if old.state.shape == shape and (old.origin == origin).all():
            return
        field = _empty_field(origin, shape)
        field.state[:, :, : layers.floor] = FREE
        changed = np.zeros((shape[0] // 8, shape[1] // 8), dtype=np.int64)
        offset = old.origin - origin
        copy_overlap(old.unknown_views, offset, field.unknown_views)
        copy_overlap(old.surface_views, offset, field.surface_views)
        if offset[2] == 0 and old.state.shape[2] == shape[2]:
            copy_overlap(old.state, offset, field.state)
            copy_overlap(self._changed, offset[:2] >> 3, changed)
        else:
            changed[:] = self.step
            self._revision = -1
        self._field, self._changed = field, changed


def _empty_field(origin: NDArray[np.int64], shape: tuple[int, int, int]) -> ViewField:
    return ViewField(
        origin=origin,
        state=np.full(shape, UNKNOWN, dtype=np.uint8),
        unknown_views=np.zeros(shape, dtype=np.uint8),
        surface_views=np.zeros(shape, dtype=np.uint8),
    )


@njit(cache=True, nogil=True)
def _note_changes_kernel(
    arrays, since, layers, rules, thresholds, statistics, owner, field, step, changed
):
    directory, origin = arrays.directory, field.origin
    for bx in range(directory.shape[0]):
        for by in range(directory.shape[1]):
            for bz in range(directory.shape[2]):
                row = directory[bx, by, bz]
                if row < 0 or arrays.revision[row] <= since:
                    continue
                base = (bz + arrays.origin_block[2]) * 8
                if base + 7 < layers[0] or base > layers[1]:
                    continue
                unknown, occupied, unlabelled, known = 0, 0, 0, 0.0
                fx = (bx + arrays.origin_block[0]) * 8 - origin[0]
                fy = (by + arrays.origin_block[1]) * 8 - origin[1]
                for c in range(512):
                    k = base + (c & 7)
                    if k < layers[0] or k > layers[1]:
                        continue
                    state = arrays.state[row, c]
                    code = NOT_MAPPED
                    if state == OCCUPIED:
                        code = arrays.ooi[arrays.slab[row], c]
                    if k < layers[0] + rules.floor_layers and (
                        code == NOT_MAPPED or code / 254.0 <= rules.ooi_threshold
                    ):
                        state = FREE
                    field.state[fx + (c >> 6), fy + ((c >> 3) & 7), k - origin[2]] = state
                    if state == UNKNOWN:
                        unknown += 1
                    elif state == OCCUPIED:
                        occupied += 1
                        if code == NOT_MAPPED:
                            unlabelled += 1
                        elif code / 254.0 > rules.ooi_floor:
                            known += code / 254.0
                old, block = statistics[row], owner[row]
                ox, oy = bx + arrays.origin_block[0], by + arrays.origin_block[1]
                is_other = block[0] != ox or block[1] != oy or block[2] * 8 != base
                block[0], block[1], block[2] = ox, oy, base >> 3
                if (
                    is_other
                    or abs(unknown - old[0]) >= thresholds[0]
                    or abs(occupied - old[1]) >= thresholds[1]
                    or abs(unlabelled - old[2]) >= thresholds[2]
                    or abs(known - old[3]) >= thresholds[3]
                ):
                    old[0], old[1], old[2], old[3] = unknown, occupied, unlabelled, known
                    changed[fx >> 3, fy >> 3] = step


@njit(cache=True, nogil=True)
def _record_kernel(table, rules, field, camera, cells, depths, step, changed):
    cx, cy, cz = camera[0], camera[1], camera[2]
    fx, fy, fz = cx - field.origin[0], cy - field.origin[1], cz - field.origin[2]
    half = math.ceil(0.5 * rules.unknown_views)
    enough = math.ceil(rules.unknown_views)
    for r in range(cells.shape[0]):
        cell, depth = cells[r], depths[r]
        solid_end = (1.0 - depth) if depth < 0.0 else depth
        space_end = (-1.0 - depth) if depth < 0.0 else depth
        for n in range(table.start[cell], table.start[cell + 1]):
            far = table.range[n]
            if far > solid_end:
                break
            a, b, c = fx + table.offset[n, 0], fy + table.offset[n, 1], fz + table.offset[n, 2]
            state = field.state[a, b, c]
            if state == UNKNOWN:
                if far <= space_end and field.unknown_views[a, b, c] < 255:
                    field.unknown_views[a, b, c] += 1
                    count = field.unknown_views[a, b, c]
                    if count in (half, enough):
                        changed[a >> 3, b >> 3] = step
            elif state == OCCUPIED and far <= rules.surface_range:
                field.surface_views[a, b, c] = min(254, field.surface_views[a, b, c]) + 1


@njit(cache=True, nogil=True)
def _forget_dropped_kernel(arrays, field, floor_layers, step, changed):
    origin, shape = field.origin, field.state.shape
    for x in range(0, shape[0], 8):
        for y in range(0, shape[1], 8):
            was_known = False
            for z in range(shape[2]):
                if block_row(arrays, x + origin[0], y + origin[1], z + origin[2]) >= 0:
                    continue
                nothing = FREE if z < floor_layers else UNKNOWN
                for i in range(x, x + 8):
                    for j in range(y, y + 8):
                        if field.state[i, j, z] != nothing:
                            field.state[i, j, z] = nothing
                            field.unknown_views[i, j, z] = 0
                            was_known = True
            if was_known:
                changed[x >> 3, y >> 3] = step

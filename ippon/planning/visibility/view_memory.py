"""What the camera has looked at, and where the map has changed for a viewpoint."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ippon.mapping.arrays import FREE, NOT_MAPPED, OCCUPIED, UNKNOWN, MapArrays
from ippon.planning.array_overlap import copy_overlap
from ippon.planning.visibility.panorama import ViewField, ViewRules, within_field
from ippon.planning.visibility.rays import cast_rays
from ippon.planning.visibility.view_table import ViewTable


class ViewMemory:
    """State of and looks at each voxel, and the step in which each block column last changed.

    Space that stays unknown although the camera looked at it (glass, mirrors, a dark hole, what no
    map keeps) must not attract for ever; neither must a surface that has told all it will. The
    block statistics keep viewpoints from being evaluated again for changes that cannot matter.
    """

    def __init__(self, range_voxels: float) -> None:
        self.step = 0
        # Blocks kept round the map, so that no view reaches beyond.
        self._margin = math.ceil(range_voxels / 8.0) + 1
        self._field = _empty_field(np.zeros(3, dtype=np.int64), (0, 0, 0))
        self._changed = np.zeros((0, 0), dtype=np.int64)
        self._statistics = np.zeros((0, 4), dtype=np.float32)
        self._revision = -1

    @property
    def field(self) -> ViewField:
        """States and looks as the view kernels take them."""
        return self._field

    @property
    def changed(self) -> NDArray[np.int64]:
        """(X, Y) step in which a block column last changed; (0, 0) at `field.origin`."""
        return self._changed

    def forget_surfaces(self) -> None:
        """Count looks at surfaces anew: another object is searched for.

        Viewpoints stay as they are until the map itself changes: a new goal resets the labels of
        the object, which shows in every block, while other levels alone need no new ray.
        """
        self._field.surface_looks[:] = 0

    def follow(self, arrays: MapArrays, layers: tuple[int, int], rules: ViewRules) -> None:
        """Match the map's extent and note which block columns changed in a way that matters.

        Args:
            arrays: The map.
            layers: Lowest and highest voxel layer that counts, upper end included.
            rules: What a voxel counts.
        """
        self.step += 1
        self._fit(arrays, layers, rules.floor_layers)
        rows = arrays.state.shape[0]
        if rows > self._statistics.shape[0]:
            grown = np.zeros((max(rows, 2 * self._statistics.shape[0]), 4), dtype=np.float32)
            grown[:, 0] = -1.0
            grown[: self._statistics.shape[0]] = self._statistics
            self._statistics = grown
        _note_changes_kernel(
            arrays,
            self._revision,
            np.array(layers, dtype=np.int64),
            rules,
            self._statistics,
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
        """Count one image: every visible voxel that it left unsettled.

        Args:
            arrays: The map, with that image in it.
            table: Directions and offsets.
            rules: What a voxel counts.
            camera_voxel: Voxel that held the camera.
            shown: (P * Y,) directions that the image showed.
        """
        if not within_field(table, self._field, camera_voxel):
            # The robot drove off the map; there is nothing to settle there.
            return
        camera = np.array(camera_voxel, dtype=np.int64)
        cells = np.flatnonzero(shown)
        depth = cast_rays(arrays, table, rules.unknown_depth, camera, cells)
        _record_kernel(table, rules, self._field, camera, cells, depth, self.step, self._changed)

    def _fit(self, arrays: MapArrays, layers: tuple[int, int], floor_layers: int) -> None:
        """Match extent and layers; other layers mean another floor, and a fresh start."""
        margin, old = self._margin, self._field
        first = (arrays.origin_block[:2] - margin) * 8
        origin = np.array([first[0], first[1], layers[0]], dtype=np.int64)
        shape = (
            (arrays.directory.shape[0] + 2 * margin) * 8,
            (arrays.directory.shape[1] + 2 * margin) * 8,
            layers[1] - layers[0] + 1,
        )
        if old.state.shape == shape and (old.origin == origin).all():
            return
        field = _empty_field(origin, shape)
        field.state[:, :, :floor_layers] = FREE
        changed = np.zeros((shape[0] // 8, shape[1] // 8), dtype=np.int64)
        if old.origin[2] == origin[2] and old.state.shape[2] == shape[2]:
            offset = old.origin - origin
            copy_overlap(old.state, offset, field.state)
            copy_overlap(old.unknown_looks, offset, field.unknown_looks)
            copy_overlap(old.surface_looks, offset, field.surface_looks)
            copy_overlap(self._changed, offset[:2] >> 3, changed)
        else:
            changed[:] = self.step
            self._revision = -1
        self._field, self._changed = field, changed


def _empty_field(origin: NDArray[np.int64], shape: tuple[int, int, int]) -> ViewField:
    return ViewField(
        origin=origin,
        state=np.full(shape, UNKNOWN, dtype=np.uint8),
        unknown_looks=np.zeros(shape, dtype=np.uint8),
        surface_looks=np.zeros(shape, dtype=np.uint8),
    )


@njit(cache=True, nogil=True)
def _note_changes_kernel(arrays, since, layers, rules, statistics, field, step, changed):
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
                old = statistics[row]
                # A handful of voxels, or one object voxel, is the least that shows in a gain.
                if (
                    old[0] < 0.0
                    or abs(unknown - old[0]) >= 24.0
                    or abs(occupied - old[1]) >= 8.0
                    or abs(unlabelled - old[2]) >= 4.0
                    or abs(known - old[3]) >= 0.7
                ):
                    old[0], old[1], old[2], old[3] = unknown, occupied, unlabelled, known
                    changed[fx >> 3, fy >> 3] = step


@njit(cache=True, nogil=True)
def _record_kernel(table, rules, field, camera, cells, depths, step, changed):
    cx, cy, cz = camera[0], camera[1], camera[2]
    fx, fy, fz = cx - field.origin[0], cy - field.origin[1], cz - field.origin[2]
    half = math.ceil(0.5 * rules.unknown_looks)
    enough = math.ceil(rules.unknown_looks)
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
                if far <= space_end and field.unknown_looks[a, b, c] < 255:
                    field.unknown_looks[a, b, c] += 1
                    count = field.unknown_looks[a, b, c]
                    if count in (half, enough):
                        changed[a >> 3, b >> 3] = step
            elif state == OCCUPIED and far <= rules.surface_range:
                field.surface_looks[a, b, c] = min(254, field.surface_looks[a, b, c]) + 1

"""What the camera has looked at, and where the map has changed for a viewpoint."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ippon.mapping.arrays import FREE, NOT_MAPPED, OCCUPIED, UNKNOWN, MapArrays
from ippon.planning.panorama import LookCounts, ViewRules, cast_ray
from ippon.planning.view_table import ViewTable
from ippon.planning.voxels import block_row

MARGIN_BLOCKS = 8
"""Blocks of unobserved space kept round the map: views reach beyond what was observed."""


class ViewMemory:
    """Looks at each voxel, and the step in which each block column last changed.

    Space that stays unknown although the camera looked at it (glass, mirrors, a dark hole, what no
    map keeps) must not attract for ever; neither must a surface that has told all it will. The
    block statistics keep viewpoints from being evaluated again for changes that cannot matter.
    """

    def __init__(self) -> None:
        self.step = 0
        self._layers: tuple[int, int] | None = None
        self._looks = LookCounts(
            origin=np.zeros(3, dtype=np.int64),
            unknown=np.zeros((0, 0, 0), dtype=np.uint8),
            surface=np.zeros((0, 0, 0), dtype=np.uint8),
        )
        self._changed = np.zeros((0, 0), dtype=np.int64)
        self._statistics = np.zeros((0, 4), dtype=np.float32)
        self._revision = -1

    @property
    def looks(self) -> LookCounts:
        """Counts as the view kernels take them."""
        return self._looks

    @property
    def changed(self) -> NDArray[np.int64]:
        """(X, Y) step in which a block column last changed; row 0 at `looks.origin`."""
        return self._changed

    def forget_surfaces(self) -> None:
        """Count looks at surfaces anew: another object is searched for."""
        self._looks.surface[:] = 0
        self._changed[:] = self.step

    def follow(self, arrays: MapArrays, layers: tuple[int, int], rules: ViewRules) -> None:
        """Match the map's extent and note which block columns changed in a way that matters.

        Args:
            arrays: The map.
            layers: Lowest and highest voxel layer that counts, upper end included.
            rules: What a voxel counts.
        """
        self.step += 1
        self._fit(arrays, layers)
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
            self._looks.origin >> 3,
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
        surface_range: float,
    ) -> None:
        """Count one image: every visible voxel that it left unsettled.

        Args:
            arrays: The map, with that image in it.
            table: Directions and offsets.
            rules: What a voxel counts.
            camera_voxel: Voxel that held the camera.
            shown: (P * Y,) directions that the image showed.
            surface_range: Range in voxels within which the goal is recognised.
        """
        _record_kernel(
            arrays,
            table,
            rules,
            self._looks,
            np.array(camera_voxel, dtype=np.int64),
            shown,
            surface_range,
            self.step,
            self._changed,
        )

    def _fit(self, arrays: MapArrays, layers: tuple[int, int]) -> None:
        origin = np.array(
            [
                (arrays.origin_block[0] - MARGIN_BLOCKS) * 8,
                (arrays.origin_block[1] - MARGIN_BLOCKS) * 8,
                layers[0],
            ],
            dtype=np.int64,
        )
        shape = (
            (arrays.directory.shape[0] + 2 * MARGIN_BLOCKS) * 8,
            (arrays.directory.shape[1] + 2 * MARGIN_BLOCKS) * 8,
            layers[1] - layers[0] + 1,
        )
        old = self._looks
        if old.unknown.shape == shape and (old.origin == origin).all() and self._layers == layers:
            return
        fresh = LookCounts(
            origin=origin,
            unknown=np.zeros(shape, dtype=np.uint8),
            surface=np.zeros(shape, dtype=np.uint8),
        )
        changed = np.zeros((shape[0] // 8, shape[1] // 8), dtype=np.int64)
        if self._layers == layers:
            _paste(old.unknown, old.origin - origin, fresh.unknown)
            _paste(old.surface, old.origin - origin, fresh.surface)
            _paste(self._changed, (old.origin[:2] - origin[:2]) >> 3, changed)
        else:
            changed[:] = self.step
        self._looks, self._changed, self._layers = fresh, changed, layers


def _paste(source: NDArray, offset: NDArray[np.int64], target: NDArray) -> None:
    """Copy `source` into `target`, its first element at `offset`, as far as it overlaps."""
    low = np.maximum(offset, 0)
    high = np.minimum(offset + source.shape, target.shape)
    if (high > low).all():
        to = tuple(slice(a, b) for a, b in zip(low, high, strict=True))
        back = tuple(slice(a - o, b - o) for a, b, o in zip(low, high, offset, strict=True))
        target[to] = source[back]


@njit(cache=True, nogil=True)
def _note_changes_kernel(arrays, since, layers, rules, statistics, origin, step, changed):
    directory = arrays.directory
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
                for c in range(512):
                    k = base + (c & 7)
                    if k < layers[0] or k > layers[1]:
                        continue
                    state = arrays.state[row, c]
                    if state == UNKNOWN:
                        unknown += 1
                    elif state == OCCUPIED:
                        occupied += 1
                        code = arrays.ooi[row, c]
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
                    x = bx + arrays.origin_block[0] - origin[0]
                    y = by + arrays.origin_block[1] - origin[1]
                    changed[x, y] = step


@njit(cache=True, nogil=True)
def _record_kernel(arrays, table, rules, looks, camera, shown, surface_range, step, changed):
    cx, cy, cz = camera[0], camera[1], camera[2]
    ox, oy, oz = looks.origin[0], looks.origin[1], looks.origin[2]
    nx, ny, nz = looks.unknown.shape
    half = math.ceil(0.5 * rules.unknown_looks)
    for cell in range(shown.shape[0]):
        if not shown[cell]:
            continue
        ray = table.rays[cell]
        depth = cast_ray(arrays, table, rules.unknown_depth, cx, cy, cz, ray[0], ray[1], ray[2])
        solid_end = (1.0 - depth) if depth < 0.0 else depth
        space_end = (-1.0 - depth) if depth < 0.0 else depth
        for n in range(table.start[cell], table.start[cell + 1]):
            far = table.range[n]
            if far > solid_end:
                break
            i = cx + table.offset[n, 0]
            j = cy + table.offset[n, 1]
            k = cz + table.offset[n, 2]
            a, b, c = i - ox, j - oy, k - oz
            if a < 0 or b < 0 or c < 0 or a >= nx or b >= ny or c >= nz:
                continue
            row = block_row(arrays, i, j, k)
            state = UNKNOWN
            if row >= 0:
                state = arrays.state[row, ((i & 7) << 6) | ((j & 7) << 3) | (k & 7)]
            if state == FREE:
                continue
            if state == UNKNOWN:
                if far <= space_end and looks.unknown[a, b, c] < 255:
                    looks.unknown[a, b, c] += 1
                    count = looks.unknown[a, b, c]
                    if count == half or count == math.ceil(rules.unknown_looks):
                        changed[a >> 3, b >> 3] = step
            elif far <= surface_range and looks.surface[a, b, c] < 255:
                looks.surface[a, b, c] += 1

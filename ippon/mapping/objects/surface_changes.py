"""Surface voxels whose appearance changed since a view last asked."""

from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ippon.compiling import njit
from ippon.mapping.arrays import BLOCK_VOLUME, OCCUPIED
from ippon.mapping.blocks import N_ROWS, NO_SLAB
from ippon.mapping.voxel_map import VoxelMap

# Columns of `_Shown.looks`.
_OOI: Final = 3
_PROXIMITY: Final = 4
_LEVEL: Final = 5
_LABEL: Final = 6
_CONFIDENCE: Final = 7
_PRESENT: Final = 8
_COLUMNS: Final = 9


@dataclass(frozen=True, slots=True, kw_only=True)
class SurfaceThresholds:
    """Changes below which a voxel is not sent; larger sends less and shows coarser values."""

    color: int = 10
    """Of 255, in any channel."""
    probability: int = 5
    """Of 254, for the object of interest and the proximity."""
    confidence: int = 12
    """Of 254, for the probability of the label."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SurfaceDelta:
    """Surface voxels, one row each."""

    revision: int
    """Map revision that the rows show."""
    index: NDArray[np.int32]
    """(M, 3) voxel index; the centre is (index + 0.5) * voxel_size."""
    color: NDArray[np.uint8]
    """(M, 3) RGB."""
    ooi: NDArray[np.uint8]
    """(M,) p(v in O) in units of 1/254, 255 where not mapped."""
    proximity: NDArray[np.uint8]
    """(M,) l(v) in units of 1/254, 255 where not labelled."""
    level: NDArray[np.uint8]
    """(M,) proximity level of the label, 255 where not labelled."""
    label: NDArray[np.uint8]
    """(M,) index of the most probable common label, 255 for none."""
    confidence: NDArray[np.uint8]
    """(M,) its probability in units of 1/254."""
    removed: NDArray[np.bool_]
    """(M,) whether the voxel is no longer surface; its other values are void."""


class _Shown(NamedTuple):
    """State that was returned last, one slab for each block that has had surface."""

    looks: NDArray[np.uint8]
    """(S, 512, 9) colour, ooi, proximity, level, label, confidence, present."""
    coord: NDArray[np.int64]
    """(S, 3) block index."""
    row: NDArray[np.int64]
    """(S,) pool row."""


def changed_blocks(voxel_map: VoxelMap, revision: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the rows of blocks whose surface changed after a revision, and of those seen."""
    pools = voxel_map._pools  # noqa: SLF001 - one package
    used = pools.used == 1
    changed = np.flatnonzero(used & (pools.appearance > revision))
    return changed, np.flatnonzero(used & (pools.seen > revision))


class SurfaceTracker:
    """Changes of one map for one view; every view has its own tracker."""

    def __init__(self, voxel_map: VoxelMap, thresholds: SurfaceThresholds | None = None) -> None:
        self._map = voxel_map
        self._thresholds = thresholds or SurfaceThresholds()
        self._shown = _make_shown(64)
        self._slabs = 0
        self._free: list[int] = []
        """Slabs of dropped blocks, which others get."""
        self._slab_of_row: NDArray[np.int32] = np.full(voxel_map.config.max_blocks, -1, np.int32)
        self._revision = -1

    def update(self) -> SurfaceDelta:
        """Return the voxels that changed visibly since the last call."""
        pools = self._map._pools  # noqa: SLF001 - one package
        n = int(pools.tally[N_ROWS])
        changed = np.flatnonzero((pools.appearance[:n] > self._revision) & (pools.used[:n] == 1))
        dropped = self._forget_dropped()
        rows = self._rows_with_slabs(changed)
        out = np.empty((len(rows) * BLOCK_VOLUME, 3), np.int32)
        looks = np.empty((len(rows) * BLOCK_VOLUME, _COLUMNS), np.uint8)
        t = self._thresholds
        m = _delta_kernel(
            rows, self._slab_of_row, pools, self._map.surface, self._shown,
            (t.color, t.probability, t.confidence), np.zeros(_COLUMNS, np.int64), out, looks,
        )  # fmt: skip
        self._revision = self._map.revision
        index = np.concatenate([dropped, out[:m]])
        gone = np.zeros((len(dropped), _COLUMNS), np.uint8)
        return _delta(self._map.revision, index, np.concatenate([gone, looks[:m]]))

    def keyframe(self) -> SurfaceDelta:
        """Return every surface voxel; the next `update` counts from here."""
        self._shown.looks[: self._slabs] = 0
        self._slab_of_row[:] = -1
        self._slabs = 0
        self._free.clear()
        self._revision = -1
        return self.update()

    def _rows_with_slabs(self, changed: NDArray[np.intp]) -> NDArray[np.int64]:
        """Return those of the changed blocks that have or had surface, with slabs assigned."""
        pools = self._map._pools  # noqa: SLF001 - one package
        has_slab = self._slab_of_row[changed] >= 0
        has_surface = pools.slab[changed] != NO_SLAB
        rows = changed[has_slab | has_surface].astype(np.int64)
        new = rows[self._slab_of_row[rows] < 0]
        again = [self._free.pop() for _ in range(min(len(new), len(self._free)))]
        end = self._slabs + len(new) - len(again)
        while end > len(self._shown.row):
            self._shown = _grown(self._shown)
        slabs = np.array([*again, *range(self._slabs, end)], np.int32)
        self._slab_of_row[new] = slabs
        self._shown.coord[slabs] = pools.coord[new]
        self._shown.row[slabs] = new
        self._slabs = end
        return rows

    def _forget_dropped(self) -> NDArray[np.int32]:
        """Return the shown voxels of dropped blocks, and clear their slabs."""
        pools, n = self._map._pools, self._slabs  # noqa: SLF001 - one package
        row = self._shown.row[:n]
        stale = (row >= 0) & (
            (pools.used[row] == 0) | (pools.coord[row] != self._shown.coord[:n]).any(axis=1)
        )
        parts = [np.empty((0, 3), np.int32)]
        for slab in np.flatnonzero(stale):
            k = np.flatnonzero(self._shown.looks[slab, :, _PRESENT])
            offset = np.stack([k >> 6, (k >> 3) & 7, k & 7], axis=1)
            parts.append((self._shown.coord[slab] * 8 + offset).astype(np.int32))
            self._slab_of_row[row[slab]] = -1
            self._shown.looks[slab] = 0
            self._shown.row[slab] = -1
            self._free.append(int(slab))
        return np.concatenate(parts)


def _make_shown(slabs: int) -> _Shown:
    return _Shown(
        np.zeros((slabs, BLOCK_VOLUME, _COLUMNS), np.uint8),
        np.zeros((slabs, 3), np.int64),
        np.full(slabs, -1, np.int64),
    )


def _grown(shown: _Shown) -> _Shown:
    n = len(shown.row)
    larger = _make_shown(2 * n)
    for new, old in zip(larger, shown, strict=True):
        new[:n] = old
    return larger


def _delta(revision: int, index: NDArray[np.int32], looks: NDArray[np.uint8]) -> SurfaceDelta:
    return SurfaceDelta(
        revision=revision,
        index=index,
        color=np.ascontiguousarray(looks[:, :3]),
        ooi=np.ascontiguousarray(looks[:, _OOI]),
        proximity=np.ascontiguousarray(looks[:, _PROXIMITY]),
        level=np.ascontiguousarray(looks[:, _LEVEL]),
        label=np.ascontiguousarray(looks[:, _LABEL]),
        confidence=np.ascontiguousarray(looks[:, _CONFIDENCE]),
        removed=looks[:, _PRESENT] == 0,
    )


@njit(cache=True, nogil=True)
def _delta_kernel(rows, slab_of_row, pools, surface, shown, thresholds, now, index, looks):
    """Compare the blocks' voxels with the state returned last; list the changed ones.

    `now` is working memory for the look of one.
    """
    color_step, probability_step, confidence_step = thresholds
    m = 0
    for row in rows:
        slab = slab_of_row[row]
        c, block = pools.coord[row], pools.slab[row]
        for k in range(512):
            old = shown.looks[slab, k]
            slot = pools.slot[block, k]
            if slot == 0 or pools.state[row, k] != OCCUPIED:
                if old[_PRESENT] == 0:
                    continue
                now[:] = 0
            else:
                for channel in range(3):
                    now[channel] = surface.color[slot, channel]
                now[_OOI] = pools.ooi[block, k]
                now[_PROXIMITY] = surface.proximity[slot]
                now[_LEVEL] = pools.level[block, k]
                now[_LABEL] = surface.label[slot]
                now[_CONFIDENCE] = surface.confidence[slot]
                now[_PRESENT] = 1
                same = old[_PRESENT] == 1 and now[_LEVEL] == old[_LEVEL]
                same = same and now[_LABEL] == old[_LABEL]
                for channel in range(3):
                    same = same and abs(now[channel] - old[channel]) <= color_step
                for column in (_OOI, _PROXIMITY):
                    same = same and abs(now[column] - old[column]) <= probability_step
                    same = same and (now[column] == 255) == (old[column] == 255)
                same = same and abs(now[_CONFIDENCE] - old[_CONFIDENCE]) <= confidence_step
                if same:
                    continue
            index[m, 0] = c[0] * 8 + (k >> 6)
            index[m, 1] = c[1] * 8 + ((k >> 3) & 7)
            index[m, 2] = c[2] * 8 + (k & 7)
            for column in range(_COLUMNS):
                old[column] = np.uint8(now[column])
                looks[m, column] = np.uint8(now[column])
            m += 1
    return m

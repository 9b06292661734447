"""Surface voxels of the view: blocks of 8 x 8 x 8 in columns of two by two blocks.

Updates change only the blocks that they fall in, and mark the columns to be redrawn.
"""

from collections import OrderedDict
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from app.view.colors import NOT_MAPPED

EDGE: Final = 8
VOLUME: Final = EDGE**3
COLUMN: Final = 2 * EDGE
"""Width of a column in voxels. Wider columns give fewer scene nodes; narrower ones less data per
change."""
ATTRIBUTES: Final = 8
"""Bytes per voxel: r, g, b, ooi, proximity, level, label, confidence."""
LABEL: Final = 6
"""Byte of the label."""

MAX_BLOCKS: Final = 65_536
"""About 300 MB; further voxels are counted in `VoxelStore.refused` and not stored."""
MAX_INDEX: Final = 1 << 20
"""Maximum distance of voxels from the origin; farther ones are refused."""

Column = tuple[int, int]
"""Index along x and y, in steps of `COLUMN` voxels."""

_BIAS: Final = 1 << 18
_SHIFT: Final = 19


@dataclass(frozen=True, slots=True, kw_only=True)
class VoxelUpdate:
    """Changed voxels, or all of them, one row per voxel."""

    indices: NDArray[np.int64]
    """(N, 3) voxel (i, j, k)."""
    attributes: NDArray[np.uint8]
    """(N, 8) red, green, blue, ooi, proximity, level, label, confidence."""
    surface: NDArray[np.bool_]
    """(N,) False where the voxel is no longer part of a surface."""

    def __post_init__(self) -> None:
        """Check the shapes."""
        n = len(self.surface)
        if self.indices.shape != (n, 3) or self.attributes.shape != (n, ATTRIBUTES):
            raise ValueError(
                f"{n} voxels need indices ({n}, 3) and attributes ({n}, {ATTRIBUTES}); got "
                f"{self.indices.shape} and {self.attributes.shape}"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class ColumnVoxels:
    """The surface voxels of one column."""

    local: NDArray[np.int16]
    """(M, 3) voxel index; i and j from the column's corner, k from the world's origin."""
    attributes: NDArray[np.uint8]
    """(M, 8) as in `VoxelUpdate`."""
    openness: NDArray[np.uint8]
    """(M,) openness for contact shadows: 0 under another voxel, else 255 minus the occlusion by
    neighbours."""


def _pack(blocks: NDArray[np.int64]) -> NDArray[np.int64]:
    b = blocks + _BIAS
    return (((b[:, 0] << _SHIFT) | b[:, 1]) << _SHIFT) | b[:, 2]


class VoxelStore:
    """Surface voxels in pools of blocks. Not thread-safe: one thread owns it."""

    def __init__(self) -> None:
        self._revision = 0
        self._touched: OrderedDict[Column, int] = OrderedDict()
        """Revision of each column's last change, the latest at the end."""
        self._empty()

    def _empty(self) -> None:
        self.count = 0
        self.refused = 0
        """Number of voxels not stored: too far away, or beyond `MAX_BLOCKS`."""
        self._rows: dict[int, int] = {}
        self._block = np.empty((0, 3), dtype=np.int64)
        self._columns: dict[Column, list[int]] = {}
        self._stacks: dict[tuple[int, int], list[int]] = {}
        """Rows of the blocks above each other, by block index along x and y."""
        self._present = np.zeros((0, VOLUME), dtype=np.bool_)
        self._attributes = np.zeros((0, VOLUME, ATTRIBUTES), dtype=np.uint8)

    @property
    def revision(self) -> int:
        """Number of the last change."""
        return self._revision

    @property
    def columns(self) -> tuple[Column, ...]:
        """Every column that held a voxel since the store was empty."""
        return tuple(self._columns)

    def apply(self, update: VoxelUpdate) -> None:
        """Store the rows of an update; of rows for the same voxel the last one applies."""
        indices, attributes, surface = update.indices, update.attributes, update.surface
        near = (np.abs(indices) < MAX_INDEX).all(axis=1)
        if not near.all():
            self.refused += int(np.count_nonzero(~near))
            indices, attributes, surface = indices[near], attributes[near], surface[near]
        if not len(indices):
            return
        blocks = indices >> 3
        keys, first, inverse = np.unique(_pack(blocks), return_index=True, return_inverse=True)
        rows = self._rows_of(keys, blocks[first])
        row = rows[inverse]
        if (rows < 0).any():
            kept = row >= 0
            self.refused += int(np.count_nonzero(~kept))
            row, indices, attributes, surface = (
                row[kept],
                indices[kept],
                attributes[kept],
                surface[kept],
            )
            first, rows = first[rows >= 0], rows[rows >= 0]
        i, j, k = (indices & 7).T
        cell = (i * EDGE + j) * EDGE + k
        before = np.count_nonzero(self._present[rows])
        self._present[row, cell] = surface
        self._attributes[row, cell] = attributes
        self.count += int(np.count_nonzero(self._present[rows]) - before)
        self._touch((x >> 1, y >> 1) for x, y in blocks[first, :2].tolist())

    def clear(self) -> None:
        """Remove every voxel and free its block; columns that had some are marked."""
        self.touch()
        self._empty()

    def touch(self) -> None:
        """Mark all columns: they are drawn differently from now on."""
        self._touch(self._columns)

    def changed_since(self, revision: int) -> tuple[tuple[Column, ...], int]:
        """Return the columns changed since a revision (0 for all), and the present revision.

        Each drawing keeps its own revision; the cost is proportional to the changes.
        """
        changed: list[Column] = []
        for column, touched in reversed(self._touched.items()):
            if touched <= revision:
                break
            changed.append(column)
        return tuple(changed), self._revision

    def column(self, column: Column, below: int | None = None) -> ColumnVoxels:
        """Return the voxels of one column.

        Args:
            column: Index of the column; empty if it never had a voxel.
            below: Voxels from this layer upwards are excluded, and cast no shadow.
        """
        local, attributes = self.surface(column, below)
        openness = self._openness(column, local, below)
        return ColumnVoxels(local=local, attributes=attributes, openness=openness)

    def surface(
        self, column: Column, below: int | None = None
    ) -> tuple[NDArray[np.int16], NDArray[np.uint8]]:
        """Return indices and attributes of `column`, without the openness, which takes longest."""
        rows = np.array(self._columns.get(column, ()), dtype=np.int64)
        which, cell = np.nonzero(self._present[rows])
        local = np.empty((len(cell), 3), dtype=np.int16)
        block = self._block[rows][which]
        local[:, 0] = (cell >> 6) + (block[:, 0] & 1) * EDGE
        local[:, 1] = ((cell >> 3) & 7) + (block[:, 1] & 1) * EDGE
        local[:, 2] = (cell & 7) + block[:, 2] * EDGE
        if below is not None:
            kept = local[:, 2] < below
            which, cell, local = which[kept], cell[kept], local[kept]
        return local, self._attributes[rows[which], cell]

    def all_voxels(self) -> tuple[NDArray[np.int64], NDArray[np.uint8]]:
        """Return (N, 3) indices in a fixed order and their (N, 8) attributes."""
        indices, attributes = [], []
        for column in sorted(self._columns):
            local, held = self.surface(column)
            corner = np.array([column[0] * COLUMN, column[1] * COLUMN, 0], dtype=np.int64)
            order = np.lexsort(local.T)
            indices.append((local + corner)[order])
            attributes.append(held[order])
        if not indices:
            return np.empty((0, 3), np.int64), np.empty((0, ATTRIBUTES), np.uint8)
        return np.concatenate(indices), np.concatenate(attributes)

    def holds(self, indices: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Return (N,) whether there is a surface voxel at each of (N, 3) indices."""
        keys, inverse = np.unique(_pack(indices >> 3), return_inverse=True)
        rows = np.array([self._rows.get(key, -1) for key in keys.tolist()], np.int64)[inverse]
        i, j, k = (indices & 7).T
        held = np.zeros(len(indices), np.bool_)
        known = rows >= 0
        held[known] = self._present[rows[known], ((i * EDGE + j) * EDGE + k)[known]]
        return held

    def label_counts(self, least_confidence: int) -> NDArray[np.int64]:
        """Return (256,) the number of voxels of each label.

        Args:
            least_confidence: Voxels that are less sure of their label, in units of 1/254, do not
                count.
        """
        sure = self._present & (self._attributes[..., 7] >= least_confidence)
        return np.bincount(self._attributes[..., 6][sure], minlength=256)

    def at_least(self, ooi: int) -> tuple[NDArray[np.int64], NDArray[np.uint8]]:
        """Return (N, 3) indices and (N, 8) attributes of voxels above a probability of the object.

        Args:
            ooi: Least p(v in O) as stored; voxels without one are excluded.
        """
        stored = self._attributes[..., 3]
        row, cell = np.nonzero(self._present & (stored >= ooi) & (stored < NOT_MAPPED))
        within = np.stack([cell >> 6, (cell >> 3) & 7, cell & 7], axis=1)
        return self._block[row] * EDGE + within, self._attributes[row, cell]

    def _touch(self, columns: Iterable[Column]) -> None:
        self._revision += 1
        for column in columns:
            self._touched[column] = self._revision
            self._touched.move_to_end(column)

    def _rows_of(self, keys: NDArray[np.int64], blocks: NDArray[np.int64]) -> NDArray[np.int64]:
        rows = np.empty(len(keys), dtype=np.int64)
        for n, key in enumerate(keys.tolist()):
            row = self._rows.get(key)
            rows[n] = self._new_row(key, blocks[n]) if row is None else row
        return rows

    def _new_row(self, key: int, block: NDArray[np.int64]) -> int:
        row = len(self._rows)
        if row >= MAX_BLOCKS:
            return -1
        if row >= len(self._present):
            self._grow(max(64, 2 * row))
        x, y, _ = block.tolist()
        self._rows[key] = row
        self._block[row] = block
        self._columns.setdefault((x >> 1, y >> 1), []).append(row)
        self._stacks.setdefault((x, y), []).append(row)
        return row

    def _grow(self, size: int) -> None:
        old = len(self._present)
        for name in ("_present", "_attributes", "_block"):
            pool = getattr(self, name)
            larger = np.zeros((size, *pool.shape[1:]), dtype=pool.dtype)
            larger[:old] = pool
            setattr(self, name, larger)

    def _openness(
        self, column: Column, local: NDArray[np.int16], below: int | None
    ) -> NDArray[np.uint8]:
        """Return the openness of voxels to above, from the two layers above them."""
        if not len(local):
            return np.empty(0, dtype=np.uint8)
        low = int(local[:, 2].min())
        span = int(local[:, 2].max()) - low + 3
        if span > 64 * EDGE:
            return np.full(len(local), 255, dtype=np.uint8)
        solid = np.zeros((COLUMN + 2, COLUMN + 2, span), dtype=np.uint8)
        for x in range(-1, 3):
            for y in range(-1, 3):
                self._fill(solid, (2 * column[0] + x, 2 * column[1] + y), x, y, low)
        if below is not None:
            solid[:, :, max(below - low, 0) :] = 0
        rise = solid[:, :, 1:-1] * 2 + solid[:, :, 2:]
        rows = rise[:-2] + rise[1:-1] + rise[2:]
        around = rows[:, :-2] + rows[:, 1:-1] + rows[:, 2:]
        i, j, k = local[:, 0], local[:, 1], local[:, 2] - low
        open_sky = 255 - np.minimum(around[i, j, k].astype(np.int32) * 9, 200)
        return np.where(solid[i + 1, j + 1, k + 1] > 0, 0, open_sky).astype(np.uint8)

    def _fill(
        self, solid: NDArray[np.uint8], stack: tuple[int, int], x: int, y: int, low: int
    ) -> None:
        """Copy the voxels of the blocks at (x, y) that are in a column or border on it."""
        to_x, from_x = _PART[x]
        to_y, from_y = _PART[y]
        for row in self._stacks.get(stack, ()):
            base = int(self._block[row, 2]) * EDGE - low
            start, stop = max(base, 0), min(base + EDGE, solid.shape[2])
            if start >= stop:
                continue
            cube = self._present[row].reshape(EDGE, EDGE, EDGE)
            solid[to_x, to_y, start:stop] = cube[from_x, from_y, start - base : stop - base]


_PART: Final = {
    -1: (slice(0, 1), slice(EDGE - 1, EDGE)),
    0: (slice(1, EDGE + 1), slice(0, EDGE)),
    1: (slice(EDGE + 1, COLUMN + 1), slice(0, EDGE)),
    2: (slice(COLUMN + 1, COLUMN + 2), slice(0, 1)),
}
"""For a block before, in, in, and after a column: target and source slices of its voxels."""

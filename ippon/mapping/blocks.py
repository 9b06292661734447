"""Blocks of voxels: pools with one row per block, the directory of rows, and the memory limit.

Every pool is reserved at the map's bound when the map is made. The operating system backs a page
of it when the page is first written, so memory follows what was observed, nothing is ever copied
when the map grows, and views that were handed out stay valid.
"""

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ippon.compiling import njit
from ippon.mapping.arrays import BLOCK_EDGE, BLOCK_VOLUME, FREE, INNER, NOT_MAPPED

GROWTH_MARGIN: Final = 8
"""Blocks by which the directory grows beyond what is needed, so that it grows rarely."""

# Entries of `Pools.tally`.
N_ROWS: Final = 0
N_FREE: Final = 1
N_LAYER_FREE: Final = 2
N_SLABS: Final = 3
N_FREE_SLABS: Final = 4
BYTES_PER_VOXEL: Final = 14
"""Bytes of one voxel in all block pools and in a slab, without surface voxels."""
NO_SLAB: Final = 0
"""Slab that all blocks without surface share: no slot, nothing mapped."""


class Pools(NamedTuple):
    """Arrays with one row per block; `tally` counts the rows in use.

    `slot`, `ooi` and `level` describe surface voxels only. Their rows are slabs: one for each block
    with surface, which is about every second block.
    """

    tsdf: NDArray[np.int16]
    """(B, 512) signed distance to the surface in units of truncation / 32767, positive outside."""
    weight: NDArray[np.uint8]
    """(B, 512) observations behind `tsdf`, up to a cap; 0 for none."""
    evidence: NDArray[np.int8]
    """(B, 512) integer evidence, positive for occupied, negative for free."""
    state: NDArray[np.uint8]
    """(B, 512) see `MapArrays.state`."""
    squared_distance: NDArray[np.uint16]
    """(B, 512) see `MapArrays.squared_distance`."""
    slab: NDArray[np.int32]
    """(B,) row of `slot`, `ooi` and `level`, `NO_SLAB` for none."""
    slot: NDArray[np.int32]
    """(S, 512) row of the surface pools, 0 for none."""
    ooi: NDArray[np.uint8]
    """(S, 512) see `MapArrays.ooi`."""
    level: NDArray[np.uint8]
    """(S, 512) see `MapArrays.level`."""
    coord: NDArray[np.int64]
    """(B, 3) block index."""
    revision: NDArray[np.int64]
    """(B,) map revision of the last change of state, ooi or level."""
    appearance: NDArray[np.int64]
    """(B,) map revision at which a surface voxel last changed its colour or labels."""
    seen: NDArray[np.int64]
    """(B,) map revision of the last observation."""
    settled: NDArray[np.uint8]
    """(B,) 1 when the evidence for free of every voxel is at its limit."""
    used: NDArray[np.uint8]
    """(B,) 1 while the row belongs to a block."""
    best_ooi: NDArray[np.uint8]
    """(B,) highest `ooi` among the block's voxels, 0 for none."""
    occupied: NDArray[np.int32]
    """(B,) occupied voxels of the block."""
    layer_free: NDArray[np.int32]
    """(B,) free voxels of the block in the map's body layer."""
    free: NDArray[np.int32]
    """(B,) stack of released rows."""
    free_slabs: NDArray[np.int32]
    """(S,) stack of released slabs."""
    tally: NDArray[np.int64]
    """(5,) rows ever used, length of `free`, sum of `layer_free`, slabs ever used (`NO_SLAB`
    included), length of `free_slabs`."""


def make_pools(max_blocks: int) -> Pools:
    """Reserve pools for `max_blocks` blocks without touching their memory."""
    shape = (max_blocks, BLOCK_VOLUME)
    slabs = (max_blocks + 1, BLOCK_VOLUME)
    pools = Pools(
        tsdf=np.zeros(shape, np.int16),
        weight=np.zeros(shape, np.uint8),
        evidence=np.zeros(shape, np.int8),
        state=np.zeros(shape, np.uint8),
        squared_distance=np.zeros(shape, np.uint16),
        slab=np.zeros(max_blocks, np.int32),
        slot=np.zeros(slabs, np.int32),
        ooi=np.zeros(slabs, np.uint8),
        level=np.zeros(slabs, np.uint8),
        coord=np.zeros((max_blocks, 3), np.int64),
        revision=np.zeros(max_blocks, np.int64),
        appearance=np.zeros(max_blocks, np.int64),
        seen=np.zeros(max_blocks, np.int64),
        settled=np.zeros(max_blocks, np.uint8),
        used=np.zeros(max_blocks, np.uint8),
        best_ooi=np.zeros(max_blocks, np.uint8),
        occupied=np.zeros(max_blocks, np.int32),
        layer_free=np.zeros(max_blocks, np.int32),
        free=np.zeros(max_blocks, np.int32),
        free_slabs=np.zeros(max_blocks + 1, np.int32),
        tally=np.zeros(5, np.int64),
    )
    pools.ooi[NO_SLAB] = pools.level[NO_SLAB] = NOT_MAPPED
    pools.tally[N_SLABS] = NO_SLAB + 1
    return pools


def count_layer(pools: Pools, layer: int) -> None:
    """Count the free voxels of a layer along z anew, in place of those of another layer."""
    n = int(pools.tally[N_ROWS])
    here = (pools.used[:n] == 1) & (pools.coord[:n, 2] == layer // BLOCK_EDGE)
    rows = np.flatnonzero(here)
    states = pools.state[rows].reshape(-1, BLOCK_EDGE**2, BLOCK_EDGE)[:, :, layer % BLOCK_EDGE]
    pools.layer_free[:n] = 0
    pools.layer_free[rows] = np.count_nonzero(states == FREE, axis=1)
    pools.tally[N_LAYER_FREE] = int(pools.layer_free[:n].sum())


class BlockDirectory:
    """A dense box of block indices that grows in any direction."""

    def __init__(self, max_cells: int) -> None:
        self.origin: NDArray[np.int64] = np.zeros(3, np.int64)
        self.rows: NDArray[np.int32] = np.full((1, 1, 1), -1, np.int32)
        self._max_cells = max_cells
        self._empty = True

    def part(
        self, low: NDArray[np.int64], high: NDArray[np.int64]
    ) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
        """Return lower corner and rows of the part of [low, high) that the directory covers."""
        low = np.maximum(low, self.origin)
        first, end = low - self.origin, np.maximum(high - self.origin, 0)
        return low, self.rows[tuple(slice(a, b) for a, b in zip(first, end, strict=True))]

    def reach(
        self, low: NDArray[np.int64], high: NDArray[np.int64]
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return the box [low, high) that encloses this directory and a given box of blocks."""
        if self._empty:
            return low, high
        return np.minimum(low, self.origin), np.maximum(high, self.origin + self.rows.shape)

    def _grown(
        self, low: NDArray[np.int64], high: NDArray[np.int64]
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return the corners that cover the box [low, high); a side that does already stays."""
        new_low, new_high = self.reach(low, high)
        if self._empty:
            return new_low - GROWTH_MARGIN, new_high + GROWTH_MARGIN
        end = self.origin + self.rows.shape
        return (
            np.where(new_low < self.origin, new_low - GROWTH_MARGIN, new_low),
            np.where(new_high > end, new_high + GROWTH_MARGIN, new_high),
        )

    def fits(self, low: NDArray[np.int64], high: NDArray[np.int64]) -> bool:
        """Tell whether the directory could grow to hold the blocks of the box [low, high)."""
        new_low, new_high = self._grown(low, high)
        return float(np.prod((new_high - new_low).astype(np.float64))) <= self._max_cells

    def cover(self, low: NDArray[np.int64], high: NDArray[np.int64]) -> None:
        """Grow until the blocks of the box [low, high) lie inside."""
        new_low, new_high = self._grown(low, high)
        if not self._empty and (new_high - new_low == self.rows.shape).all():
            return
        rows = np.full(tuple(int(n) for n in new_high - new_low), -1, np.int32)
        if not self._empty:
            x, y, z = (int(n) for n in self.origin - new_low)
            dx, dy, dz = self.rows.shape
            rows[x : x + dx, y : y + dy, z : z + dz] = self.rows
        self.origin, self.rows, self._empty = new_low.astype(np.int64), rows, False


@njit(cache=True, nogil=True)
def allocate_block(pools, x, y, z, farthest, revision):
    """Return a cleared row for block (x, y, z); -1 when the memory limit is reached."""
    if pools.tally[N_FREE] > 0:
        pools.tally[N_FREE] -= 1
        row = pools.free[pools.tally[N_FREE]]
        pools.tsdf[row, :] = 0
        pools.weight[row, :] = 0
        pools.evidence[row, :] = 0
        pools.state[row, :] = 0
    elif pools.tally[N_ROWS] < pools.state.shape[0]:
        row = pools.tally[N_ROWS]
        pools.tally[N_ROWS] += 1
    else:
        return -1
    pools.squared_distance[row, :] = farthest
    pools.slab[row] = NO_SLAB
    pools.coord[row, 0] = x
    pools.coord[row, 1] = y
    pools.coord[row, 2] = z
    pools.revision[row] = revision
    pools.appearance[row] = revision
    pools.seen[row] = revision
    pools.settled[row] = 0
    pools.used[row] = 1
    pools.best_ooi[row] = 0
    pools.occupied[row] = 0
    pools.layer_free[row] = 0
    return row


@INNER
def allocate_slab(pools, row):
    """Return the slab of a block; allocate a cleared one if the block has none."""
    slab = pools.slab[row]
    if slab != NO_SLAB:
        return slab
    if pools.tally[N_FREE_SLABS] > 0:
        pools.tally[N_FREE_SLABS] -= 1
        slab = pools.free_slabs[pools.tally[N_FREE_SLABS]]
    else:
        slab = np.int32(pools.tally[N_SLABS])
        pools.tally[N_SLABS] += 1
    pools.slot[slab, :] = 0
    pools.ooi[slab, :] = NOT_MAPPED
    pools.level[slab, :] = NOT_MAPPED
    pools.slab[row] = slab
    return slab


@INNER
def release_slab(pools, row):
    """Release the slab of a block without surface."""
    if pools.slab[row] != NO_SLAB:
        pools.free_slabs[pools.tally[N_FREE_SLABS]] = pools.slab[row]
        pools.tally[N_FREE_SLABS] += 1
        pools.slab[row] = NO_SLAB

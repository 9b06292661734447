"""Blocks that the map drops: blocks without observations, and old ones at the memory limit."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from ippon.mapping.blocks import N_FREE, N_FREE_SLABS, N_LAYER_FREE, N_ROWS, NO_SLAB, Pools
from ippon.mapping.objects.surface_voxels import N_FREE as N_FREE_SURFACE
from ippon.mapping.objects.surface_voxels import SurfaceVoxels

DROPPED_SHARE: Final = 8
"""One in this many blocks is dropped at a time; larger drops fewer blocks more often."""


def oldest_blocks(
    pools: Pools, position: NDArray[np.float64], reach: float, revision: int
) -> NDArray[np.int64]:
    """Return rows to drop: the longest unseen first, those near a position last.

    Args:
        pools: The map's pools.
        position: (3,) in units of a block's edge.
        reach: Radius around `position` whose blocks are dropped last, same unit.
        revision: Blocks seen at this revision are never dropped.
    """
    n = int(pools.tally[N_ROWS])
    rows = np.flatnonzero((pools.used[:n] == 1) & (pools.seen[:n] < revision))
    near = np.linalg.norm(pools.coord[rows] + 0.5 - position, axis=1) < reach
    order = np.lexsort((rows, pools.seen[rows], near))
    return rows[order[: max(1, n // DROPPED_SHARE)]].astype(np.int64)


def drop_blocks(
    rows: NDArray[np.integer],
    pools: Pools,
    surface: SurfaceVoxels,
    directory: NDArray[np.int32],
    origin: NDArray[np.int64],
) -> None:
    """Remove blocks from pools, surface voxels and directory.

    Args:
        rows: (n,) rows in use, each once.
        pools: The map's pools, updated.
        surface: Surface rows; those of the blocks are given back.
        directory: (DX, DY, DZ) rows by block, updated.
        origin: (3,) block index of `directory[0, 0, 0]`.
    """
    if len(rows) == 0:
        return
    _give_surface_back(rows, pools, surface)
    at = pools.coord[rows] - origin
    directory[at[:, 0], at[:, 1], at[:, 2]] = -1
    pools.tally[N_LAYER_FREE] -= int(pools.layer_free[rows].sum())
    for pool in (pools.layer_free, pools.best_ooi, pools.occupied, pools.used, pools.revision):
        pool[rows] = 0
    _push(pools.free, pools.tally, N_FREE, rows)


def _give_surface_back(rows: NDArray[np.integer], pools: Pools, surface: SurfaceVoxels) -> None:
    """Release the slabs of blocks and the surface voxels in them."""
    rows = rows[pools.slab[rows] != NO_SLAB]
    slabs = pools.slab[rows]
    slots = pools.slot[slabs]
    slots = slots[slots != 0]
    surface.voxel[slots] = -1
    _push(surface.free, surface.tally, N_FREE_SURFACE, slots)
    _push(pools.free_slabs, pools.tally, N_FREE_SLABS, slabs)
    pools.slab[rows] = NO_SLAB


def _push(
    stack: NDArray[np.int32],
    tally: NDArray[np.int64],
    counter: int,
    values: NDArray[np.integer],
) -> None:
    """Put values on a stack whose length is `tally[counter]`."""
    n = int(tally[counter])
    stack[n : n + len(values)] = values
    tally[counter] = n + len(values)

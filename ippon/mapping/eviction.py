"""Blocks that the map gives up: those that turned out unobserved, and those beyond its bound."""

from typing import Final

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ippon.mapping.blocks import N_ROWS, Pools, give_row_back
from ippon.mapping.surface_rows import give_surface_rows_back

DROPPED_SHARE: Final = 8
"""One in so many blocks is dropped at a time, so that it seldom happens."""


def oldest_blocks(
    pools: Pools, position: NDArray[np.float64], reach: float, revision: int
) -> NDArray[np.int64]:
    """Return rows to drop: longest unseen first, those within reach of a position last.

    Args:
        pools: The map's pools.
        position: (3,) in units of a block's edge.
        reach: Radius round `position` whose blocks are kept if others remain, same unit.
        revision: Blocks seen at this revision are never dropped.
    """
    n = int(pools.tally[N_ROWS])
    rows = np.flatnonzero((pools.used[:n] == 1) & (pools.seen[:n] < revision))
    near = np.linalg.norm(pools.coord[rows] + 0.5 - position, axis=1) < reach
    order = np.lexsort((rows, pools.seen[rows], near))
    return rows[order[: max(1, n // DROPPED_SHARE)]].astype(np.int64)


@njit(cache=True, nogil=True)
def drop_blocks_kernel(rows, pools, surface, directory, origin):
    """Forget blocks entirely."""
    for row in rows:
        c = pools.coord[row]
        directory[c[0] - origin[0], c[1] - origin[1], c[2] - origin[2]] = -1
        give_surface_rows_back(pools, surface, row)
        give_row_back(pools, row)


@njit(cache=True, nogil=True)
def drop_unobserved_kernel(rows, is_new, unobserved, n, pools, directory, origin):
    """Take back the rows of new blocks in which, after all, no voxel was observed."""
    for at in range(n):
        if is_new[at] == 1 and unobserved[at]:
            c = pools.coord[rows[at]]
            directory[c[0] - origin[0], c[1] - origin[1], c[2] - origin[2]] = -1
            give_row_back(pools, rows[at])

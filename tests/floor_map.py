"""A map of a flat floor with boxes and holes."""

from collections.abc import Sequence

import numpy as np

from ippon.mapping.arrays import BLOCK_VOLUME, FREE, NOT_MAPPED, OCCUPIED, UNKNOWN, MapArrays

Box = tuple[float, float, float, float, float, float]


Hole = tuple[float, float, float, float]


def floor_with(
    *boxes: Box, holes: Sequence[Hole] = (), unseen: Sequence[Hole] = (), voxel_size: float = 0.1
) -> MapArrays:
    """A free hall of 9.6 x 9.6 m round the origin with a floor at z = 0, and boxes and holes in it.

    The lowest layer of a hole, 0.8 m down, is its ground. Nothing is known below unseen floor.
    """
    v = voxel_size
    blocks = np.array([round(9.6 / (8 * v))] * 2 + [round(2.4 / (8 * v))])
    origin = np.array([-blocks[0] // 2, -blocks[1] // 2, -1])
    shape = tuple(8 * blocks)
    state = np.full(shape, FREE, dtype=np.uint8)
    state[:, :, :8] = OCCUPIED
    for value, places in ((FREE, holes), (UNKNOWN, unseen)):
        for x0, y0, x1, y1 in places:
            low, high = (np.round(np.array(xy) / v).astype(int) for xy in ((x0, y0), (x1, y1)))
            (i0, j0), (i1, j1) = low - origin[:2] * 8, high - origin[:2] * 8
            state[i0:i1, j0:j1, 1:8] = value
    for x0, y0, z0, x1, y1, z1 in boxes:
        low = np.round(np.array([x0, y0, z0]) / v).astype(int) - origin * 8
        high = np.round(np.array([x1, y1, z1]) / v).astype(int) - origin * 8
        state[low[0] : high[0], low[1] : high[1], low[2] : high[2]] = OCCUPIED
    a, b, c = blocks
    rows = state.reshape(a, 8, b, 8, c, 8).transpose(0, 2, 4, 1, 3, 5).reshape(-1, BLOCK_VOLUME)
    n = len(rows)
    return MapArrays(
        voxel_size=v,
        origin_block=origin.astype(np.int64),
        directory=np.arange(n, dtype=np.int32).reshape(a, b, c),
        state=np.ascontiguousarray(rows),
        slab=np.zeros(n, dtype=np.int32),
        ooi=np.full((1, BLOCK_VOLUME), NOT_MAPPED, dtype=np.uint8),
        level=np.full((1, BLOCK_VOLUME), NOT_MAPPED, dtype=np.uint8),
        squared_distance=np.full((n, BLOCK_VOLUME), 100, dtype=np.uint16),
        revision=np.ones(n, dtype=np.int64),
    )

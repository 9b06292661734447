"""Boxes of the instances in a rendered image."""

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ippon.compiling import njit
from ippon.geometry import Float64Array

_COLUMNS: Final = 5
"""Left, top, right, bottom, pixels."""


class InstanceBoxes(NamedTuple):
    """The instances in an image, one row each."""

    instance: NDArray[np.int64]
    """(K,) rows of `Scene.instances`, rising."""
    box_px: Float64Array
    """(K, 4) left, top, right, bottom of the visible part."""
    range_m: Float64Array
    """(K,) mean depth of the visible part."""


def instance_boxes(
    instance: NDArray[np.int32], depth: NDArray[np.float32], count: int
) -> InstanceBoxes:
    """Return the boxes of the visible instances.

    Args:
        instance: (H, W) rows of `Scene.instances`, -1 for none.
        depth: (H, W) metres, 0 where nothing is.
        count: Length of `Scene.instances`.
    """
    bounds = np.zeros((count, _COLUMNS), np.int64)
    depth_sum = np.zeros(count, np.float64)
    _bounds_kernel(instance, depth, bounds, depth_sum)
    seen = np.flatnonzero(bounds[:, 4] > 0)
    return InstanceBoxes(
        instance=seen,
        box_px=bounds[seen, :4].astype(np.float64),
        range_m=depth_sum[seen] / bounds[seen, 4],
    )


@njit(cache=True, nogil=True)
def _bounds_kernel(instance, depth, bounds, depth_sum):
    h, w = instance.shape
    for v in range(h):
        for u in range(w):
            k = instance[v, u]
            if k < 0 or not depth[v, u] > 0.0:
                continue
            row = bounds[k]
            if row[4] == 0:
                row[0], row[1], row[2], row[3] = u, v, u + 1, v + 1
            else:
                row[0] = min(row[0], u)
                row[2] = max(row[2], u + 1)
                row[3] = v + 1
            row[4] += 1
            depth_sum[k] += depth[v, u]

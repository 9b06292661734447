"""Voxels of a find that are recognised as the object, and those beside it.

The box of an instance covers some of the surroundings, so that the map spreads a find over voxels
of other objects. An image that shows only these does not show the object.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from ippon.geometry import Float64Array

_GRID_M: Final = 0.005
"""Grid on which centres of voxels are compared, finer than any voxel."""
_BITS: Final = 21
"""Bits of a coordinate on the grid: 5 km to either side."""


def voxel_keys(centres_world: Float64Array) -> NDArray[np.int64]:
    """Return a number (M,) for each of (M, 3) centres of voxels, equal for equal voxels."""
    cell = np.rint(centres_world / _GRID_M).astype(np.int64) + (1 << (_BITS - 1))
    return (cell[:, 0] << (2 * _BITS)) | (cell[:, 1] << _BITS) | cell[:, 2]


class RecognisedVoxels:
    """Counts, for each voxel of a find, the images that recognise the find there and elsewhere."""

    def __init__(self) -> None:
        self._keys = np.zeros(0, np.int64)
        self._balance = np.zeros(0, np.int64)
        """Images that recognise the find at the voxel, less those that show the voxel and recognise
        the find elsewhere."""

    def add(self, keys: NDArray[np.int64], recognised: NDArray[np.bool_]) -> None:
        """Add an image that recognises the find.

        Args:
            keys: (M,) distinct `voxel_keys` of the find's voxels that the image shows.
            recognised: (M,) whether it recognises the object there.
        """
        known = np.union1d(self._keys, keys)
        balance = np.zeros(known.size, np.int64)
        balance[np.searchsorted(known, self._keys)] = self._balance
        balance[np.searchsorted(known, keys)] += np.where(recognised, 1, -1)
        self._keys, self._balance = known, balance

    def are_beside(self, keys: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Return (M,) whether most images that recognise the find and show a voxel exclude it.

        Args:
            keys: (M,) `voxel_keys`. A voxel without such an image is part of the find.
        """
        beside = self._keys[self._balance < 0]
        return np.isin(keys, beside)

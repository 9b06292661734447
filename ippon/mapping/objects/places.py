"""The places that a voxel was seen from, and what the images from the present place say together.

Images from one place err alike, so they are one witness: their likelihoods are averaged (a linear
opinion pool; Stone, Ann. Math. Stat. 1961), which no number of images can raise above the best of
them. Witnesses at different places are taken to be independent: their likelihoods are multiplied,
as the paper's filter multiplies those of all images. A place is a direction of 15 degrees, near
or far, seen from the voxel; one that was left teaches no more.
"""

from typing import Final, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ippon.mapping.arrays import INNER
from ippon.mapping.objects.surface_rows import SurfaceRows

MAX_WITNESSES: Final = 32768
"""Voxels whose present place is open at a time; that of the one opened first is closed for more."""
_FAR_M2: Final = 4.0
"""Square of the distance, 2 m, between near and far places."""
_STEEP: Final = 3.0
"""Square of the slope, 60 degrees, from which a direction has no azimuth."""
_TAN_15: Final = 0.2679492
_TAN_30: Final = 0.5773503
TAN_MARGIN: Final = np.float32(0.0874887)
"""Tangent of 5 degrees."""
_FIRST_STEEP: Final = 48
"""Places 0 to 47 are azimuths near and far; up to 51 they are steep ones."""


class Witnesses(NamedTuple):
    """What the images from a voxel's present place said, one row a voxel; row 0 is never used."""

    sums: NDArray[np.float32]
    """(W, M) sum of the images' likelihoods of each label."""
    base: NDArray[np.uint8]
    """(W, M) `SurfaceRows.energy` before this place."""
    base_log_odds: NDArray[np.float32]
    """(W,) `SurfaceRows.log_odds` before this place."""
    ooi_sum: NDArray[np.float32]
    """(W,) sum of the images' likelihoods of the object of interest."""
    ooi_images: NDArray[np.int32]
    """(W,) images in `ooi_sum`, which are taken from nearer than those in `sums`."""
    images: NDArray[np.int32]
    """(W,) images in `sums`."""
    place: NDArray[np.uint8]
    """(W,) the place."""
    owner: NDArray[np.int32]
    """(W,) row of the surface, 0 for none."""
    tally: NDArray[np.int64]
    """(1,) rows opened ever."""


def make_witnesses(rows: int, row_length: int) -> Witnesses:
    """Reserve rows for `rows` voxels.

    Args:
        rows: Open at a time.
        row_length: M of `SurfaceRows.energy`.
    """
    return Witnesses(
        sums=np.zeros((rows + 1, row_length), np.float32),
        base=np.zeros((rows + 1, row_length), np.uint8),
        base_log_odds=np.zeros(rows + 1, np.float32),
        ooi_sum=np.zeros(rows + 1, np.float32),
        ooi_images=np.zeros(rows + 1, np.int32),
        images=np.zeros(rows + 1, np.int32),
        place=np.zeros(rows + 1, np.uint8),
        owner=np.zeros(rows + 1, np.int32),
        tally=np.zeros(1, np.int64),
    )


def forget_places(surface: SurfaceRows, slots: slice | NDArray[np.integer]) -> None:
    """Let every place teach some voxels again, beginning with the present one."""
    surface.witness[slots] = 0
    surface.places[slots] = 0


def close_places(surface: SurfaceRows, slots: slice | NDArray[np.integer]) -> None:
    """Let what was seen from the present places of some voxels stand; they teach no more."""
    surface.witness[slots] = 0


@njit(cache=True, nogil=True, inline="always")
def place_of(x, y, z):
    """Return the place, 0 to 51, of a camera at (x, y, z) metres from a voxel."""
    flat = x * x + y * y
    is_far = np.int64(flat + z * z > _FAR_M2)
    if z * z > _STEEP * flat:
        return _FIRST_STEEP + 2 * np.int64(z > 0.0) + is_far
    ax, ay = abs(x), abs(y)
    low, high = min(ax, ay), max(ax, ay)
    third = np.int64(low > _TAN_15 * high) + np.int64(low > _TAN_30 * high)
    # Sectors count from the x axis, in the half of the quadrant beyond 45 degrees backwards.
    sector = 5 - third if ay > ax else third
    quadrant = 2 * np.int64(y < 0.0) + np.int64(x < 0.0)
    return 2 * (6 * quadrant + sector) + is_far


@INNER
def open_place(surface, witnesses, slot, place, left, right, labels):
    """Return the witness row of a voxel for an image from `place`; 0 where it teaches no more.

    `left` and `right` are the places `TAN_MARGIN` to either side: only beyond that is an open
    place left, so that a camera that shakes at its border does not close it.
    `surface` and `witnesses` are not passed on, so that the references to their arrays are counted
    once (see `describe`).
    """
    row = surface.witness[slot]
    if row != 0:
        here = witnesses.place[row]
        if here == place or here == left or here == right:  # noqa: PLR1714, SIM109 - compiled; a tuple costs 0.1 of the update
            return row
    bit = np.uint64(1) << np.uint64(place)
    if surface.places[slot] & bit != np.uint64(0):
        return np.int32(0)
    surface.places[slot] |= bit
    rows = witnesses.owner.shape[0] - 1
    row = np.int32(1 + witnesses.tally[0] % rows)
    witnesses.tally[0] += 1
    before = witnesses.owner[row]
    if surface.witness[before] == row:
        surface.witness[before] = 0
    witnesses.owner[row] = slot
    surface.witness[slot] = row
    witnesses.place[row] = place
    witnesses.images[row] = witnesses.ooi_images[row] = 0
    witnesses.ooi_sum[row] = 0.0
    witnesses.base_log_odds[row] = surface.log_odds[slot]
    for j in range(labels):
        witnesses.base[row, j] = surface.energy[slot, j]
        witnesses.sums[row, j] = 0.0
    return row

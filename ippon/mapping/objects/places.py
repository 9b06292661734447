"""Places from which a voxel was seen, and the accumulated images of the current one.

Errors of images from one place are correlated. Their likelihoods are therefore averaged (a linear
opinion pool; Stone, Ann. Math. Stat. 1961), which no number of images raises above the largest of
them. Errors at different places are taken to be independent: their likelihoods are multiplied, as
the paper's filter multiplies those of all images. A place is a direction of 15 degrees from the
voxel, near or far. A place that the camera has left is closed for what an image from it has counted
for, the labels or the object of interest (of several, any): later images from it are not used for
that.

What closes for the common labels stays closed while the map is in use, because they keep their
evidence; the labels that were added last have places of their own. For another object of interest
every place opens again, also for one that is a common label and starts from that label: near and
far are two places only, and an object is detected from 2 m that was missed from 5 m.
"""

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ippon.compiling import njit
from ippon.mapping.arrays import INNER
from ippon.mapping.objects.surface_voxels import N_USED, NO_LABEL, SurfaceVoxels

MAX_OPEN_PLACES: Final = 32768
"""Voxels with an open place at a time; at the limit the oldest row is given to another voxel."""
N_OPENED: Final = 0
N_ROWS: Final = 1
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


class PlaceAccumulators(NamedTuple):
    """Likelihood sums over the images from each voxel's current place; row 0 is unused."""

    sums: NDArray[np.float32]
    """(W, M) sum of the images' likelihoods of each label."""
    base: NDArray[np.uint8]
    """(W, M) `SurfaceVoxels.energy` before this place."""
    base_log_odds: NDArray[np.float32]
    """(W,) `SurfaceVoxels.log_odds` before this place."""
    ooi_sum: NDArray[np.float32]
    """(W,) sum of the images' likelihoods of the object of interest."""
    ooi_images: NDArray[np.int32]
    """(W,) images in `ooi_sum`."""
    images: NDArray[np.int32]
    """(W,) images in `sums`."""
    place: NDArray[np.uint8]
    """(W,) the place."""
    first_label: NDArray[np.uint8]
    """(W,) it counts for the labels from this one on."""
    for_ooi: NDArray[np.bool_]
    """(W,) whether it counts for the OOI."""
    owner: NDArray[np.int32]
    """(W,) surface voxel, 0 for none."""
    tally: NDArray[np.int64]
    """(2,) places opened so far; rows given to voxels so far, which reuse them place after place,
    so that no more memory is backed than there are voxels."""


def make_place_accumulators(rows: int, row_length: int) -> PlaceAccumulators:
    """Reserve accumulators for `rows` voxels.

    Args:
        rows: Places that are open at a time.
        row_length: M of `SurfaceVoxels.energy`.
    """
    return PlaceAccumulators(
        sums=np.zeros((rows + 1, row_length), np.float32),
        base=np.zeros((rows + 1, row_length), np.uint8),
        base_log_odds=np.zeros(rows + 1, np.float32),
        ooi_sum=np.zeros(rows + 1, np.float32),
        ooi_images=np.zeros(rows + 1, np.int32),
        images=np.zeros(rows + 1, np.int32),
        place=np.zeros(rows + 1, np.uint8),
        first_label=np.full(rows + 1, NO_LABEL, np.uint8),
        for_ooi=np.zeros(rows + 1, np.bool_),
        owner=np.zeros(rows + 1, np.int32),
        tally=np.zeros(2, np.int64),
    )


def reopen_for_added_labels(surface: SurfaceVoxels) -> None:
    """Let every place count again for labels that are added now; current places are closed."""
    used = slice(0, int(surface.tally[N_USED]))
    surface.accumulator[used] = 0
    surface.added_places[used] = 0


def reopen_for_ooi(
    surface: SurfaceVoxels,
    accumulators: PlaceAccumulators,
    slots: NDArray[np.integer],
    places: NDArray[np.uint64],
) -> tuple[NDArray[np.int32], NDArray[np.intp]]:
    """Let places count again for the object of interest in some voxels; current ones stay open.

    Args:
        surface: Surface voxels, updated.
        accumulators: Images of the current places, updated.
        slots: (M,) the voxels.
        places: (M,) places that stay closed; 0 for none.

    Returns:
        See `places_since`.
    """
    rows, at = places_since(surface, accumulators, slots, places)
    surface.ooi_places[slots] = places
    accumulators.for_ooi[rows] = True
    return rows, at


def close_counted(
    surface: SurfaceVoxels,
    accumulators: PlaceAccumulators,
    slots: NDArray[np.integer],
    rows: NDArray[np.int32],
    images: NDArray[np.int32],
) -> None:
    """Close current places of which images count for the object of interest already.

    Args:
        surface: Surface voxels, updated.
        accumulators: Images of the current places.
        slots: (M,) the voxels.
        rows: (M,) their accumulators.
        images: (M,) images that count.
    """
    counted = images > 0
    surface.ooi_places[slots[counted]] |= _bits(accumulators, rows[counted])


def places_since(
    surface: SurfaceVoxels,
    accumulators: PlaceAccumulators,
    slots: NDArray[np.integer],
    places: NDArray[np.uint64],
) -> tuple[NDArray[np.int32], NDArray[np.intp]]:
    """Return the current places of some voxels, those apart that had been seen before.

    Args:
        surface: Surface voxels.
        accumulators: Images of the current places.
        slots: (M,) the voxels.
        places: (M,) places that each had been seen from.

    Returns:
        Accumulators, and the index of the voxel of each.
    """
    rows, at = current_places(surface, slots)
    new = places[at] & _bits(accumulators, rows) == 0
    return rows[new], at[new]


def current_places(
    surface: SurfaceVoxels, slots: NDArray[np.integer]
) -> tuple[NDArray[np.int32], NDArray[np.intp]]:
    """Return the accumulators of some voxels, and the index of the voxel of each."""
    rows = surface.accumulator[slots]
    at = np.flatnonzero(rows)
    return rows[at], at


def _bits(accumulators: PlaceAccumulators, rows: NDArray[np.integer]) -> NDArray[np.uint64]:
    bits: NDArray[np.uint64] = np.uint64(1) << accumulators.place[rows].astype(np.uint64)
    return bits


def begin_in_places(
    accumulators: PlaceAccumulators,
    rows: NDArray[np.int32],
    log_odds: NDArray[np.float32],
    label: int,
) -> tuple[NDArray[np.float32], NDArray[np.int32], NDArray[np.float32]]:
    """Return what current places contain for an object of interest that has just been set.

    Args:
        accumulators: Images of the current places.
        rows: (M,) the places.
        log_odds: (M,) of the object, with the images of the places if it is a common label.
        label: Common label that is the object itself; negative if it is none.

    Returns:
        (M,) sum of the images' likelihoods; (M,) number of images; (M,) log-odds without them.
    """
    images = accumulators.images[rows] * (label >= 0)
    sums = np.where(images > 0, accumulators.sums[rows, label], np.float32(0.0))
    mean = np.divide(sums, images, out=np.ones_like(sums), where=images > 0)
    return sums, images, log_odds - np.log(mean)


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
def open_accumulator(
    surface, accumulators, slot, place, left, right, settled, labels, common, ooi
):  # fmt: skip
    """Return the accumulator of a voxel for an image from `place`; 0 if it is closed for all.

    `left` and `right` are the places `TAN_MARGIN` to either side. An open place is left only beyond
    them, so that a camera that shakes at its border does not close it. Labels from `settled` on are
    those of `SurfaceVoxels.added_places`. `common` and `ooi` tell whether the image is for the
    labels and for the OOI: whoever uses it closes the place for what it was used for.
    """
    row = surface.accumulator[slot]
    if row != 0:
        here = accumulators.place[row]
        if here == place or here == left or here == right:  # noqa: PLR1714, SIM109 - compiled; a tuple costs 0.1 of the update
            return row
    bit = np.uint64(1) << np.uint64(place)
    first_label = labels
    if surface.label_places[slot] & bit == np.uint64(0):
        first_label = 0
    elif surface.added_places[slot] & bit == np.uint64(0):
        first_label = settled
    for_ooi = surface.ooi_places[slot] & bit == np.uint64(0)
    if not (common and first_label < labels) and not (ooi and for_ooi):
        return np.int32(0)
    if row == 0:
        rows = accumulators.owner.shape[0] - 1
        row = np.int32(1 + accumulators.tally[N_ROWS] % rows)
        accumulators.tally[N_ROWS] += 1
        before = accumulators.owner[row]
        if surface.accumulator[before] == row:
            surface.accumulator[before] = 0
        accumulators.owner[row] = slot
        surface.accumulator[slot] = row
    accumulators.tally[N_OPENED] += 1
    accumulators.place[row] = place
    accumulators.first_label[row], accumulators.for_ooi[row] = first_label, for_ooi
    accumulators.images[row] = accumulators.ooi_images[row] = 0
    accumulators.ooi_sum[row] = 0.0
    accumulators.base_log_odds[row] = surface.log_odds[slot]
    for j in range(labels):
        accumulators.base[row, j] = surface.energy[slot, j]
        accumulators.sums[row, j] = 0.0
    return row


@INNER
def close_for_labels(surface, accumulators, slot, w):
    """Let the place of an accumulator not count again for the labels of a voxel."""
    bit = np.uint64(1) << np.uint64(accumulators.place[w])
    surface.label_places[slot] |= bit
    surface.added_places[slot] |= bit


@INNER
def close_for_ooi(surface, accumulators, slot, w):
    """Let the place of an accumulator not count again for the OOI in a voxel."""
    surface.ooi_places[slot] |= np.uint64(1) << np.uint64(accumulators.place[w])

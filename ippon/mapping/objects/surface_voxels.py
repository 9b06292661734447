"""Colour, labels and object probability of each surface voxel."""

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ippon.mapping.arrays import INNER

N_USED: Final = 0
N_FREE: Final = 1

STEPS_PER_NAT: Final = 24
"""Resolution of the common objects' negative log-probabilities."""
ENERGY_MAX: Final = 255
"""Greatest gap to the most probable label (41,000 to 1); a label can recover."""
NORM_STEPS: Final = 3000
"""Resolution of `SurfaceVoxels.log_norm` for one nat."""
NO_LABEL: Final = 255


class SurfaceVoxels(NamedTuple):
    """Arrays with one row per surface voxel; row 0 is unused.

    `energy[r, j]` is -log q_j in steps of 1 / `STEPS_PER_NAT` nat, relative to the most probable
    label of the row. Updates are rounded up and down in alternation (see `posterior_arithmetic`),
    so that small ones add up; the error stays below one step.
    """

    energy: NDArray[np.uint8]
    """(R, M) with M at least the number of labels; columns beyond it are `ENERGY_MAX`."""
    log_norm: NDArray[np.int16]
    """(R,) log of the sum of p = exp(-energy / `STEPS_PER_NAT`), in units of 1 / `NORM_STEPS`."""
    log_odds: NDArray[np.float32]
    """(R,) of the OOI against the common objects."""
    voxel: NDArray[np.int32]
    """(R,) pool row * 512 + voxel; -1 for a row that is not in use."""
    color: NDArray[np.uint8]
    """(R, 3) RGB, running mean."""
    color_count: NDArray[np.uint8]
    label: NDArray[np.uint8]
    """(R,) most probable common label, `NO_LABEL` before the first heatmap."""
    confidence: NDArray[np.uint8]
    """(R,) its probability in units of 1/254."""
    proximity: NDArray[np.uint8]
    """(R,) l(v) in units of 1/254, `NO_LABEL` before the first heatmap."""
    label_places: NDArray[np.uint64]
    """(R,) one bit per place whose images `energy` contains; see `places.place_of`."""
    added_places: NDArray[np.uint64]
    """(R,) those of them whose images it contains for the labels that were added last, too."""
    ooi_places: NDArray[np.uint64]
    """(R,) one bit per place whose images the log-odds of the OOI contain, or that are closed."""
    accumulator: NDArray[np.int32]
    """(R,) row of `places.PlaceAccumulators` while the current place is open, 0 for none."""
    free: NDArray[np.int32]
    """(R,) stack of released rows."""
    tally: NDArray[np.int64]
    """(2,) rows ever used (row 0 included), length of `free`."""


_RECORD: Final = np.dtype(
    [
        ("label_places", np.uint64),
        ("added_places", np.uint64),
        ("ooi_places", np.uint64),
        ("log_odds", np.float32),
        ("accumulator", np.int32),
        ("voxel", np.int32),
        ("log_norm", np.int16),
        ("color", np.uint8, 3),
        ("color_count", np.uint8),
        ("label", np.uint8),
        ("confidence", np.uint8),
        ("proximity", np.uint8),
    ]
)


def padded_labels(labels: int) -> int:
    """Return the row length for a number of labels: a multiple of a vector register."""
    return max(16, -(-labels // 8) * 8)


def make_surface_voxels(max_rows: int, labels: int) -> SurfaceVoxels:
    """Reserve rows; their memory is backed when it is first written."""
    # The fields that an update reads beside the energies share one cache line.
    record = np.zeros(max_rows, _RECORD)
    rows = SurfaceVoxels(
        energy=np.zeros((max_rows, padded_labels(labels)), np.uint8),
        log_norm=record["log_norm"],
        log_odds=record["log_odds"],
        voxel=record["voxel"],
        color=record["color"],
        color_count=record["color_count"],
        label=record["label"],
        confidence=record["confidence"],
        proximity=record["proximity"],
        label_places=record["label_places"],
        added_places=record["added_places"],
        ooi_places=record["ooi_places"],
        accumulator=record["accumulator"],
        free=np.zeros(max_rows, np.int32),
        tally=np.zeros(2, np.int64),
    )
    rows.tally[N_USED] = 1
    rows.voxel[0], rows.label[0] = -1, NO_LABEL
    return rows


@INNER
def norm_code(log_norm):
    """Return a normaliser as the code of `SurfaceVoxels.log_norm`."""
    return np.int16(np.floor(log_norm * np.float32(NORM_STEPS) + np.float32(0.5)))


@INNER
def allocate_surface_voxel(surface, voxel, labels, start_energy, prior_log_odds):
    """Return a row for a voxel, initialised to the prior; 0 when the limit is reached."""
    if surface.tally[N_FREE] > 0:
        surface.tally[N_FREE] -= 1
        row = surface.free[surface.tally[N_FREE]]
    elif surface.tally[N_USED] < surface.voxel.shape[0]:
        row = surface.tally[N_USED]
        surface.tally[N_USED] += 1
    else:
        return 0
    surface.energy[row, :labels] = start_energy
    surface.energy[row, labels:] = ENERGY_MAX
    surface.log_norm[row] = norm_code(np.log(np.float32(max(labels, 1))))
    surface.log_odds[row] = prior_log_odds
    surface.voxel[row] = voxel
    surface.color[row, :] = 0
    surface.color_count[row] = 0
    surface.label[row] = NO_LABEL
    surface.confidence[row] = 0
    surface.proximity[row] = NO_LABEL
    surface.label_places[row] = surface.added_places[row] = surface.ooi_places[row] = 0
    surface.accumulator[row] = 0
    return row

"""Where the object may be after all: the places that looked most like it."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from app.view.colors import OOI_SCALE
from app.view.model.picking import SurfaceLookup
from app.view.model.picture_store import PictureStore
from app.view.model.voxel_pictures import VoxelPicture, pictures_showing
from app.view.model.voxel_store import VoxelStore

LISTED: Final = 3
LEAST: Final = 0.05
"""What is less likely than this looks like nothing in particular."""
APART_M: Final = 0.9
"""Two places that are nearer to each other are one."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Candidate:
    """A place that looked like the object."""

    point_world: tuple[float, float, float]
    """Centre of its likeliest voxel, metres."""
    probability: float
    """Highest p(v in O) there."""
    label: int
    """Row of the common object that the voxel is taken for otherwise."""
    picture: VoxelPicture | None
    """The closest picture that shows it; None where none is kept."""


def best_candidates(
    store: VoxelStore, voxel_size_m: float, pictures: PictureStore
) -> tuple[Candidate, ...]:
    """Return the likeliest places of a map, at most `LISTED`, the likeliest first."""
    indices, attributes = store.at_least(round(LEAST * OOI_SCALE))
    lookup = SurfaceLookup(store, None)
    found: list[Candidate] = []
    for row in _peaks(indices, attributes[:, 3], APART_M / voxel_size_m):
        i, j, k = (int(n) for n in indices[row])
        x, y, z = ((n + 0.5) * voxel_size_m for n in (i, j, k))
        found.append(
            Candidate(
                point_world=(x, y, z),
                probability=float(attributes[row, 3]) / OOI_SCALE,
                label=int(attributes[row, 6]),
                picture=next(pictures_showing(pictures, (i, j, k), voxel_size_m, lookup), None),
            )
        )
    return tuple(found)


def _peaks(indices: NDArray[np.int64], ooi: NDArray[np.uint8], apart: float) -> list[int]:
    """Return rows of the highest values that lie farther apart than that many voxels."""
    rows: list[int] = []
    left = ooi.astype(np.int64)
    while len(rows) < LISTED and left.any():
        # Of equal voxels the one amid the others: the middle of a thing, not its rim.
        best = np.flatnonzero(left == left.max())
        middle = indices[best].mean(axis=0)
        row = int(best[np.argmin(np.linalg.norm(indices[best] - middle, axis=1))])
        rows.append(row)
        left[np.linalg.norm(indices - indices[row], axis=1) < apart] = 0
    return rows

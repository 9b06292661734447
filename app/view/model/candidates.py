"""Candidates after a search without find: the most probable places of the object."""

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
"""Minimum probability of a candidate."""
APART_M: Final = 0.9
"""Minimum distance between two candidates."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Candidate:
    """A place that may be the object."""

    point_world: tuple[float, float, float]
    """Centre of its most probable voxel, metres."""
    probability: float
    """Highest p(v in O) there."""
    label: int
    """Row of the voxel's most probable common object."""
    picture: VoxelPicture | None
    """The closest picture that shows it; None without one."""


def best_candidates(
    store: VoxelStore, voxel_size_m: float, pictures: PictureStore
) -> tuple[Candidate, ...]:
    """Return the most probable places of a map, at most `LISTED`, best first."""
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
    """Return rows of the highest values with a minimum distance in voxels."""
    rows: list[int] = []
    left = ooi.astype(np.int64)
    while len(rows) < LISTED and left.any():
        # Among equal voxels the most central one: the middle of an object, not its edge.
        best = np.flatnonzero(left == left.max())
        middle = indices[best].mean(axis=0)
        row = int(best[np.argmin(np.linalg.norm(indices[best] - middle, axis=1))])
        rows.append(row)
        left[np.linalg.norm(indices - indices[row], axis=1) < apart] = 0
    return rows

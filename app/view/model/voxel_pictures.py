"""Stored pictures that show a voxel: in view, near enough, and not occluded."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from app.view.model.picking import SurfaceLookup, first_voxel
from app.view.model.picture_store import PictureStore, StoredPicture

SEEN_M: Final = 5.0
_TRIED: Final = 12
"""Maximum number of pictures whose line of sight is checked, the closest first."""


@dataclass(frozen=True, slots=True, kw_only=True)
class VoxelPicture:
    """A picture and the voxel's pixel in it."""

    picture: StoredPicture
    u: int
    v: int
    depth_m: float


def pictures_showing(
    pictures: PictureStore,
    voxel: tuple[int, int, int],
    voxel_size_m: float,
    lookup: SurfaceLookup,
) -> Iterator[VoxelPicture]:
    """Yield pictures that show a voxel of the surface, the closest first."""
    center = (np.array(voxel) + 0.5) * voxel_size_m
    for picture, u, v, depth in pictures.showing(center, SEEN_M)[:_TRIED]:
        eye = picture.T_world_camera[:3, 3]
        hit = first_voxel(eye, center - eye, voxel_size_m, lookup)
        if hit is None or max(abs(a - b) for a, b in zip(hit[0], voxel, strict=True)) > 1:
            continue
        yield VoxelPicture(picture=picture, u=u, v=v, depth_m=depth)

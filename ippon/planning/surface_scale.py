"""Counts of surface voxels, from the voxel size that they are stated for to a map's own."""

from typing import Final

REFERENCE_VOXEL_M: Final = 0.1
"""Counts of voxels in code and settings are of voxels of this size."""


def surface_scale(voxel_size_m: float) -> float:
    """Return how many voxels of this size cover the surface of one of `REFERENCE_VOXEL_M`."""
    return (REFERENCE_VOXEL_M / voxel_size_m) ** 2

"""Scaling of surface voxel counts from the reference voxel size to the map's."""

from typing import Final

REFERENCE_VOXEL_M: Final = 0.1
"""Voxel size for which voxel counts in code and configuration are stated, metres."""


def surface_scale(voxel_size_m: float) -> float:
    """Return how many voxels of this size cover the surface of one reference voxel."""
    return (REFERENCE_VOXEL_M / voxel_size_m) ** 2

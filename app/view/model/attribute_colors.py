"""Colours of stored voxels, in the colour modes that need nothing but their attributes."""

from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from app.view.colors import voxel_colors

AttributeColor = Literal["camera", "ooi", "proximity", "height"]
TOP_M: Final = 3.0
"""Upper end of the height ramp, above the floor."""


def attribute_colors(
    indices: NDArray[np.int64],
    attributes: NDArray[np.uint8],
    voxel_m: float,
    mode: AttributeColor,
    floor_z_m: float,
) -> NDArray[np.uint8]:
    """Return (N, 3) RGB of voxels.

    Args:
        indices: (N, 3) voxel index.
        attributes: (N, 8) as `VoxelStore` keeps them.
        voxel_m: Edge length of a voxel.
        mode: Colour mode.
        floor_z_m: Height of the floor.
    """
    ooi = attributes[:, 3]
    return voxel_colors(
        mode,
        rgb=attributes[:, :3],
        ooi=ooi,
        level=attributes[:, 5],
        height_m=((indices[:, 2] + 0.5) * voxel_m - floor_z_m).astype(np.float32),
        top_m=TOP_M,
        # Unused by these colour modes.
        thing=ooi,
        gain=ooi,
    )

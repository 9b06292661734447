"""T_min, the number of object voxels that ends a search, and the height at which they begin."""

import math
from typing import Final

from ippon.planning.surface_scale import surface_scale

# About a fifth of the surface voxels of 10 cm that one image shows of an ordinary specimen. The
# paper gives no numbers: "smaller for plants and larger for beds".
_VOXELS_AT_REFERENCE: Final[dict[str, float]] = {
    "bed": 24.0,
    "sofa": 18.0,
    "table": 12.0,
    "bathtub": 12.0,
    "cabinet": 12.0,
    "shelving": 12.0,
    "counter": 12.0,
    "fireplace": 10.0,
    "chest_of_drawers": 10.0,
    "gym_equipment": 8.0,
    "appliances": 8.0,
    "chair": 6.0,
    "toilet": 6.0,
    "tv": 5.0,
    "shower": 8.0,
    "sink": 5.0,
    "stool": 5.0,
    "plant": 4.0,
}
_SMALL_OBJECT: Final = 1.0
_MAY_BE_FLAT: Final = frozenset(
    {"shower", "gym_equipment", "appliances", "floor", "bath_mat", "welcome_mat", "yoga_mat"}
)
"""Objects that may be as flat as a mat or a tray."""
_STANDS_M: Final = 0.1


def termination_voxels(label: str, category: str | None, voxel_size_m: float) -> float:
    """Return T_min for an object on a map of this voxel size (Sec. Node Evaluation).

    Args:
        label: Canonical label of the object.
        category: Common object that it is an instance of, or None.
        voxel_size_m: Edge of a voxel; surface voxels scale with its inverse square.
    """
    count = _count(label, category) or _SMALL_OBJECT
    return max(1.0, count * surface_scale(voxel_size_m))


def is_small(label: str, category: str | None) -> bool:
    """Return whether a single voxel of 10 cm may hold the object.

    Args:
        label: Canonical label of the object.
        category: Common object that it is an instance of, or None.
    """
    return _count(label, category) is None


def lowest_m(label: str, category: str | None) -> float:
    """Return the height above the floor at which an object's voxels begin, metres.

    The lowest voxels of standing objects look like floor; small objects may consist of them.

    Args:
        label: Canonical label of the object.
        category: Common object that it is an instance of, or None.
    """
    if label in _MAY_BE_FLAT or category in _MAY_BE_FLAT:
        return -math.inf
    return 0.0 if is_small(label, category) else _STANDS_M


def _count(label: str, category: str | None) -> float | None:
    count = _VOXELS_AT_REFERENCE.get(label)
    if count is None and category is not None:
        count = _VOXELS_AT_REFERENCE.get(category)
    return count

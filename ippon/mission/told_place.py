"""Whether a find is where the operator said that the object is."""

import math
from typing import Final

import numpy as np

from ippon.guidance.levels import Guidance, Level
from ippon.mapping.voxel_map import VoxelMap
from ippon.mission.explanation import label_census
from ippon.mission.goal import Goal
from ippon.mission.snapshot import Find

_BESIDE_M: Final = 0.6
"""What was named may begin this far from the find: maps are not sharp, nor are words."""


def is_elsewhere(find: Find, goal: Goal, guidance: Guidance, voxel_map: VoxelMap) -> bool:
    """Tell whether the operator named what the object is on or beside, and none is near a find.

    Args:
        find: What may be the object.
        goal: The object.
        guidance: Its levels: what was named is certain. Without a context nothing was.
        voxel_map: The map.
    """
    itself = (goal.object, goal.category)
    named = {label for label in guidance.labels_of(Level.CERTAIN) if label not in itself}
    if not guidance.context or not named:
        return False
    radius_m = 0.5 * math.hypot(find.size_m[0], find.size_m[1]) + _BESIDE_M
    counts = label_census(voxel_map, np.array(find.position_world), radius_m)
    seen = (label for label, count in zip(voxel_map.labels, counts, strict=True) if count)
    return named.isdisjoint(seen)

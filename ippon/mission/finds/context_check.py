"""Whether a find contradicts what the operator said about its place."""

import functools
import math
from typing import Final

import numpy as np

from ippon.guidance.language.context import Claim, read_context
from ippon.mapping.voxel_map import VoxelMap
from ippon.mission.explanation import label_census
from ippon.mission.goal import Goal
from ippon.mission.snapshot import Find

_ON_M: Final = 0.6
"""Greatest gap between a find and what it lies on, in or under: maps blur edges."""
_BESIDE_M: Final = 1.5
"""The same for relations such as next to, near or behind."""
_TOUCHING: Final = frozenset({"on", "in", "under", "above"})


def contradicts_context(find: Find, goal: Goal, context: str, voxel_map: VoxelMap) -> bool:
    """Return whether the operator named what the object is on or beside, and none is near a find.

    False where the operator named a room or a thing without a label: the map cannot tell.

    Args:
        find: A candidate.
        goal: The object.
        context: What the operator said.
        voxel_map: The map.
    """
    places = _places(context, voxel_map.labels, goal.object)
    return bool(places) and not any(_is_near(find, claim, voxel_map) for claim in places)


@functools.lru_cache(maxsize=8)
def _places(context: str, labels: tuple[str, ...], ooi: str) -> tuple[Claim, ...]:
    """Return the claims of a context, if all of them are about labels of the map."""
    stated = [c for c in read_context(context, labels, ooi=ooi).claims if c.firm and not c.negated]
    known = all(claim.kind == "thing" and claim.label is not None for claim in stated)
    return tuple(stated) if known else ()


def _is_near(find: Find, claim: Claim, voxel_map: VoxelMap) -> bool:
    assert claim.label is not None, "only such claims are looked up"
    beside_m = _ON_M if claim.relation in _TOUCHING else _BESIDE_M
    radius_m = 0.5 * math.hypot(find.size_m[0], find.size_m[1]) + beside_m
    counts = label_census(voxel_map, np.array(find.position_world), radius_m)
    return bool(counts[voxel_map.labels.index(claim.label)])

"""Comparison of a find with what the operator said about its place."""

import functools
import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from ippon.guidance.language.context import Claim, read_context
from ippon.mapping.voxel_map import VoxelMap
from ippon.mission.explanation import label_census
from ippon.mission.goal import Goal
from ippon.mission.snapshot import Find

_TOUCHING: Final = frozenset({"on", "in", "under", "above"})


@dataclass(frozen=True, slots=True, kw_only=True)
class ContextCheckConfig:
    """Distances between a find and the object that the operator said it is on or beside."""

    touching_m: float = 0.6
    """Largest gap for on, in, under and above, since maps blur edges; more accepts finds farther
    from the place that was named."""
    beside_m: float = 1.5
    """Largest gap for other relations, such as next to or behind; more accepts likewise."""

    def __post_init__(self) -> None:
        """Reject gaps that accept nothing."""
        if not 0.0 <= self.touching_m <= self.beside_m:
            raise ValueError(
                "gaps must grow: 0 <= touching_m <= beside_m; got "
                f"{self.touching_m}, {self.beside_m}"
            )


def contradicts_context(
    config: ContextCheckConfig, find: Find, goal: Goal, context: str, voxel_map: VoxelMap
) -> bool:
    """Return whether the operator named objects that the find is on or beside, and none is near it.

    False if the operator named a room, or an object without a label of the map.

    Args:
        config: Largest gaps.
        find: A candidate.
        goal: The object.
        context: What the operator said.
        voxel_map: The map.
    """
    places = _places(context, voxel_map.labels, goal.object)
    return bool(places) and not any(_is_near(config, find, claim, voxel_map) for claim in places)


@functools.lru_cache(maxsize=8)
def _places(context: str, labels: tuple[str, ...], ooi: str) -> tuple[Claim, ...]:
    """Return the claims of a context, if all of them are about labels of the map."""
    stated = [c for c in read_context(context, labels, ooi=ooi).claims if c.firm and not c.negated]
    known = all(claim.kind == "thing" and claim.label is not None for claim in stated)
    return tuple(stated) if known else ()


def _is_near(config: ContextCheckConfig, find: Find, claim: Claim, voxel_map: VoxelMap) -> bool:
    assert claim.label is not None, "only such claims are looked up"
    gap_m = config.touching_m if claim.relation in _TOUCHING else config.beside_m
    radius_m = 0.5 * math.hypot(find.size_m[0], find.size_m[1]) + gap_m
    counts = label_census(voxel_map, np.array(find.position_world), radius_m)
    return bool(counts[voxel_map.labels.index(claim.label)])

"""Comparison of a find with the size of the object."""

import math
from dataclasses import dataclass

from ippon.guidance.knowledge import load_knowledge
from ippon.mission.finds.termination_threshold import is_small, termination_voxels
from ippon.mission.goal import Goal
from ippon.mission.snapshot import Find


@dataclass(frozen=True, slots=True, kw_only=True)
class SizeCheckConfig:
    """Bounds on the size of a find."""

    unsure_factor: float = 2.5
    """Factor on T_min for a large object whose posterior is not sure; more doubts more finds."""
    relaxed_share: float = 0.5
    """Share of T_min that ends a search if no more of a small object can be seen; more ends fewer
    searches early."""
    oversize_share: float = 1.25
    """Largest extent of a find, as a factor on the longest side of an ordinary specimen; more
    accepts larger finds."""
    oversize_voxels: float = 2.0
    """Voxels added to that, since the map blurs edges; more accepts larger finds."""
    near_m: float = 2.0
    """Distance within which an object shows all its voxels; more relaxes T_min earlier."""

    def __post_init__(self) -> None:
        """Reject bounds without meaning."""
        bounds = (
            self.unsure_factor,
            self.relaxed_share,
            self.oversize_share,
            self.oversize_voxels,
            self.near_m,
        )
        if not all(0.0 <= bound < math.inf for bound in bounds):
            raise ValueError(
                "unsure_factor, relaxed_share, oversize_share, oversize_voxels and near_m must be "
                f"finite and at least 0; got {', '.join(map(str, bounds))}"
            )


class SizeCheck:
    """Compares finds with the size of the object."""

    def __init__(self, config: SizeCheckConfig, goal: Goal, voxel_size_m: float) -> None:
        self.config = config
        self.small = is_small(goal.object, goal.category)
        """The object may fit into a single voxel of the map."""
        self.termination_min = termination_voxels(goal.object, goal.category, voxel_size_m)
        """T_min without relaxation."""
        ordinary_m = load_knowledge().size_m(goal.object)
        self.longest_m = config.oversize_share * ordinary_m + config.oversize_voxels * voxel_size_m
        """Largest extent of a find."""

    def is_too_large(self, find: Find) -> bool:
        """Return whether a find is larger than any ordinary specimen."""
        return max(find.size_m) > self.longest_m

    def is_too_little(self, find: Find, *, sure: bool) -> bool:
        """Return whether too few voxels of a large object show.

        Args:
            find: The find that would end the search.
            sure: The posterior of its voxels is sure.
        """
        factor = 1.0 if sure else self.config.unsure_factor
        return not self.small and find.voxels <= factor * self.termination_min

    def is_single_voxel(self, find: Find) -> bool:
        """Return whether a find of a small object has no more than T_min voxels."""
        return self.small and find.voxels <= self.termination_min

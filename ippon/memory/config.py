"""What is the same thing in the memory, and what is gone."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class MemoryConfig:
    """What is the same thing, and what is gone."""

    same_overlap: float = 0.3
    """Common part of two boxes, as a share of the smaller, from which two sightings of one label
    are the same thing; more takes a thing that was pushed aside for another one."""
    relabel_overlap: float = 0.5
    """The same for sightings of different labels; more takes a corrected label for a new thing."""
    find_within_m: float = 0.5
    """Distance up to which two finds of a search are the same thing."""
    shrink_share: float = 0.9
    """A thing that shows fewer of its voxels than this share keeps its box for `settle_s`: it may
    be about to vanish."""
    settle_s: float = 60.0
    """What vanishes earlier than this after it was first seen was never there."""
    gone_share: float = 0.5
    """Share of a thing's box that the map must know before the thing can be gone."""
    max_instances: int = 10_000
    """More are not kept: those that are gone longest, and then those unseen longest, go first."""

    def __post_init__(self) -> None:
        """Reject shares and counts without meaning."""
        for name in ("same_overlap", "relabel_overlap", "shrink_share", "gone_share"):
            if not 0.0 < getattr(self, name) <= 1.0:
                raise ValueError(f"{name} lies in (0, 1]; got {getattr(self, name)}")
        if self.max_instances < 1 or not self.settle_s >= 0.0 or not self.find_within_m > 0.0:
            raise ValueError(
                "max_instances is at least 1, settle_s at least 0 and find_within_m positive; got "
                f"{self.max_instances}, {self.settle_s}, {self.find_within_m}"
            )

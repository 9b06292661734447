"""Constraints of generated homes."""

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True, slots=True, kw_only=True)
class HomeConfig:
    """Constraints of a generated home."""

    layout: Literal["home", "floor"] = "home"
    """A flat or house, or a floor of a large building with 40 rooms along corridors."""
    passage_radius_m: float = 0.3
    """Radius of a body that can reach every room; larger leaves wider passages and less
    furniture."""
    body_height_m: float = 1.45
    """Height up to which passages are free; larger also counts lamps and shelves."""
    max_step_m: float = 0.06
    """Height below which objects do not block passages; larger leaves more on the floor."""
    start_clearance_m: float = 0.5
    """Least distance from a start pose to any object; larger moves starts into the open."""
    start_count: int = 8
    """Number of start poses; larger gives more episodes per home."""
    small_things: bool = True
    """Whether small objects lie about; without them a home renders faster."""

    def __post_init__(self) -> None:
        """Reject values that no home satisfies."""
        if not 0.1 <= self.passage_radius_m <= 0.4:
            raise ValueError(
                f"passage_radius_m must be 0.1 to 0.4, doors are 0.88 m wide; "
                f"got {self.passage_radius_m}"
            )
        if self.start_count < 1:
            raise ValueError(f"start_count must be at least 1; got {self.start_count}")

"""What every generated home must keep."""

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True, slots=True, kw_only=True)
class HomeConfig:
    """What every generated home must keep."""

    layout: Literal["home", "floor"] = "home"
    """A flat or house, or a floor of a large building with 40 rooms along corridors."""
    passage_radius_m: float = 0.3
    """Radius of the body that reaches every room; larger leaves wider ways and less furniture."""
    body_height_m: float = 1.45
    """Height up to which the ways are kept free; larger also counts lamps and shelves."""
    max_step_m: float = 0.06
    """Things flatter than this lie in nobody's way; larger lets more lie about."""
    start_clearance_m: float = 0.5
    """Least distance from a start pose to anything; larger puts starts in the open."""
    start_count: int = 8
    """Number of start poses; larger gives more episodes in one home."""
    small_things: bool = True
    """Whether small things lie about; without them a home is tidy and renders faster."""

    def __post_init__(self) -> None:
        """Reject ways that no flat has."""
        if not 0.1 <= self.passage_radius_m <= 0.4:
            raise ValueError(
                f"passage_radius_m must be 0.1 to 0.4, doors are 0.88 m wide; "
                f"got {self.passage_radius_m}"
            )
        if self.start_count < 1:
            raise ValueError(f"start_count must be at least 1; got {self.start_count}")

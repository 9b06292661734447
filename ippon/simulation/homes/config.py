"""Constraints of generated homes."""

from dataclasses import dataclass
from typing import Final, Literal

MUG_COLORS: Final[dict[str, tuple[int, int, int]]] = {
    "red": (178, 34, 38), "white": (238, 236, 230), "blue": (38, 78, 158), "green": (58, 128, 72),
    "yellow": (232, 196, 62), "black": (36, 36, 40),
}  # fmt: skip
"""sRGB of the mugs of `HomeConfig.mugs`."""


@dataclass(frozen=True, slots=True, kw_only=True)
class HomeConfig:
    """Constraints of a generated home."""

    layout: Literal["home", "floor"] = "home"
    """A flat or house, or a floor of a building: by seed in turn an office, a school, a hospital
    ward or a shopping centre."""
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
    mugs: tuple[str, ...] = ()
    """Colours of mugs that a home has besides others, each on a table, desk or counter: names of
    `MUG_COLORS`. More makes "the red mug" one of several."""
    small_things: bool = True
    """Whether small objects lie about; without them a home renders faster."""

    def __post_init__(self) -> None:
        """Reject values that no home satisfies."""
        if not 0.1 <= self.passage_radius_m <= 0.4:
            raise ValueError(
                f"passage_radius_m must be 0.1 to 0.4, doors are 0.88 m wide; "
                f"got {self.passage_radius_m}"
            )
        unknown = [name for name in self.mugs if name not in MUG_COLORS]
        if unknown:
            known = ", ".join(MUG_COLORS)
            raise ValueError(f"mugs are {known}; got {', '.join(unknown)}")
        if self.start_count < 1:
            raise ValueError(f"start_count must be at least 1; got {self.start_count}")

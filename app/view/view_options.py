"""What the operator chose to see."""

from dataclasses import dataclass, field
from typing import Final, Literal, get_args

from app.view.colors import ColorMode

Layer = Literal[
    "map",
    "mesh",
    "object",
    "tree",
    "path",
    "camera",
    "trail",
    "finds",
    "labels",
    "far_evidence",
    "clearance",
]
LAYERS: Final[tuple[Layer, ...]] = get_args(Layer)
SHOWN_FIRST: Final[frozenset[Layer]] = frozenset(LAYERS) - {"mesh", "clearance"}


@dataclass(frozen=True, slots=True, kw_only=True)
class ViewOptions:
    """One choice for everyone who watches."""

    mode: ColorMode = "camera"
    ceiling_m: float | None = 1.4
    """Voxels higher than this are hidden, so that one looks into the rooms; None hides nothing."""
    object_threshold: float = 0.3
    """p(v in O) from which a voxel is drawn as a box; fewer boxes the greater it is."""
    thing: int | None = None
    """Row of the common object whose probability colours the map in that mode."""
    layers: frozenset[Layer] = field(default_factory=lambda: SHOWN_FIRST)

    def __post_init__(self) -> None:
        """Reject what cannot be drawn."""
        if not 0.0 < self.object_threshold <= 1.0:
            raise ValueError(f"a threshold lies in (0, 1]; got {self.object_threshold}")

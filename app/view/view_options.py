"""View options of the operator."""

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
    """View options of a browser."""

    mode: ColorMode = "camera"
    ceiling_m: float | None = 1.4
    """Height above the robot's floor from which voxels are hidden, to show the rooms inside; None
    hides nothing."""
    object_threshold: float = 0.3
    """p(v in O) from which a voxel is drawn as a box; higher values give fewer boxes."""
    thing: int | None = None
    """Row of the common object whose probability colours the map in that mode."""
    layers: frozenset[Layer] = field(default_factory=lambda: SHOWN_FIRST)

    def __post_init__(self) -> None:
        """Reject invalid values."""
        if not 0.0 < self.object_threshold <= 1.0:
            raise ValueError(f"a threshold lies in (0, 1]; got {self.object_threshold}")

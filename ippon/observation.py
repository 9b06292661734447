"""What a source says of an image: label probabilities of each pixel, or instances of things."""

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

HeatmapKind = Literal["distribution", "scores"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Heatmap:
    """What an image says of each label at each pixel.

    The last channel is the object of interest when `ooi` is set and is not itself one of the
    common labels; otherwise the channels are just the common labels.
    """

    labels: tuple[str, ...]
    """Common labels, one a channel, in the order of the channels."""
    ooi: str | None
    """Label of the object of interest that the source was asked for, where it can tell it."""
    probabilities: NDArray[np.uint8]
    """(h, w, C) uint8 in units of 1/255; (h, w) may be smaller than the image it belongs to."""
    kind: HeatmapKind = "distribution"
    """`distribution`: probabilities that sum to 1 at each pixel. `scores`: each label's own score,
    0 where it was not recognised."""
    source: str = ""
    """Network that made it, the key of its observation model; empty where unknown."""

    def __post_init__(self) -> None:
        """Check that channels and labels agree."""
        expected = len(self.labels) + (self.ooi is not None and self.ooi not in self.labels)
        p = self.probabilities
        if p.ndim != 3 or p.dtype != np.uint8 or p.shape[2] != expected:
            raise ValueError(
                f"a heatmap of {len(self.labels)} labels and ooi {self.ooi!r} is (h, w, {expected})"
                f" uint8; got {p.shape} {p.dtype}"
            )

    @property
    def ooi_channel(self) -> int | None:
        """Channel of the object of interest, None when the source was not asked for one."""
        if self.ooi is None:
            return None
        return self.labels.index(self.ooi) if self.ooi in self.labels else len(self.labels)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Instance:
    """One thing that a detector found in an image."""

    label: str
    """Canonical."""
    score: float
    """0 to 1, as the network gives it."""
    box_px: tuple[float, float, float, float]
    """Left, top, right, bottom in pixels of the image, inside it."""
    mask: NDArray[np.bool_] | None = None
    """(h, w) over the whole image, in proportion to it; None where only the box is known."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Detections:
    """The instances that a detector found in an image."""

    source: str
    """Network that found them, the key of its observation model."""
    labels: tuple[str, ...]
    """Labels that were looked for, the object of interest included: one without an instance was not
    recognised. What the detector cannot tell is not among them."""
    ooi: str | None
    """Object of interest; None without one, or where the detector cannot tell it."""
    image_size: tuple[int, int]
    """(H, W) pixels that boxes refer to."""
    instances: tuple[Instance, ...]
    dropped: int = 0
    """Instances that were no finding: outside the image, reversed, not finite, too many."""

    def __post_init__(self) -> None:
        """Check that instances carry labels that were looked for."""
        unknown = {one.label for one in self.instances} - set(self.labels)
        if unknown:
            raise ValueError(
                f"instances carry labels that were not looked for: {', '.join(sorted(unknown))}"
            )
        if self.ooi is not None and self.ooi not in self.labels:
            raise ValueError(f"the object of interest {self.ooi!r} is not among the labels")


Observation: TypeAlias = Heatmap | Detections
"""What any source says of an image."""

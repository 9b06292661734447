"""Results of a segmentation for one image: label probabilities per pixel, or instances."""

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

HeatmapKind = Literal["distribution", "scores"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Heatmap:
    """Probability or score of each label at each pixel.

    The last channel is the object of interest when `ooi` is set and is not itself one of the
    common labels; otherwise the channels are just the common labels.
    """

    labels: tuple[str, ...]
    """Common labels in the order of the channels."""
    ooi: str | None
    """Object of interest that the source was asked for; None if it cannot recognise it."""
    probabilities: NDArray[np.uint8]
    """(h, w, C) uint8 in units of 1/255; (h, w) may be smaller than the image it belongs to."""
    kind: HeatmapKind = "distribution"
    """`distribution`: probabilities that sum to 1 at each pixel. `scores`: a separate score for
    each label, 0 where it was not recognised."""
    source: str = ""
    """Name of the network, the key of its observation model; empty if unknown."""

    def __post_init__(self) -> None:
        """Check that channels and labels match."""
        expected = len(self.labels) + (self.ooi is not None and self.ooi not in self.labels)
        p = self.probabilities
        if p.ndim != 3 or p.dtype != np.uint8 or p.shape[2] != expected or 0 in p.shape[:2]:
            raise ValueError(
                f"a heatmap of {len(self.labels)} labels and ooi {self.ooi!r} is (h, w, {expected})"
                f" uint8 with at least one pixel; got {p.shape} {p.dtype}"
            )

    @property
    def ooi_channel(self) -> int | None:
        """Channel of the object of interest; None without one."""
        if self.ooi is None:
            return None
        return self.labels.index(self.ooi) if self.ooi in self.labels else len(self.labels)

    def channel_of(self, label: str) -> int | None:
        """Channel of a common label or of the object of interest; None without one.

        Of several objects of interest one is `ooi` and the others are labels after the common ones.
        """
        if label == self.ooi:
            return self.ooi_channel
        return self.labels.index(label) if label in self.labels else None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Instance:
    """An object that a detector found in an image."""

    label: str
    """Canonical."""
    score: float
    """Score of the network, 0 to 1."""
    box_px: tuple[float, float, float, float]
    """Left, top, right, bottom in pixels, inside the image."""
    mask: NDArray[np.bool_] | None = None
    """(h, w) over the whole image, in its proportions; None for a box only."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Detections:
    """Instances that a detector found in an image."""

    source: str
    """Name of the network, the key of its observation model."""
    labels: tuple[str, ...]
    """Labels that were searched for, including the object of interest. Labels without an instance
    were not recognised; labels that the detector does not know are not included."""
    ooi: str | None
    """Object of interest; None without one, or if the detector does not know it."""
    image_size: tuple[int, int]
    """(H, W) pixels that boxes refer to."""
    instances: tuple[Instance, ...]
    dropped: int = 0
    """Number of invalid instances: outside the image, inverted, not finite, or beyond the limit."""

    def __post_init__(self) -> None:
        """Check that the labels of instances were searched for."""
        unknown = {one.label for one in self.instances} - set(self.labels)
        if unknown:
            raise ValueError(
                f"instances have labels that were not searched for: {', '.join(sorted(unknown))}"
            )
        if self.ooi is not None and self.ooi not in self.labels:
            raise ValueError(f"the object of interest {self.ooi!r} is not among the labels")


Observation: TypeAlias = Heatmap | Detections
"""Result of any source for one image."""

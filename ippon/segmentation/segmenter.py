"""The interface of a segmentation: image and labels in, heatmap or instances out."""

from collections.abc import Sequence
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from ippon.observation import Heatmap, Observation
from ippon.observation_model import LEAST_SCORE
from ippon.segmentation.errors import NOT_NUMBERS, SegmentationError

MAX_LABELS = 512


class Segmenter(Protocol):
    """Recognises labels in images.

    Labels may differ from call to call; results that depend on a label alone are cached.
    """

    def segment(
        self, color: NDArray[np.uint8], labels: Sequence[str], ooi: str | None
    ) -> Observation:
        """Return what an image shows of some labels.

        Args:
            color: (H, W, 3) uint8 RGB, of any size.
            labels: Common labels, canonical and distinct, at least one.
            ooi: Canonical label of the object of interest, None for none.

        Returns:
            A heatmap or instances. A heatmap's sides are in proportion to the image's, and smaller.

        Raises:
            ValueError: The image or the labels are invalid.
            SegmentationError: The network failed.
        """
        ...


@runtime_checkable
class TourSegmenter(Protocol):
    """A segmenter that treats all objects of interest of a tour alike, not the first alone."""

    def segment_tour(
        self, color: NDArray[np.uint8], labels: Sequence[str], goals: Sequence[str]
    ) -> Observation:
        """Return what an image shows of some labels; see `segment_tour`."""
        ...


def segment_tour(
    segmenter: Segmenter, color: NDArray[np.uint8], labels: Sequence[str], goals: Sequence[str]
) -> Observation:
    """Return what an image shows of some labels in a search for several objects.

    Args:
        segmenter: One that is no `TourSegmenter` gets the first goal as its object of interest.
        color: (H, W, 3) uint8 RGB, of any size.
        labels: Common labels, then the goals but the first that are none of them.
        goals: Canonical labels of the objects of interest, most important first; may be empty.

    Raises:
        ValueError: The image or the labels are invalid.
        SegmentationError: The network failed.
    """
    if isinstance(segmenter, TourSegmenter):
        return segmenter.segment_tour(color, labels, goals)
    return segmenter.segment(color, labels, goals[0] if goals else None)


class DenseSegmenter(Protocol):
    """A segmenter with an open vocabulary that scores every pixel."""

    def segment(self, color: NDArray[np.uint8], labels: Sequence[str], ooi: str | None) -> Heatmap:
        """Return the probability or score of each label at each pixel; see `Segmenter.segment`.

        Returns:
            Probabilities, the channels of a pixel summing to 255; or scores of each label.
        """
        ...


def checked_channels(
    color: NDArray[Any], labels: Sequence[str], ooi: str | None
) -> tuple[str, ...]:
    """Check the arguments of a segmenter.

    Returns:
        One label per channel: the common ones, then the object of interest if it is not one of
        them.

    Raises:
        ValueError: The message says what was given and what is accepted.
    """
    if color.ndim != 3 or color.shape[2] != 3 or color.dtype != np.uint8 or 0 in color.shape:
        raise ValueError(f"an image is (H, W, 3) uint8 RGB; got {color.shape} {color.dtype}")
    channels = tuple(labels) if ooi is None or ooi in labels else (*labels, ooi)
    if not labels:
        raise ValueError("a segmentation needs at least one common label; got none")
    if len(channels) > MAX_LABELS:
        raise ValueError(f"a segmentation takes at most {MAX_LABELS} labels; got {len(channels)}")
    if any(not channel.strip() for channel in channels):
        raise ValueError(f"labels are words; one of {len(channels)} is empty")
    if len(set(channels)) != len(channels):
        twice = sorted({c for c in channels if channels.count(c) > 1})
        raise ValueError(f"labels are distinct; {', '.join(twice)} came twice")
    return channels


def heatmap_of(
    probabilities: NDArray[np.float32], labels: Sequence[str], ooi: str | None, source: str = ""
) -> Heatmap:
    """Return a heatmap of probabilities that sum to 1.

    Args:
        probabilities: (C, h, w) float32, in the order of `checked_channels`.
        labels: Common labels.
        ooi: Object of interest, or None.
        source: Name of the network.

    Raises:
        SegmentationError: A value is not finite, for example after overflow of half precision.
    """
    _check_finite(probabilities)
    return Heatmap(
        labels=tuple(labels), ooi=ooi, probabilities=quantise(probabilities), source=source
    )


def score_heatmap_of(
    scores: NDArray[np.float32], labels: Sequence[str], ooi: str | None, source: str
) -> Heatmap:
    """Return a heatmap of kind `scores`, with a score of each label at each pixel.

    Args:
        scores: (C, h, w) float32, 0 to 1, in the order of `checked_channels`.
        labels: Common labels.
        ooi: Object of interest, or None.
        source: Name of the network.

    Raises:
        SegmentationError: A value is not finite.
    """
    _check_finite(scores)
    # Lower values stand for labels without a score.
    values = np.maximum(np.rint(255.0 * scores.transpose(1, 2, 0)), LEAST_SCORE)
    return Heatmap(
        labels=tuple(labels),
        ooi=ooi,
        probabilities=values.astype(np.uint8),
        kind="scores",
        source=source,
    )


def _check_finite(values: NDArray[np.float32]) -> None:
    if not np.isfinite(values).all():
        raise SegmentationError(NOT_NUMBERS.format("values"))


def quantise(probabilities: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Quantise probabilities to 1/255 so that each pixel's channels sum to 255.

    Args:
        probabilities: (C, h, w) float32, at least 0, summing to 1 over the channels.

    Returns:
        (h, w, C) uint8. Rounding the running sums moves no channel by more than one step.
    """
    sums = np.cumsum(probabilities.transpose(1, 2, 0), axis=2, dtype=np.float64)
    sums *= 255.0 / np.maximum(sums[..., -1:], 1e-12)
    rounded = np.rint(sums).astype(np.int16)
    return np.diff(rounded, axis=2, prepend=np.int16(0)).astype(np.uint8)


def heatmap_size(shape: tuple[int, int], longest_px: int) -> tuple[int, int]:
    """Return (h, w) of the heatmap of an (H, W) image: the same proportions, not larger."""
    scale = min(1.0, longest_px / max(shape))
    return max(1, round(shape[0] * scale)), max(1, round(shape[1] * scale))

"""Compact heatmaps: the labels with the largest values at each pixel."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

WHOLE = 255
"""Sum of the channels of a pixel."""


@dataclass(frozen=True, slots=True)
class TopClasses:
    """Largest channels of each pixel, always including the objects of interest."""

    channels: NDArray[np.uint16]
    """(k, h, w), distinct at each pixel."""
    values: NDArray[np.uint8]
    """(k, h, w), in units of 1/255."""


def keep_top(
    probabilities: NDArray[np.uint8], count: int, always: Sequence[int] = ()
) -> TopClasses:
    """Return the largest channels of each pixel.

    Args:
        probabilities: (h, w, C) uint8.
        count: Number of channels to keep; more if `always` has more.
        always: Channels that are always kept: those of the objects of interest.

    Raises:
        ValueError: `count` is below 1.
    """
    if count < 1:
        raise ValueError(f"at least one label a pixel is kept; got {count}")
    count = min(max(count, len(always)), probabilities.shape[2])
    ranks = probabilities.astype(np.int16)
    ranks[..., list(always)] += WHOLE + 1
    # Largest first, because planes of similar values compress better.
    order = np.argsort(-ranks, axis=2, kind="stable")[..., :count]
    values = np.take_along_axis(probabilities, order, axis=2)
    return TopClasses(
        np.ascontiguousarray(order.transpose(2, 0, 1).astype(np.uint16)),
        np.ascontiguousarray(values.transpose(2, 0, 1)),
    )


def expand_top(top: TopClasses, channels: int) -> NDArray[np.uint8]:
    """Return a full heatmap: the remainder is shared equally by the labels that were left out.

    Args:
        top: From `keep_top`.
        channels: C.

    Returns:
        (h, w, C) uint8; the channels of a pixel sum to 255 where those of the original did.

    Raises:
        ValueError: A channel is out of range.
    """
    count, h, w = top.channels.shape
    if top.channels.size and int(top.channels.max()) >= channels:
        raise ValueError(f"channel {top.channels.max()} of {channels}")
    index = top.channels.transpose(1, 2, 0).astype(np.int64)
    left_out = np.ones((h, w, channels), dtype=bool)
    np.put_along_axis(left_out, index, values=False, axis=2)
    rest = np.maximum(WHOLE - top.values.sum(axis=0, dtype=np.int64), 0)[..., None]
    # Whole steps of 1/255, as equal as they can be.
    place = np.cumsum(left_out, axis=2)
    others = max(1, channels - count)
    share = rest * place // others - rest * (place - 1) // others
    out = np.where(left_out, share, 0).astype(np.uint8)
    np.put_along_axis(out, index, top.values.transpose(1, 2, 0), axis=2)
    return out

"""Checks and rounding that every segmenter shares."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from ippon.segmentation.errors import SegmentationError
from ippon.segmentation.segmenter import (
    checked_channels,
    heatmap_of,
    heatmap_size,
    quantise,
)

IMAGE = np.zeros((4, 6, 3), np.uint8)


@given(
    arrays(np.float32, (5, 2, 3), elements=st.floats(0.0, 1.0, width=32), fill=st.nothing()).filter(
        lambda p: p.sum(axis=0).min() > 1e-3
    )
)
def test_rounding_keeps_every_sum_and_moves_no_channel_far(scores):
    probabilities = scores / scores.sum(axis=0, keepdims=True)
    rounded = quantise(probabilities)
    assert (rounded.sum(axis=2, dtype=int) == 255).all()
    assert np.abs(rounded - 255.0 * probabilities.transpose(1, 2, 0)).max() <= 1.001


def test_the_object_of_interest_is_the_last_channel_unless_it_is_common():
    assert checked_channels(IMAGE, ["wall", "floor"], "hat") == ("wall", "floor", "hat")
    assert checked_channels(IMAGE, ["wall", "floor"], "wall") == ("wall", "floor")
    assert checked_channels(IMAGE, ["wall"], None) == ("wall",)


@pytest.mark.parametrize(
    ("color", "labels", "ooi", "said"),
    [
        (np.zeros((4, 6), np.uint8), ["wall"], None, r"image is \(H, W, 3\) uint8 RGB; got \(4, 6"),
        (IMAGE.astype(np.float32), ["wall"], None, "got .* float32"),
        (np.zeros((0, 6, 3), np.uint8), ["wall"], None, r"got \(0, 6, 3\)"),
        (IMAGE, [], "hat", "at least one common label; got none"),
        (IMAGE, ["wall", "wall"], None, "distinct; wall came twice"),
        (IMAGE, ["wall", " "], None, "one of 2 is empty"),
        (IMAGE, [str(k) for k in range(513)], None, "at most 512 labels; got 513"),
    ],
)
def test_invalid_images_and_vocabularies_are_rejected(color, labels, ooi, said):
    with pytest.raises(ValueError, match=said):
        checked_channels(color, labels, ooi)


def test_overflow_of_half_precision_is_an_error_and_no_heatmap():
    broken = np.full((1, 2, 2), np.nan, np.float32)
    with pytest.raises(SegmentationError, match="not numbers; try"):
        heatmap_of(broken, ["wall"], None)


def test_a_heatmap_is_in_proportion_and_never_larger():
    assert heatmap_size((480, 640), 160) == (120, 160)
    assert heatmap_size((30, 40), 160) == (30, 40)
    assert heatmap_size((1, 4000), 160) == (1, 160)

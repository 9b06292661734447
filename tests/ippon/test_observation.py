import numpy as np
import pytest

from ippon.observation import Heatmap


@pytest.mark.parametrize(
    ("ooi", "label", "channel"),
    [
        ("hat", "hat", 3),
        ("hat", "mug", 2),
        ("hat", "wall", 0),
        ("hat", "keys", None),
        ("wall", "wall", 0),
        (None, "hat", None),
    ],
)
def test_the_channel_of_any_label(ooi, label, channel):
    channels = 3 + (ooi == "hat")
    heatmap = Heatmap(
        labels=("wall", "floor", "mug"),
        ooi=ooi,
        probabilities=np.zeros((2, 2, channels), np.uint8),
    )
    assert heatmap.channel_of(label) == channel


@pytest.mark.parametrize("size", [(0, 2), (2, 0)])
def test_a_heatmap_has_pixels(size):
    with pytest.raises(ValueError, match="at least one pixel"):
        Heatmap(labels=("wall",), ooi=None, probabilities=np.zeros((*size, 1), np.uint8))

"""Masks of a network's input, in the image."""

import numpy as np
import pytest

from ippon.segmentation.detectors.decoding.outlines import mask_in_image
from ippon.segmentation.detectors.image_input import ImageInput


@pytest.mark.parametrize("shape", [(480, 640), (720, 1280), (640, 480), (100, 900)])
def test_a_mask_of_a_stretched_image_keeps_its_place(shape):
    """A mask and its mirror image are mirrored in the image."""
    place = ImageInput(size=(432, 432), fit="stretch").place(shape)
    v, u = np.mgrid[:108, :108]
    logits = 24.0 - np.hypot(v - 40.0, u - 61.0)
    there, back = mask_in_image(logits, place), mask_in_image(logits[::-1, ::-1], place)
    for axis, side in enumerate(there.shape):
        middle, mirrored = (np.argwhere(one)[:, axis].mean() for one in (there, back))
        assert abs(middle - (side - 1 - mirrored)) < 0.35

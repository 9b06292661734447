"""Masks of instances: resizing and conversion to arrays."""

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.nn import functional

from ippon.segmentation.errors import NOT_NUMBERS, SegmentationError


def resized_masks(masks: Tensor, size: tuple[int, int]) -> Tensor:
    """Resize (K, h, w) masks of the whole image.

    Raises:
        SegmentationError: A value is not a number, for example after overflow of half precision.
    """
    if not len(masks):
        return masks.new_zeros((0, *size))
    if torch.isnan(masks).any():
        raise SegmentationError(NOT_NUMBERS.format("masks"))
    return functional.interpolate(masks[None], size=size, mode="bilinear", align_corners=False)[0]


def mask_arrays(masks: Tensor) -> list[NDArray[np.bool_] | None]:
    """Return each of (K, h, w) bool masks as an array.

    None stands for an empty mask, as of an object smaller than a pixel of the mask; only its box is
    known.
    """
    return [mask if mask.any() else None for mask in masks.cpu().numpy()]

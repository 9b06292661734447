"""Masks of instances, from a network's own size to arrays."""

import numpy as np
from numpy.typing import NDArray
from torch import Tensor
from torch.nn import functional


def resized_masks(masks: Tensor, size: tuple[int, int]) -> Tensor:
    """Bring (K, h, w) masks of the whole image to another size."""
    if not len(masks):
        return masks.new_zeros((0, *size))
    return functional.interpolate(masks[None], size=size, mode="bilinear", align_corners=False)[0]


def mask_arrays(masks: Tensor) -> list[NDArray[np.bool_] | None]:
    """Return each of (K, h, w) bool masks as an array.

    None stands for one without any pixel, as of a thing smaller than a pixel of the mask: there
    the box is all that is known.
    """
    return [mask if mask.any() else None for mask in masks.cpu().numpy()]

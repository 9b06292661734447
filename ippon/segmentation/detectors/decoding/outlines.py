"""Masks in a network's input, cropped to the image."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from ippon.segmentation.detectors.image_input import Placement

_INSIDE: Final = 0.5
"""Probability from which a pixel belongs to the object."""


def mask_in_image(
    chance: NDArray[np.float64], place: Placement, box: NDArray[np.float64] | None = None
) -> NDArray[np.bool_]:
    """Return the mask of an object in the image.

    Args:
        chance: (h, w) probability of the object over the network's input.
        place: Position of the image in the input.
        box: (4,) left, top, right, bottom in pixels of the input that bound the mask; or None.

    Returns:
        (h', w') bool over the image in its proportions, about as fine as `chance`.
    """
    inside = chance >= _INSIDE
    if box is not None:
        height, width = chance.shape
        v = (np.arange(height) + 0.5) * place.input_size[0] / height
        u = (np.arange(width) + 0.5) * place.input_size[1] / width
        inside &= ((v >= box[1]) & (v < box[3]))[:, None] & ((u >= box[0]) & (u < box[2]))
    part = inside[place.share_of_input(*chance.shape)]
    return _in_proportion(part, place.image_size)


def _in_proportion(part: NDArray[np.bool_], size: tuple[int, int]) -> NDArray[np.bool_]:
    """Resize an (h, w) mask to the proportions of an (H, W) image, by nearest neighbours."""
    longest = max(part.shape)
    scale = longest / max(size)
    sides = (max(1, round(side * scale)) for side in size)
    # At the middles of the pixels.
    v, u = (
        (2 * np.arange(count) + 1) * of // (2 * count)
        for count, of in zip(sides, part.shape, strict=True)
    )
    return part[v[:, None], u]

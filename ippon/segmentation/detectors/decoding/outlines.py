"""Masks in a network's input, cropped to the image."""

import numpy as np
from numpy.typing import NDArray

from ippon.segmentation.detectors.image_input import Placement


def mask_in_image(
    logits: NDArray[np.floating], place: Placement, box: NDArray[np.float64] | None = None
) -> NDArray[np.bool_]:
    """Return the mask of an object in the image.

    Args:
        logits: (h, w) over the network's input; above 0 where the object is likelier than not.
        place: Position of the image in the input.
        box: (4,) left, top, right, bottom in pixels of the input that bound the mask; or None.

    Returns:
        (h', w') bool over the image in its proportions, about as fine as `logits`.
    """
    inside = logits >= 0.0
    if box is not None:
        height, width = logits.shape
        v = (np.arange(height) + 0.5) * place.input_size[0] / height
        u = (np.arange(width) + 0.5) * place.input_size[1] / width
        inside &= ((v >= box[1]) & (v < box[3]))[:, None] & ((u >= box[0]) & (u < box[2]))
    part = inside[place.share_of_input(*logits.shape)]
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

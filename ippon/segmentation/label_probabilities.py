"""From how well each label fits to probabilities per pixel."""

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.nn import functional


def probabilities_of(scores: Tensor) -> Tensor:
    """Turn scores into probabilities.

    Where the scores of all labels sum to more than 1 they are scaled down. What they lack where
    nothing fits goes to all labels alike, so that such a pixel teaches a Bayes filter nothing.

    Args:
        scores: (C, h, w), each at least 0.

    Returns:
        (C, h, w) float32, summing to 1 over the labels.
    """
    lacking = (1.0 - scores.sum(dim=0, keepdim=True)).clamp(min=0.0)
    scores = scores + lacking / len(scores)
    return scores / scores.sum(dim=0, keepdim=True)


def as_tensor(color: NDArray[np.uint8], device: torch.device) -> Tensor:
    """Return an (H, W, 3) image as (1, 3, H, W) float32, 0 to 255, on a device."""
    # Images of a message cannot be written to, of which torch would warn.
    owned = np.require(color, requirements=("C", "W"))
    return torch.from_numpy(owned).to(device).permute(2, 0, 1)[None].float()


def resized(color: Tensor, size: tuple[int, int]) -> Tensor:
    """Resize a (1, 3, H, W) image, averaging where it shrinks."""
    if tuple(color.shape[2:]) == size:
        return color
    return functional.interpolate(
        color, size=size, mode="bilinear", align_corners=False, antialias=True
    )


def normalised(color: Tensor, mean: tuple[float, ...], std: tuple[float, ...]) -> Tensor:
    """Bring (B, 3, H, W) RGB in 0 to 255 to zero mean and unit variance of a training set."""
    low = torch.tensor(mean, device=color.device).view(3, 1, 1)
    spread = torch.tensor(std, device=color.device).view(3, 1, 1)
    return (color / 255.0 - low) / spread

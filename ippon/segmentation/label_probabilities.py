"""Conversion of label scores to probabilities, and image tensors."""

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.nn import functional


def probabilities_of(scores: Tensor) -> Tensor:
    """Return probabilities from scores.

    Scores that sum to more than 1 are scaled down. The remainder of a smaller sum is shared equally
    by all labels, which leaves the posterior of a Bayes filter unchanged.

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
    # torch warns about read-only arrays, such as images of messages.
    owned = np.require(color, requirements=("C", "W"))
    return torch.from_numpy(owned).to(device).permute(2, 0, 1)[None].float()


def resized(color: Tensor, size: tuple[int, int]) -> Tensor:
    """Resize a (1, 3, H, W) image with antialiasing."""
    if tuple(color.shape[2:]) == size:
        return color
    return functional.interpolate(
        color, size=size, mode="bilinear", align_corners=False, antialias=True
    )


def normalised(color: Tensor, mean: tuple[float, ...], std: tuple[float, ...]) -> Tensor:
    """Normalise (B, 3, H, W) RGB by mean and standard deviation of a training set."""
    low = torch.tensor(mean, device=color.device).view(3, 1, 1)
    spread = torch.tensor(std, device=color.device).view(3, 1, 1)
    return (color / 255.0 - low) / spread

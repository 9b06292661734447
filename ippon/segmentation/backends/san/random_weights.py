"""A SAN with random weights, for timing and tests."""

import torch
from torch import Tensor

from ippon.segmentation.backends.san.architecture import SanArchitecture
from ippon.segmentation.backends.san.checkpoint import network_of
from ippon.segmentation.backends.san.network import SanNetwork


def random_network(architecture: SanArchitecture, seed: int) -> SanNetwork:
    """Return a network with random weights, scaled to keep activations near 1."""
    with torch.device("meta"):
        empty = SanNetwork(architecture).state_dict()
    generator = torch.Generator().manual_seed(seed)
    state = {
        name: _drawn(name, tensor, generator)
        for name, tensor in empty.items()
        if name != "ov_classifier.attn_mask"
    }
    return network_of(state, architecture, "random weights")


def _drawn(name: str, like: Tensor, generator: torch.Generator) -> Tensor:
    if like.dim() < 2:
        return torch.ones(like.shape) if name.endswith("weight") else torch.zeros(like.shape)
    fan_in = like[0].numel()
    return torch.randn(like.shape, generator=generator) * fan_in**-0.5

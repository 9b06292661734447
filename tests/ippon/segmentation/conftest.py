"""Weights and images that a formula gives, so that they need no file and are the same anywhere."""

import zlib
from collections.abc import Callable, Mapping

import numpy as np
import pytest

Shapes = Mapping[str, tuple[int, ...]]


def _hashed(name: str, size: int) -> np.ndarray:
    """Return (size,) float32 in [-1, 1), spread by multiplicative hashing of the index."""
    bits = np.arange(size, dtype=np.uint64) * np.uint64(2654435761)
    bits = (bits + np.uint64(zlib.crc32(name.encode()))) & np.uint64(0xFFFFFFFF)
    bits ^= bits >> np.uint64(15)
    bits = (bits * np.uint64(2246822519)) & np.uint64(0xFFFFFFFF)
    bits ^= bits >> np.uint64(13)
    return (bits.astype(np.float64) / 2.0**31 - 1.0).astype(np.float32)


def formula_weights(shapes: Shapes) -> dict[str, np.ndarray]:
    """Return weights for given names and shapes: the seed of the recorded reference outputs."""
    weights: dict[str, np.ndarray] = {}
    for name, shape in shapes.items():
        values = _hashed(name, int(np.prod(shape, dtype=np.int64))).reshape(shape)
        norm = "norm" in name or ".ln_" in name or "input_proj.0" in name
        if norm and name.endswith("weight"):
            weights[name] = 1.0 + 0.2 * values
        elif name.endswith(("logit_scale", "bias_scaling.weight")):
            weights[name] = 2.0 + 0.0 * values
        elif len(shape) < 2 or "embed" in name:
            weights[name] = 0.3 * values
        else:
            # Uniform in [-1, 1) has variance 1/3; the factor keeps activations of unit size.
            weights[name] = values * np.float32((3.0 / np.prod(shape[1:])) ** 0.5)
        if name.endswith("query_mlp.layers.2.weight"):
            # Masks are sums over as many products as it has rows.
            weights[name] = weights[name] * np.float32(shape[0] ** -0.5)
    return weights


def formula_image(height: int, width: int) -> np.ndarray:
    """Return an (H, W, 3) uint8 image."""
    values = _hashed("image", height * width * 3).reshape(height, width, 3)
    return ((values + 1.0) * 127.5).astype(np.uint8)


@pytest.fixture(scope="session")
def weights_by_formula() -> Callable[[Shapes], dict[str, np.ndarray]]:
    return formula_weights


@pytest.fixture(scope="session")
def image_by_formula() -> Callable[[int, int], np.ndarray]:
    return formula_image

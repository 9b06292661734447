"""Noise that is correlated between similar views of an object; stateless, computed from keys."""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ippon.geometry import Float64Array

UInt64Array = NDArray[np.uint64]

SECTORS: Final = 24
"""Azimuths of 15 degrees."""
STEP_M: Final = 0.5
"""Distance between draws along the line of sight."""
_WEYL: Final = np.uint64(0x9E3779B97F4A7C15)


def hashed(keys: UInt64Array, *others: NDArray[np.integer] | int) -> UInt64Array:
    """Mix keys with more numbers (SplitMix64; Steele, Lea and Flood, OOPSLA 2014).

    Keys that count from 0 need a seed of many bits: those of two small seeds are the same, in
    another order.

    Args:
        keys: (N,) uint64.
        others: Numbers, or (N,) arrays of them.
    """
    out = keys
    for other in others:
        number = np.asarray(other).astype(np.int64).astype(np.uint64)
        z = (out ^ number) + _WEYL
        z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        out = z ^ (z >> np.uint64(31))
    return out


def normals(keys: UInt64Array) -> Float64Array:
    """Return one standard normal for each key (Box and Muller, 1958)."""
    high = (keys >> np.uint64(40)).astype(np.float64)
    low = (keys & np.uint64(0xFFFFFF)).astype(np.float64)
    # 24 bits each, the middle of their interval, so that no logarithm is infinite.
    radius = np.sqrt(-2.0 * np.log((high + 0.5) * 2.0**-24))
    return radius * np.cos(2.0 * math.pi * (low + 0.5) * 2.0**-24)


def view_noise(keys: UInt64Array, offsets_m: Float64Array) -> Float64Array:
    """Return noise of unit variance that depends on the view.

    It is interpolated between draws 15 degrees and 0.5 m apart, on a grid with a random offset for
    each key. Views 30 degrees or 1 m apart are uncorrelated.

    Args:
        keys: (N,) uint64, one per object.
        offsets_m: (N, 3) metres from the object to the camera.
    """
    phase = hashed(keys, -1)
    shift = (phase >> np.uint64(40)).astype(np.float64) * 2.0**-24
    push = (phase & np.uint64(0xFFFFFF)).astype(np.float64) * 2.0**-24
    turn = np.arctan2(offsets_m[:, 1], offsets_m[:, 0]) / (2.0 * math.pi) * SECTORS + shift
    away = np.linalg.norm(offsets_m, axis=1) / STEP_M + push
    i, j = np.floor(turn).astype(np.int64), np.floor(away).astype(np.int64)
    a, b = turn - i, away - j
    total, square = np.zeros(len(keys)), np.zeros(len(keys))
    for di, wa in ((0, 1.0 - a), (1, a)):
        for dj, wb in ((0, 1.0 - b), (1, b)):
            weight = wa * wb
            total += weight * normals(hashed(keys, (i + di) % SECTORS, j + dj))
            square += weight * weight
    return total / np.sqrt(square)

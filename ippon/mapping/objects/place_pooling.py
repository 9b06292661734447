"""Fusion by places: the pooled likelihood of the images from one place updates the posterior.

With q and L from before the place (see `posterior_arithmetic`), and h the mean over the place's
images of each label's likelihood ratio,

    q_j <- q_j h_j / sum_i q_i h_i        L <- L + log h_O

The common labels exclude each other. The object of interest is updated by its own scores alone: a
detector scores each label separately and also recognises the table under a cup, so the score of
another label is no evidence against the object.
"""

import math
from typing import Final

import numpy as np

from ippon.compiling import njit
from ippon.mapping.arrays import INNER_OPTIONS
from ippon.mapping.objects.surface_voxels import STEPS_PER_NAT
from ippon.observation_model import MOST_NATS

_SUMS: Final = njit(
    **INNER_OPTIONS,
    fastmath={"nnan", "ninf", "nsz", "reassoc", "contract"},
)
_OFFSET: Final = 2.0 * STEPS_PER_NAT * MOST_NATS
_LN_2: Final = math.log(2.0)
_SQRT_HALF_BITS: Final = 0x3F3504F3
_MANTISSA_BITS: Final = 0x7FFFFF


@_SUMS
def likelihoods(heat, v, u, channel, in_order, table, table_of, first, out, n):
    """Write the likelihood ratio of each label at pixel (v, u) to `out`.

    The ratio is 1 for labels that the heatmap lacks, and for those before `first`.
    """
    for j in range(first):
        out[j] = np.float32(1.0)
    if in_order:
        for j in range(first, n):
            out[j] = table[table_of[j], heat[v, u, j]]
    else:
        for j in range(first, n):
            out[j] = np.float32(1.0)
            if channel[j] >= 0:
                out[j] = table[table_of[j], heat[v, u, channel[j]]]


@_SUMS
def pool(sums, base, w, images, likelihood, after, bits, mantissa, mantissa_bits, n):
    """Add an image to its place, and write the row's energies including the place to `after`.

    All energies are offset by `_OFFSET`, which makes them positive. `bits` is `after` reinterpreted
    as int32, one longer than a row, and `mantissa_bits` likewise. Energy is -24 log; x = 2^e m with
    m around 1, and log m = 2 artanh((m - 1) / (m + 1)), to 0.002 steps.

    Returns:
        The least energy.
    """
    share = np.float32(1.0) / np.float32(images)
    for j in range(n):
        sums[w, j] += likelihood[j]
    for j in range(n):
        after[j] = sums[w, j] * share
    low_bits = np.int32(_SQRT_HALF_BITS)
    for j in range(n):
        shifted = np.int32(bits[j] - low_bits)
        mantissa_bits[j] = np.int32(np.int32(shifted & np.int32(_MANTISSA_BITS)) + low_bits)
        bits[j] = np.int32(shifted >> np.int32(23))
    one, two = np.float32(1.0), np.float32(2.0)
    c3, c5 = np.float32(2.0 / 3.0), np.float32(2.0 / 5.0)
    steps, ln_2, offset = np.float32(-STEPS_PER_NAT), np.float32(_LN_2), np.float32(_OFFSET)
    for j in range(n):
        s = (mantissa[j] - one) / (mantissa[j] + one)
        q = s * s
        log = np.float32(bits[j]) * ln_2 + s * (two + q * (c3 + q * c5))
        after[j] = np.float32(base[w, j]) + (steps * log + offset)
    # Positive floats have the order of their bits; see `add_energies`.
    low = np.int32(0x7FFFFFFF)
    for j in range(n):
        low = min(low, bits[j])
    last = after.shape[0] - 1
    bits[last] = low
    return after[last]

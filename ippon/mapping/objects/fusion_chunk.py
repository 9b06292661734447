"""The arithmetic that surface voxels have in common, for a number of them at a time.

One voxel's logarithms and divisions wait for each other; those of many fill vector registers.
"""

import math
from typing import Final, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ippon.mapping.arrays import INNER_OPTIONS
from ippon.mapping.objects.bayes_filter import LOG_ODDS_MAX, ooi_code, share_code
from ippon.mapping.objects.surface_rows import norm_code

_EACH: Final = njit(**INNER_OPTIONS, error_model="numpy")
_LN_2: Final = math.log(2.0)
_SQRT_HALF_BITS: Final = 0x3F3504F3
_MANTISSA_BITS: Final = 0x7FFFFF


class FusionChunk(NamedTuple):
    """What an image says of up to K voxels, and what follows from it; each array is (K,)."""

    number: NDArray[np.int64]
    """Which of the voxels that were asked for."""
    is_common: NDArray[np.bool_]
    """The common objects' posterior has changed."""
    is_ooi: NDArray[np.bool_]
    """The object of interest's has."""
    best: NDArray[np.int32]
    """Label of least energy."""
    top: NDArray[np.float32]
    """p of that label."""
    total: NDArray[np.float32]
    """Sum of p over the labels; in the end its logarithm."""
    weighted: NDArray[np.float32]
    """Sum of p weighted by the levels."""
    mean: NDArray[np.float32]
    """Likelihood of the common objects, but for `shift`; in the end its logarithm."""
    shift: NDArray[np.float32]
    """Log-odds of the OOI before the logarithm of `mean` is taken off; in the end its log-odds."""
    norm: NDArray[np.int16]
    confidence: NDArray[np.uint8]
    proximity: NDArray[np.uint8]
    ooi: NDArray[np.uint8]
    """Codes, see `SurfaceRows` and `MapArrays.ooi`."""
    total_bits: NDArray[np.int32]
    """`total` seen as whole numbers, like `mean_bits` and `mantissa_bits`."""
    mean_bits: NDArray[np.int32]
    mantissa: NDArray[np.float32]
    mantissa_bits: NDArray[np.int32]
    exponent: NDArray[np.float32]


def make_fusion_chunk(size: int) -> FusionChunk:
    """Reserve memory for `size` voxels."""
    total, mean, mantissa = (np.ones(size, np.float32) for _ in range(3))
    return FusionChunk(
        number=np.zeros(size, np.int64),
        is_common=np.zeros(size, np.bool_),
        is_ooi=np.zeros(size, np.bool_),
        best=np.zeros(size, np.int32),
        top=np.zeros(size, np.float32),
        total=total,
        weighted=np.zeros(size, np.float32),
        mean=mean,
        shift=np.zeros(size, np.float32),
        norm=np.zeros(size, np.int16),
        confidence=np.zeros(size, np.uint8),
        proximity=np.zeros(size, np.uint8),
        ooi=np.zeros(size, np.uint8),
        total_bits=total.view(np.int32),
        mean_bits=mean.view(np.int32),
        mantissa=mantissa,
        mantissa_bits=mantissa.view(np.int32),
        exponent=np.zeros(size, np.float32),
    )


@_EACH
def finish_common(chunk, n):
    """Work out the codes of the common objects' posterior for the first n voxels."""
    _shares(chunk.top, chunk.total, chunk.confidence, n)
    _shares(chunk.weighted, chunk.total, chunk.proximity, n)
    _logarithms(
        chunk.total, chunk.total_bits, chunk.mantissa, chunk.mantissa_bits, chunk.exponent, n
    )
    _norms(chunk.total, chunk.norm, n)


@_EACH
def finish_ooi(chunk, n):
    """Work out log-odds and code of the object of interest for the first n voxels."""
    _logarithms(chunk.mean, chunk.mean_bits, chunk.mantissa, chunk.mantissa_bits, chunk.exponent, n)
    _odds(chunk.mean, chunk.shift, n)
    _ooi_codes(chunk.shift, chunk.ooi, n)


@_EACH
def _shares(part, total, out, n):
    for i in range(n):
        out[i] = share_code(part[i], total[i])


@_EACH
def _norms(log_total, out, n):
    for i in range(n):
        out[i] = norm_code(log_total[i])


@_EACH
def _odds(log_mean, shift, n):
    most = np.float32(LOG_ODDS_MAX)
    for i in range(n):
        shift[i] = min(max(shift[i] - log_mean[i], -most), most)


@_EACH
def _ooi_codes(odds, out, n):
    for i in range(n):
        out[i] = ooi_code(odds[i])


@_EACH
def _logarithms(values, bits, mantissa, mantissa_bits, exponent, n):
    """Replace n normal, positive numbers by their natural logarithms, to float32.

    x = 2^e m with m around 1, and log m = 2 artanh((m - 1) / (m + 1)).
    """
    low = np.int32(_SQRT_HALF_BITS)
    for i in range(n):
        shifted = np.int32(bits[i] - low)
        mantissa_bits[i] = np.int32(np.int32(shifted & np.int32(_MANTISSA_BITS)) + low)
        exponent[i] = np.float32(np.int32(shifted >> np.int32(23)))
    one, two, ln_2 = np.float32(1.0), np.float32(2.0), np.float32(_LN_2)
    c3, c5 = np.float32(2.0 / 3.0), np.float32(2.0 / 5.0)
    c7, c9 = np.float32(2.0 / 7.0), np.float32(2.0 / 9.0)
    for i in range(n):
        s = (mantissa[i] - one) / (mantissa[i] + one)
        q = s * s
        values[i] = exponent[i] * ln_2 + s * (two + q * (c3 + q * (c5 + q * (c7 + q * c9))))

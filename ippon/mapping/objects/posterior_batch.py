"""Vectorised arithmetic for a batch of surface voxels: posteriors to codes.

The logarithms and divisions of one voxel depend on each other; those of a batch are vectorised.
"""

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ippon.compiling import njit
from ippon.mapping.arrays import INNER_OPTIONS
from ippon.mapping.objects.posterior_arithmetic import LOG_ODDS_MAX, ooi_code, share_code
from ippon.mapping.objects.surface_voxels import norm_code

_EACH: Final = njit(**INNER_OPTIONS, error_model="numpy")
_LN_2: Final = math.log(2.0)
_SQRT_HALF_BITS: Final = 0x3F3504F3
_MANTISSA_BITS: Final = 0x7FFFFF


class PosteriorBatch(NamedTuple):
    """Likelihoods and posteriors of up to K voxels; each array is (K,)."""

    number: NDArray[np.int64]
    """Index among the requested voxels."""
    is_common: NDArray[np.bool_]
    """Whether the common objects' posterior has changed."""
    is_ooi: NDArray[np.bool_]
    """Whether the posterior of the object of interest has changed."""
    best: NDArray[np.int32]
    """Label of least energy."""
    top: NDArray[np.float32]
    """p of that label."""
    total: NDArray[np.float32]
    """Sum of p over the labels; replaced by its logarithm."""
    weighted: NDArray[np.float32]
    """Sum of p weighted by the levels."""
    mean: NDArray[np.float32]
    """Likelihood of the common objects, up to `shift`; replaced by its logarithm."""
    shift: NDArray[np.float32]
    """Log-odds of the OOI before the logarithm of `mean` is subtracted; replaced by the
    log-odds."""
    norm: NDArray[np.int16]
    confidence: NDArray[np.uint8]
    proximity: NDArray[np.uint8]
    ooi: NDArray[np.uint8]
    """Codes, see `SurfaceVoxels` and `MapArrays.ooi`."""
    total_bits: NDArray[np.int32]
    """`total` reinterpreted as int32, like `mean_bits` and `mantissa_bits`."""
    mean_bits: NDArray[np.int32]
    mantissa: NDArray[np.float32]
    mantissa_bits: NDArray[np.int32]
    exponent: NDArray[np.float32]


def make_posterior_batch(size: int) -> PosteriorBatch:
    """Reserve memory for `size` voxels."""
    total, mean, mantissa = (np.ones(size, np.float32) for _ in range(3))
    return PosteriorBatch(
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
def encode_common_posteriors(batch, n):
    """Compute confidence, proximity and normaliser codes for the first n voxels."""
    _shares(batch.top, batch.total, batch.confidence, n)
    _shares(batch.weighted, batch.total, batch.proximity, n)
    _logarithms(
        batch.total, batch.total_bits, batch.mantissa, batch.mantissa_bits, batch.exponent, n
    )
    _norms(batch.total, batch.norm, n)


@_EACH
def encode_ooi_posteriors(batch, n):
    """Compute log-odds and code of the object of interest for the first n voxels."""
    _logarithms(batch.mean, batch.mean_bits, batch.mantissa, batch.mantissa_bits, batch.exponent, n)
    _odds(batch.mean, batch.shift, n)
    _ooi_codes(batch.shift, batch.ooi, n)


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
    """Replace n normal, positive numbers by their natural logarithms, in float32.

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

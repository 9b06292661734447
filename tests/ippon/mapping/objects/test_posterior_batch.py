"""The arithmetic of many voxels at a time, against numpy's in double precision."""

import numpy as np
import pytest
from numba import njit

from ippon.mapping.objects.posterior_arithmetic import LOG_ODDS_MAX, ooi_code
from ippon.mapping.objects.posterior_batch import (
    encode_common_posteriors,
    encode_ooi_posteriors,
    make_posterior_batch,
)
from ippon.mapping.objects.surface_voxels import NORM_STEPS

SIZE = 2000


@njit
def finish(batch, n):
    """Both at once: they have no way in from Python of their own."""
    encode_common_posteriors(batch, n)
    encode_ooi_posteriors(batch, n)


@pytest.fixture
def numbers():
    return np.random.default_rng(5)


def test_the_object_of_interest(numbers):
    batch = make_posterior_batch(SIZE)
    mean = 10.0 ** numbers.uniform(-6.0, 3.0, SIZE)
    mean[:4] = 1.0, 0.5, np.sqrt(0.5), 2.0
    shift = numbers.uniform(-25.0, 25.0, SIZE).astype(np.float32)
    batch.mean[:], batch.shift[:] = mean, shift
    expected = np.clip(shift - np.log(batch.mean.astype(np.float64)), -LOG_ODDS_MAX, LOG_ODDS_MAX)
    finish(batch, SIZE)
    assert np.abs(batch.shift - expected).max() < 5e-6
    assert np.abs(batch.ooi - 254.0 / (1.0 + np.exp(-expected))).max() < 0.502
    assert [int(code) for code in batch.ooi] == [int(ooi_code(odds)) for odds in batch.shift]
    assert batch.mean[0] == 0.0


def test_logarithms_between_two_powers_of_two_are_exact_to_float32():
    batch = make_posterior_batch(SIZE)
    batch.mean[:] = np.linspace(np.sqrt(0.5), np.sqrt(2.0), SIZE)
    expected = -np.log(batch.mean.astype(np.float64))
    finish(batch, SIZE)
    assert np.abs(batch.shift - expected).max() < 1e-7


def test_the_common_objects(numbers):
    batch = make_posterior_batch(SIZE)
    batch.total[:] = numbers.uniform(1.0, 255.0, SIZE)
    batch.top[:] = 1.0
    batch.weighted[:] = numbers.uniform(0.0, 1.0, SIZE) * batch.total
    total, weighted = batch.total.astype(np.float64), batch.weighted.astype(np.float64)
    finish(batch, SIZE)
    assert np.abs(batch.norm - np.log(total) * NORM_STEPS).max() < 0.51
    assert np.abs(batch.confidence - 254.0 / total).max() < 0.501
    assert np.abs(batch.proximity - 254.0 * weighted / total).max() < 0.501


def test_only_as_many_as_asked():
    batch = make_posterior_batch(4)
    batch.mean[:], batch.total[:] = 2.0, 2.0
    finish(batch, 2)
    assert batch.mean[2:].tolist() == batch.total[2:].tolist() == [2.0, 2.0]
    assert (batch.norm[2:] == 0).all()

"""The arithmetic of many voxels at a time, against numpy's in double precision."""

import numpy as np
import pytest
from numba import njit

from ippon.mapping.objects.bayes_filter import LOG_ODDS_MAX, ooi_code
from ippon.mapping.objects.fusion_chunk import finish_common, finish_ooi, make_fusion_chunk
from ippon.mapping.objects.surface_rows import NORM_STEPS

SIZE = 2000


@njit
def finish(chunk, n):
    """Both at once: they have no way in from Python of their own."""
    finish_common(chunk, n)
    finish_ooi(chunk, n)


@pytest.fixture
def numbers():
    return np.random.default_rng(5)


def test_the_object_of_interest(numbers):
    chunk = make_fusion_chunk(SIZE)
    mean = 10.0 ** numbers.uniform(-6.0, 3.0, SIZE)
    mean[:4] = 1.0, 0.5, np.sqrt(0.5), 2.0
    shift = numbers.uniform(-25.0, 25.0, SIZE).astype(np.float32)
    chunk.mean[:], chunk.shift[:] = mean, shift
    expected = np.clip(shift - np.log(chunk.mean.astype(np.float64)), -LOG_ODDS_MAX, LOG_ODDS_MAX)
    finish(chunk, SIZE)
    assert np.abs(chunk.shift - expected).max() < 5e-6
    assert np.abs(chunk.ooi - 254.0 / (1.0 + np.exp(-expected))).max() < 0.502
    assert [int(code) for code in chunk.ooi] == [int(ooi_code(odds)) for odds in chunk.shift]
    assert chunk.mean[0] == 0.0


def test_the_common_objects(numbers):
    chunk = make_fusion_chunk(SIZE)
    chunk.total[:] = numbers.uniform(1.0, 255.0, SIZE)
    chunk.top[:] = 1.0
    chunk.weighted[:] = numbers.uniform(0.0, 1.0, SIZE) * chunk.total
    total, weighted = chunk.total.astype(np.float64), chunk.weighted.astype(np.float64)
    finish(chunk, SIZE)
    assert np.abs(chunk.norm - np.log(total) * NORM_STEPS).max() < 0.51
    assert np.abs(chunk.confidence - 254.0 / total).max() < 0.501
    assert np.abs(chunk.proximity - 254.0 * weighted / total).max() < 0.501


def test_only_as_many_as_asked():
    chunk = make_fusion_chunk(4)
    chunk.mean[:], chunk.total[:] = 2.0, 2.0
    finish(chunk, 2)
    assert chunk.mean[2:].tolist() == chunk.total[2:].tolist() == [2.0, 2.0]
    assert (chunk.norm[2:] == 0).all()

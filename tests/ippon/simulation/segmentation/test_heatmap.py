import numpy as np
import pytest

from ippon.simulation.segmentation.heatmap import blend, neighbours, sample_instances
from tests.reference import heatmap as reference

STILL = np.zeros((2, 2, 2), dtype=np.float32)


def rows(rng, count, channels):
    p = rng.dirichlet(np.full(channels, 0.3), count)
    return p.astype(np.float32)


@pytest.mark.parametrize("seed", range(3))
def test_blending_agrees_with_numpy_and_sums_to_255(seed):
    rng = np.random.default_rng(seed)
    samples = rng.integers(0, 5, (20, 30, 5)).astype(np.int32)
    samples[:10] = samples[:10, :, :1]
    good, bad = rows(rng, 5, 41), rows(rng, 5, 41)
    field = rng.normal(size=(4, 6)).astype(np.float32)
    got = blend(samples, good, bad, field)
    assert (got.sum(axis=2, dtype=int) == 255).all()
    expected = 255.0 * reference.blended(samples, good, bad, field)
    # One channel of a pixel, a large one, takes the rounding of the others upon itself.
    errors = np.sort(np.abs(got - expected), axis=2)
    assert errors[..., -2].max() < 1.0
    assert errors[..., -1].max() < 5.0


def test_flat_distributions_favour_no_channel():
    flat = np.full((1, 41), 1.0 / 41.0, dtype=np.float32)
    samples, field = np.zeros((2, 2, 5), dtype=np.int32), np.zeros((2, 2), dtype=np.float32)
    got = blend(samples, flat, flat, field)
    assert (got.sum(axis=2, dtype=int) == 255).all()
    assert np.ptp(got) <= 1


def test_samples_are_read_around_the_pixel():
    image = np.arange(100 * 160, dtype=np.int32).reshape(100, 160)
    samples = sample_instances(image, (50, 80), 1.0, STILL)
    v, u = np.divmod(samples, 160)
    np.testing.assert_array_equal(v[..., 0], np.arange(50)[:, None] * 2 + 1 + 0 * u[..., 0])
    np.testing.assert_array_equal(u[10, 1:-1, 0] - u[10, 1:-1, 1], 2)
    np.testing.assert_array_equal(u[10, 1:-1, 2] - u[10, 1:-1, 0], 2)
    np.testing.assert_array_equal(v[1:-1, 10, 0] - v[1:-1, 10, 3], 2)
    np.testing.assert_array_equal(v[1:-1, 10, 4] - v[1:-1, 10, 0], 2)
    # At the border the image's own edge is read.
    assert samples.min() >= 0
    assert u[0, 0, 1] == 0
    assert v[-1, 0, 4] == 99


def test_a_warp_moves_the_samples():
    image = np.tile(np.arange(160, dtype=np.int32), (100, 1))
    moved = STILL.copy()
    moved[..., 1] = 3.0
    still = sample_instances(image, (100, 160), 0.0, STILL)[..., 0]
    shifted = sample_instances(image, (100, 160), 0.0, moved)[..., 0]
    np.testing.assert_array_equal(shifted[:, :-3], still[:, :-3] + 3)


def test_neighbours_are_those_with_the_longest_border():
    labels = np.zeros((10, 10), dtype=np.int32)
    labels[:, 5:] = 1
    labels[3:5, 6:8] = 2
    labels[9, 4] = 3
    np.testing.assert_array_equal(neighbours(labels, 5), [1, 0, 1, 0, 4])

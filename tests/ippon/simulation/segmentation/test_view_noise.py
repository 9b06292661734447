import numpy as np
import pytest

from ippon.simulation.segmentation.view_noise import hashed, normals, view_noise

KEYS = hashed(np.arange(20_000, dtype=np.uint64), 7)


def seen_from(degrees, distance_m):
    angle = np.radians(degrees)
    offset = [distance_m * np.cos(angle), distance_m * np.sin(angle), 1.0]
    return view_noise(KEYS, np.tile(offset, (len(KEYS), 1)))


def test_normals_are_standard_normal():
    draws = normals(KEYS)
    assert draws.mean() == pytest.approx(0.0, abs=0.03)
    assert draws.std() == pytest.approx(1.0, abs=0.03)
    assert (np.abs(draws) < 1.96).mean() == pytest.approx(0.95, abs=0.01)


def test_other_keys_give_independent_draws():
    assert len(np.unique(KEYS)) == len(KEYS)
    for other in (hashed(KEYS, 0), hashed(KEYS, 1), hashed(KEYS, -1), np.roll(KEYS, 1)):
        assert np.corrcoef(normals(KEYS), normals(other))[0, 1] == pytest.approx(0.0, abs=0.03)


def test_a_view_always_has_the_same_noise_of_unit_variance():
    np.testing.assert_array_equal(seen_from(33.0, 2.0), seen_from(33.0, 2.0))
    for view in ((0.0, 1.0), (179.9, 2.3), (-77.0, 4.0)):
        assert seen_from(*view).std() == pytest.approx(1.0, abs=0.03)


@pytest.mark.parametrize(
    ("degrees", "metres", "least", "most"),
    [
        (1.0, 0.02, 0.95, 1.0),
        (8.0, 0.1, 0.5, 0.9),
        (31.0, 0.0, -0.03, 0.03),
        (0.0, 1.1, -0.03, 0.03),
    ],
)
def test_similar_views_are_correlated_and_others_are_not(degrees, metres, least, most):
    at = 175.0  # Beyond it the azimuth wraps.
    alike = np.corrcoef(seen_from(at, 2.0), seen_from(at + degrees, 2.0 + metres))[0, 1]
    assert least <= alike <= most

import numpy as np

from ippon.mapping.blocks import BlockDirectory


def test_a_directory_at_its_limit_still_takes_what_it_covers():
    directory = BlockDirectory(40**3)
    low, high = np.zeros(3, np.int64), np.array([20, 20, 8])
    directory.cover(low, low + 1)
    assert directory.fits(low, high)
    directory.cover(low, high)
    covered = directory.rows.shape
    assert directory.fits(low, high)
    directory.cover(low, high)
    assert directory.rows.shape == covered
    assert not directory.fits(low, high + 40)


def test_what_fits_stays_within_the_limit_once_it_is_covered():
    rng = np.random.default_rng(0)
    limit = 60**3
    directory = BlockDirectory(limit)
    for _ in range(200):
        low = rng.integers(-40, 40, 3)
        high = low + rng.integers(1, 12, 3)
        if directory.fits(low, high):
            directory.cover(low, high)
            assert (directory.origin <= low).all()
            assert (directory.origin + directory.rows.shape >= high).all()
            assert directory.rows.size <= limit

import numpy as np
import pytest

from ippon.seed import LARGEST_SEED, check_seed
from ippon.simulation.segmentation.view_noise import hashed


@pytest.mark.parametrize("seed", [-1, LARGEST_SEED + 1, 2**64])
def test_a_seed_that_cannot_be_hashed_is_refused(seed):
    with pytest.raises(ValueError, match=rf"a seed is a whole number .*; got {seed}"):
        check_seed(seed)


@pytest.mark.parametrize("seed", [0, LARGEST_SEED])
def test_the_least_and_the_largest_seed(seed):
    check_seed(seed)
    assert len(hashed(np.arange(3, dtype=np.uint64), seed)) == 3

import numpy as np
import pytest

from ippon.segmentation.compact_heatmap import expand_top, keep_top


@pytest.fixture
def probabilities():
    rng = np.random.default_rng(3)
    p = rng.dirichlet(np.full(12, 0.15), size=(9, 7))
    return np.array([[rng.multinomial(255, q) for q in row] for row in p], np.uint8)


@pytest.mark.parametrize("count", [1, 3, 12, 40])
def test_sums_and_kept_channels_are_exact(probabilities, count):
    top = keep_top(probabilities, count)
    back = expand_top(top, 12)
    assert (back.sum(axis=2, dtype=int) == 255).all()
    kept = np.take_along_axis(back, top.channels.transpose(1, 2, 0).astype(int), axis=2)
    np.testing.assert_array_equal(kept, top.values.transpose(1, 2, 0))
    np.testing.assert_array_equal(back.max(axis=2), probabilities.max(axis=2))


def test_all_labels_kept_is_the_heatmap(probabilities):
    np.testing.assert_array_equal(expand_top(keep_top(probabilities, 12), 12), probabilities)


def test_the_largest_are_kept(probabilities):
    top = keep_top(probabilities, 4)
    expected = -np.sort(-probabilities.astype(int), axis=2)[..., :4]
    np.testing.assert_array_equal(top.values.transpose(1, 2, 0), expected)


def test_the_object_of_interest_is_exact_however_small(probabilities):
    back = expand_top(keep_top(probabilities, 2, always=(7,)), 12)
    np.testing.assert_array_equal(back[..., 7], probabilities[..., 7])


def test_several_objects_of_interest_are_exact_however_many(probabilities):
    always = (7, 2, 5)
    back = expand_top(keep_top(probabilities, 2, always), 12)
    np.testing.assert_array_equal(back[..., always], probabilities[..., always])


def test_the_remainder_is_shared_equally():
    p = np.array([[[200, 30, 15, 7, 3]]], np.uint8)
    back = expand_top(keep_top(p, 1), 5)
    assert back[0, 0, 0] == 200
    assert sorted(back[0, 0, 1:].tolist()) == [13, 14, 14, 14]


def test_a_count_of_zero_and_unknown_channels_are_rejected(probabilities):
    with pytest.raises(ValueError, match="at least one label a pixel is kept; got 0"):
        keep_top(probabilities, 0)
    with pytest.raises(ValueError, match="of 3"):
        expand_top(keep_top(probabilities, 2), 3)

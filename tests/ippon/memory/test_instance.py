import numpy as np
import pytest

from ippon.memory.instance import box_of, box_overlap


def test_a_box_overlaps_itself_wholly_and_one_beside_it_not_at_all(make_instance):
    one = make_instance(at=(1.0, 1.0, 0.5))
    assert box_overlap(one, one) == pytest.approx(1.0)
    assert box_overlap(one, make_instance(at=(1.5, 1.0, 0.5))) == 0.0
    assert box_overlap(one, make_instance(at=(1.2, 1.0, 0.5))) == pytest.approx(0.5)


def test_a_small_box_inside_a_large_one_overlaps_wholly(make_instance):
    large = make_instance(size_m=(2.0, 2.0, 1.0))
    small = make_instance(size_m=(0.1, 0.1, 0.1))
    assert box_overlap(large, small) == box_overlap(small, large) == pytest.approx(1.0)


def test_a_box_has_the_centre_and_size_of_its_corners():
    assert box_of(np.array([0.0, 1.0, 2.0]), np.array([1.0, 3.0, 2.5])) == (
        (0.5, 2.0, 2.25),
        (1.0, 2.0, 0.5),
    )

"""The parts that are left out of `ippon`, one at a time."""

import pytest

from ippon.mission.config import MissionConfig
from tests.benchmarks.exploring import COMPARED, METHODS_COMPARED, VARIANTS


@pytest.mark.parametrize("name", VARIANTS)
def test_each_variant_leaves_something_out(name):
    usual = MissionConfig()
    assert VARIANTS[name](usual) != usual


def test_ippon_comes_first_because_the_others_are_compared_with_it():
    assert list(COMPARED)[: len(METHODS_COMPARED)] == list(METHODS_COMPARED)
    assert next(iter(COMPARED)) == "ippon"
    assert len(COMPARED) == len(METHODS_COMPARED) + len(VARIANTS)

"""What is opened before a search gives up, and closed when it has ended."""

import numpy as np
import pytest

from ippon.planning.terrain.second_chances import SecondChances
from ippon.planning.terrain.traversability import Traversability, TraversabilityConfig
from ippon.robot import ZED

FULL_M = TraversabilityConfig().margin_m
HERE, THERE = np.array([1.0, 2.0]), np.array([4.0, 2.0])


@pytest.fixture
def floor():
    return Traversability(TraversabilityConfig(), ZED)


@pytest.fixture
def chances(floor):
    return SecondChances(floor, 2)


def test_a_search_has_a_number_of_chances_that_another_one_has_again(floor, chances):
    chances.begin()
    assert chances.relax()
    assert floor.margin_m < FULL_M
    assert not chances.relax(), "nothing is closed, and no chance is taken for it"
    floor.restore()
    assert chances.relax()
    floor.restore()
    assert not chances.relax(), "both were taken"
    chances.begin()
    assert chances.relax()


def test_a_look_takes_its_tries_at_once_and_leaves_those_of_the_search(floor, chances):
    chances.begin()
    assert chances.relax_for_look()
    assert not chances.relax_for_look()
    floor.restore()
    assert not chances.relax_for_look(), "a contact that comes later stays closed"
    assert chances.relax(), "before the search gives up"


def test_without_a_search_nothing_is_relaxed(floor, chances):
    assert not chances.relax()
    chances.begin()
    chances.set_searching(True, counts=False)
    assert not chances.relax(), "nobody follows the plan"
    chances.set_searching(True)
    chances.relax()
    chances.set_searching(True)
    assert floor.margin_m < FULL_M, "it still runs"
    chances.set_searching(False)
    assert floor.margin_m == FULL_M
    assert not chances.relax()
    chances.set_searching(True)
    assert chances.relax(), "it goes on, after a find that was rejected"


def test_narrow_gaps_are_opened_for_a_point_until_there_is_another_one(floor, chances):
    assert chances.open_for(HERE)
    assert floor.margin_m < FULL_M
    assert not chances.open_for(HERE)
    assert not chances.close_for(HERE)
    assert chances.close_for(THERE)
    assert floor.margin_m == FULL_M
    chances.open_for(THERE)
    chances.set_searching(True)
    assert floor.margin_m == FULL_M
    assert not chances.open_for(THERE), "the search decides"

"""Whether the robot could start a search at once."""

import pytest

from app.nodes.navigator.state.availability import Availability
from tests.app.nodes.console.drawn_home import status_of


@pytest.fixture
def availability(desk):
    """Of a robot whose queue has one goal, the hat, which is searched for."""
    desk.goals.availability.status = status_of("searching", frames=10, why="drives")
    return desk.goals.availability


def finish(desk, outcome="exhausted"):
    desk.queue.conclude(outcome)


def test_a_goal_that_is_searched_for_or_waits_is_in_the_way(desk, availability):
    assert availability.obstacle("searching") == ("searching", "hat")
    desk.search("keys")
    finish(desk)
    assert availability.obstacle("exhausted") == ("searching", "keys")
    desk.queue.next()
    finish(desk)
    assert availability.obstacle("exhausted") == ("", "")


@pytest.mark.parametrize("state", ["stopped", "paused", "manual"])
def test_a_person_holds_or_drives_it(desk, availability, state):
    assert availability.obstacle(state) == (state, "")
    finish(desk)
    assert availability.obstacle(state) == (state, "")


def test_the_mission_says_earlier_than_the_status_that_it_goes_on(desk, availability):
    finish(desk)
    availability.status = status_of("stopped", frames=10)
    assert availability.obstacle("starting") == ("", "")


@pytest.mark.parametrize("state", ["lost", "ended"])
def test_without_data_it_is_not_free(desk, availability, state):
    finish(desk)
    availability.status = status_of(state, frames=10, why="waiting for tf (3.0 s)")
    assert availability.obstacle("exhausted") == ("lost", "waiting for tf (3.0 s)")


def test_before_the_first_frame_it_is_not_free(desk):
    availability = Availability(desk.queue)
    assert availability.obstacle("starting") == ("starting", "")
    availability.status = status_of("starting", frames=0, why="waiting for the robot's depth")
    assert availability.obstacle("starting") == ("starting", "waiting for the robot's depth")


def test_a_find_is_announced_for_a_while(desk, availability):
    finish(desk, "found")
    availability.hold(100.0)
    assert availability.obstacle("found") == ("found", "")
    availability.hold(0.0)
    assert availability.obstacle("found") == ("", "")
